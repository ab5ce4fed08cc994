/* judge/plans.h - which entries a comparison has, before any is drawn.      Tier 4, private. */
#ifndef DPH_JUDGE_PLANS_H
#define DPH_JUDGE_PLANS_H

#include <diaphan/judge.h>

/* An entry before it is drawn; it becomes two where there are fits. */
struct dph_plan {
    const struct dph_method *method;
    char variant[48];
    bool shown;
    int bake;               /* which of the bakes; -1: any */
    int bands;              /* to draw with; 0: all that are stored */
    int response;           /* bands of a response that is made for the plan; 0: any */
    enum dph_formula formula;
    enum dph_curve curve, fitted_curve;
};

/* A way to bake thickness. */
struct dph_way {
    bool stored; /* as the file has it */
    enum dph_fit fit;
    int bands;
};

enum { DPH_MOST_PLANS = 64, DPH_MOST_WAYS = 8 };

struct dph_plans {
    int nplan, nway;
    struct dph_plan plan[DPH_MOST_PLANS];
    struct dph_way way[DPH_MOST_WAYS];
};

/* The entries of a material, unfitted ones only; what they are drawn from. */
void dph_plans_make(struct dph_plans *plans, const struct dph_scene *scene, bool stored,
                    const struct dph_judge_params *params, const struct dph_material *material);

#endif
