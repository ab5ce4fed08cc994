/* chart.h - a chart of grouped bars, the way fig. 4 of the paper shows speed: for every setting
 * (a group: frame and camera) a bar for every method (a series), several panels side by side that
 * share their axis (unshared, indexed). One description gives the SVG and the PNG. */
#ifndef CHART_H
#define CHART_H

#include <diaphan/error.h>

/* One measurement. */
struct chart_value {
    double value;     /* length of the bar, 0 or more; NaN: not measured, shown as a dash        */
    double low, high; /* ends of the whisker, for instance 5th and 95th percentile; NaN: none    */
    double ratio;     /* shown behind the value as "x 1.25", for instance to lambert; NaN: none  */
};

/* What a bar is of. */
struct chart_series {
    const char *method; /* a method's name: the colour. Methods keep theirs from chart to chart;
                           several series of one method are told apart by its lightness          */
    const char *label;  /* stands beside the bar, for instance "shsss, 36 snorm8"                */
};

/* Everything that is drawn; the caller keeps what pointers point to. Texts are UTF-8; what is not
 * becomes '?'. */
struct chart {
    const char *title;
    const char *subtitle; /* Nullable: model, vertices, what was held fixed            */
    const char *axis;     /* what the bars measure, with its unit: "frames per second" */
    const char *ratio;    /* what the ratios are of, for the legend; Nullable          */
    const char *foot;     /* Nullable: machine, driver, commit; wrapped to the width   */
    int npanel, ngroup, nseries;      /* at least 1 each, at most 8, 16 and 64 */
    const char *const *panel;         /* (npanel) titles                       */
    const char *const *group;         /* (ngroup) titles, "1280 x 800, near"   */
    const struct chart_series *series; /* (nseries)                            */
    const struct chart_value *value;  /* (npanel x ngroup x nseries)           */
};

/* Writes the chart to `path`, a .svg or a .png, whole or not at all. False: DPH_ERROR_ARGUMENT
 * (another ending, a size out of its range), _OUTPUT, _MEMORY. */
bool chart_save(const struct chart *chart, const char *path, struct dph_error *err);

#endif
