/* The bar of the phase that is under way. */
#include "watch.h"

static bool step(void *user, enum dph_judge_phase phase, const char *material, double fraction)
{
    struct watch *watch = user;
    if (!watch->begun || watch->phase != phase || watch->material != material) {
        if (watch->begun)
            progress_end(&watch->progress);
        snprintf(watch->label, sizeof watch->label, "%s %.60s", dph_judge_phase_name(phase),
                 material);
        watch->begun = true;
        watch->phase = phase;
        watch->material = material;
        progress_begin(&watch->progress, watch->settings, watch->label);
    }
    progress_step(&watch->progress, fraction);
    if (!interrupt_noted())
        return true;
    watch->cut = watch->cut || phase == DPH_JUDGE_TRAINING;
    return false;
}

void watch_begin(struct watch *watch, const struct settings *settings,
                 struct dph_judge_params *params)
{
    *watch = (struct watch){.settings = settings};
    params->progress = step;
    params->progress_user = watch;
    interrupt_begin();
}

void watch_end(struct watch *watch)
{
    if (watch->begun)
        progress_end(&watch->progress);
    interrupt_end();
    if (watch->cut)
        warn(watch->settings, "stopped: the fit has learnt from the samples so far");
}
