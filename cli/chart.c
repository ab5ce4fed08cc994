/* Grouped bars, lying, so that names and values stand beside their bars in the reading direction.
 *
 * The rows are the groups one below the other, and in each the series; the panels stand side by
 * side and share rows and axis. The axis begins at 0, unless the values span more than LOG_SPAN to
 * one: then it is logarithmic, begins at a power of ten, and says so. Where a bar's ratio is 1, a
 * line at its end runs through its group: what all others are measured by.
 *
 * Colours are those of M. Okabe and K. Ito, Color Universal Design (2008), which stay apart for the
 * colour-blind; lightness tells the series of one method apart, and every bar is named besides. */
#include "chart.h"

#include "canvas.h"
#include "text.h"

#include <math.h>
#include <string.h>
#include <strings.h>

/* Points. */
#define WIDTH 1000.0
#define MARGIN 30.0
#define GAP 26.0       /* between panels                 */
#define PITCH 15.0     /* from bar to bar                */
#define BAR 11.0       /* height of a bar                */
#define HEAD 27.0      /* a group's title, above its bars */
#define PIXELS 2.0     /* of a PNG, a point               */
#define LOG_SPAN 40.0

enum { MAX_PANELS = 8, MAX_GROUPS = 16, MAX_SERIES = 64, MAX_TICKS = 40 };

enum { INK = 0x1a1a1a, GREY = 0x6b6b6b, RULE = 0xb8b8b8, GRID = 0xe4e4e4 };

static const struct type title_type = {19, INK, true, ALIGN_LEFT},
                         subtitle_type = {11.5, GREY, false, ALIGN_LEFT},
                         panel_type = {12.5, INK, true, ALIGN_LEFT},
                         group_type = {11.5, INK, true, ALIGN_LEFT},
                         label_type = {10.5, INK, false, ALIGN_RIGHT},
                         legend_type = {10.5, INK, false, ALIGN_LEFT},
                         value_type = {10, INK, false, ALIGN_LEFT},
                         ratio_type = {10, GREY, false, ALIGN_RIGHT},
                         tick_type = {9.5, GREY, false, ALIGN_CENTRE},
                         axis_type = {10, GREY, false, ALIGN_LEFT},
                         foot_type = {9.5, GREY, false, ALIGN_LEFT};

static const struct {
    const char *method;
    unsigned colour;
} palette[] = {
    {"lambert", 0x8c8c8c},     {"shsss", 0xd55e00}, {"green", 0x009e73},
    {"green-gauss", 0x56b4e9}, {"prt", 0x0072b2},   {"prt-cpca", 0xcc79a7},
    {"patro", 0xf0e442},       {"reference", 0x1a1a1a},
};
enum { NPALETTE = sizeof palette / sizeof palette[0], SPARE = 0xe69f00 };

struct axis {
    bool logarithmic;
    double low, high; /* values at the ends */
    int ntick;
    double tick[MAX_TICKS];
};

/* A chart on its way to the page. */
struct drawing {
    const struct chart *chart;
    struct canvas *canvas;
    struct axis axis;
    double labels;       /* width of the column of names                  */
    double first, panel; /* left side of the first panel, width of each   */
    double bars;         /* of a panel, the part that bars may fill       */
    double top, bottom;  /* of the rows                                   */
};

/* 0xRRGGBB moved from a to b. */
static unsigned mix(unsigned a, unsigned b, double t)
{
    unsigned out = 0;
    for (int shift = 16; shift >= 0; shift -= 8) {
        double from = a >> shift & 255, to = b >> shift & 255;
        out |= (unsigned)lrint(from + t * (to - from)) << shift;
    }
    return out;
}

static unsigned method_colour(const char *method)
{
    for (int i = 0; i < NPALETTE; i++)
        if (strcmp(palette[i].method, method) == 0)
            return palette[i].colour;
    return SPARE;
}

/* The last series of a method has its colour, those before are lighter. */
static unsigned series_colour(const struct chart *chart, int series)
{
    const char *method = chart->series[series].method;
    int before = 0, all = 0;
    for (int i = 0; i < chart->nseries; i++)
        if (strcmp(chart->series[i].method, method) == 0) {
            all++;
            before += i < series;
        }
    double light = all > 1 ? 0.62 * (all - 1 - before) / (all - 1) : 0;
    return mix(method_colour(method), 0xffffff, light);
}

static const struct chart_value *value_at(const struct chart *chart, int panel, int group,
                                          int series)
{
    return &chart->value[(panel * chart->ngroup + group) * chart->nseries + series];
}

/* Three digits, as many as a glance takes in. */
static void print_value(double value, char out[32])
{
    if (!isfinite(value))
        snprintf(out, 32, "\xe2\x80\x93");
    else if (value != 0 && (value < 0.01 || value >= 1e6))
        snprintf(out, 32, "%.2g", value);
    else
        snprintf(out, 32, "%.*f", value < 9.995 ? 2 : value < 99.95 ? 1 : 0, value);
}

static void print_ratio(double ratio, char out[32])
{
    if (isfinite(ratio))
        snprintf(out, 32, "%.*f\xc3\x97", ratio < 99.95 ? 2 : 0, ratio);
    else
        out[0] = 0;
}

/* A step of 1, 2 or 5 times a power of ten, of which about `count` span `range`. */
static double round_step(double range, double count)
{
    double power = pow(10, floor(log10(range / count))), lead = range / count / power;
    return power * (lead <= 1 ? 1 : lead <= 2 ? 2 : lead <= 5 ? 5 : 10);
}

static struct axis find_axis(const struct chart *chart)
{
    struct axis axis = {0};
    double least = INFINITY, most = 0;
    int count = chart->npanel * chart->ngroup * chart->nseries;
    for (int i = 0; i < count; i++) {
        double value = chart->value[i].value;
        if (!isfinite(value) || value < 0)
            continue;
        most = fmax(most, fmax(value, isfinite(chart->value[i].high) ? chart->value[i].high : 0));
        if (value > 0)
            least = fmin(least, value);
    }
    if (most <= 0)
        most = least = 1;
    axis.logarithmic = most / least > LOG_SPAN;
    if (axis.logarithmic) {
        static const double lead[] = {1, 2, 5};
        int from = (int)floor(log10(least)), to = (int)floor(log10(most));
        if (pow(10, from) > 0.7 * least) /* the shortest bar should be seen */
            from--;
        axis.low = pow(10, from);
        axis.high = most;
        int step = to - from > 2 ? 3 : 1; /* over many decades their beginnings alone */
        for (int d = from; d <= to && axis.ntick < MAX_TICKS; d++)
            for (int k = 0; k < 3 && axis.ntick < MAX_TICKS; k += step)
                if (lead[k] * pow(10, d) <= most * 1.0001)
                    axis.tick[axis.ntick++] = lead[k] * pow(10, d);
    } else {
        double step = round_step(most, 5);
        axis.high = most;
        for (int i = 0; i * step <= most * 1.0001 && axis.ntick < MAX_TICKS; i++)
            axis.tick[axis.ntick++] = i * step;
    }
    return axis;
}

/* Where a value stands, from the left end of the axis. */
static double place(const struct drawing *d, double value)
{
    const struct axis *axis = &d->axis;
    double t = axis->logarithmic
                   ? log(fmax(value, axis->low) / axis->low) / log(axis->high / axis->low)
                   : value / axis->high;
    return d->bars * fmin(fmax(t, 0), 1);
}

static double panel_left(const struct drawing *d, int panel)
{
    return d->first + panel * (d->panel + GAP);
}

/* The columns: names, panels, and in each panel bars and the texts behind them. */
static void lay_out(struct drawing *d)
{
    const struct chart *chart = d->chart;
    double texts = 0;
    char text[32];
    for (int i = 0; i < chart->nseries; i++)
        d->labels = fmax(d->labels, canvas_text_width(d->canvas, &label_type,
                                                      chart->series[i].label));
    for (int i = 0; i < chart->ngroup; i++)
        d->labels = fmax(d->labels, canvas_text_width(d->canvas, &group_type, chart->group[i]));
    d->labels = fmin(ceil(d->labels + 1), WIDTH * 0.28);
    for (int i = 0; i < chart->npanel * chart->ngroup * chart->nseries; i++) {
        print_value(chart->value[i].value, text);
        double width = canvas_text_width(d->canvas, &value_type, text);
        print_ratio(chart->value[i].ratio, text);
        if (text[0])
            width += canvas_text_width(d->canvas, &ratio_type, text) + 12;
        texts = fmax(texts, width);
    }
    d->first = MARGIN + d->labels + 8;
    d->panel = (WIDTH - MARGIN - d->first - GAP * (chart->npanel - 1)) / chart->npanel;
    d->bars = fmax(d->panel - texts - 8, d->panel * 0.3);
}

static void draw_grid(const struct drawing *d)
{
    char text[32];
    double space = canvas_text_width(d->canvas, &tick_type, "0000");
    for (int p = 0; p < d->chart->npanel; p++) {
        double left = panel_left(d, p), last = -INFINITY;
        for (int i = 0; i < d->axis.ntick; i++) {
            double x = left + place(d, d->axis.tick[i]);
            canvas_line(d->canvas, x, d->top, x, d->bottom, 0.75, GRID);
            if (x - last < space)
                continue;
            last = x;
            snprintf(text, sizeof text, "%g", d->axis.tick[i]);
            canvas_text(d->canvas, x, d->bottom + 13, &tick_type, text);
        }
        canvas_text_within(d->canvas, left, d->top - 8, d->panel, &panel_type,
                           d->chart->panel[p]);
        char title[256];
        snprintf(title, sizeof title, "%s%s", d->chart->axis,
                 d->axis.logarithmic ? ", logarithmic" : "");
        canvas_text_within(d->canvas, left, d->bottom + 28, d->panel, &axis_type, title);
    }
}

static void draw_bar(const struct drawing *d, double left, double y, int series,
                     const struct chart_value *value)
{
    char text[32];
    unsigned colour = series_colour(d->chart, series);
    double end = left, middle = y + BAR / 2;
    if (isfinite(value->value) && value->value >= 0) {
        double length = place(d, value->value);
        end = left + length;
        canvas_rectangle(d->canvas, left, y, length, BAR, colour);
        canvas_frame(d->canvas, left, y, fmax(length, 0.5), BAR, 0.5, mix(colour, 0, 0.35));
        if (isfinite(value->low) && isfinite(value->high) && value->high > value->low) {
            double low = left + place(d, value->low), high = left + place(d, value->high);
            canvas_line(d->canvas, low, middle, high, middle, 0.8, INK);
            canvas_line(d->canvas, low, middle - 2.5, low, middle + 2.5, 0.8, INK);
            canvas_line(d->canvas, high, middle - 2.5, high, middle + 2.5, 0.8, INK);
            end = fmax(end, high);
        }
    }
    print_value(value->value, text);
    canvas_rectangle(d->canvas, end + 2, y, canvas_text_width(d->canvas, &value_type, text) + 4,
                     BAR, 0xffffff); /* keeps lines off the digits */
    canvas_text(d->canvas, end + 4, y + BAR - 2, &value_type, text);
    print_ratio(value->ratio, text);
    canvas_text(d->canvas, left + d->panel, y + BAR - 2, &ratio_type, text);
}

static void draw_group(const struct drawing *d, int group, double y)
{
    const struct chart *chart = d->chart;
    double right = panel_left(d, chart->npanel - 1) + d->panel, rows = y + HEAD;
    canvas_line(d->canvas, MARGIN, y + 4, right, y + 4, 0.75, RULE);
    canvas_text_within(d->canvas, MARGIN, y + HEAD - 7, d->first + d->bars / 2 - MARGIN,
                       &group_type, chart->group[group]);
    for (int s = 0; s < chart->nseries; s++)
        canvas_text_within(d->canvas, d->first - 8, rows + s * PITCH + BAR - 2, d->labels,
                           &label_type, chart->series[s].label);
    for (int p = 0; p < chart->npanel; p++) {
        double left = panel_left(d, p);
        canvas_line(d->canvas, left, rows - 2, left, rows + chart->nseries * PITCH - 2, 0.75, INK);
        for (int s = 0; s < chart->nseries; s++) {
            const struct chart_value *value = value_at(chart, p, group, s);
            if (value->ratio == 1 && isfinite(value->value) && value->value > 0) {
                double x = left + place(d, value->value);
                canvas_line(d->canvas, x, rows - 2, x, rows + chart->nseries * PITCH - 2, 0.75,
                            GREY);
            }
        }
        for (int s = 0; s < chart->nseries; s++)
            draw_bar(d, left, rows + s * PITCH, s, value_at(chart, p, group, s));
    }
}

/* A swatch for every method, in the order of the series; returns the height taken. */
static double draw_legend(const struct drawing *d, double y, bool draw)
{
    const struct chart *chart = d->chart;
    double x = MARGIN, start = y;
    for (int i = 0; i < chart->nseries; i++) {
        const char *method = chart->series[i].method;
        bool seen = false;
        for (int k = 0; k < i; k++)
            seen |= strcmp(chart->series[k].method, method) == 0;
        if (seen)
            continue;
        double width = 15 + canvas_text_width(d->canvas, &legend_type, method) + 18;
        if (x + width > WIDTH - MARGIN && x > MARGIN) {
            x = MARGIN;
            y += 16;
        }
        if (draw) {
            unsigned colour = method_colour(method);
            canvas_rectangle(d->canvas, x, y - 9, 10, 10, colour);
            canvas_frame(d->canvas, x, y - 9, 10, 10, 0.5, mix(colour, 0, 0.35));
            canvas_text(d->canvas, x + 15, y, &legend_type, method);
        }
        x += width;
    }
    if (chart->ratio) {
        struct type type = subtitle_type;
        type.size = legend_type.size;
        if (x + canvas_text_width(d->canvas, &type, chart->ratio) > WIDTH - MARGIN) {
            x = MARGIN;
            y += 16;
        }
        if (draw)
            canvas_text_within(d->canvas, x, y, WIDTH - MARGIN - x, &type, chart->ratio);
    }
    return y + 16 - start;
}

/* Draws everything, or only finds the height that it takes. */
static double draw_chart(struct drawing *d, bool draw)
{
    const struct chart *chart = d->chart;
    double y = MARGIN + 14;
    if (draw)
        canvas_text_within(d->canvas, MARGIN, y, WIDTH - 2 * MARGIN, &title_type, chart->title);
    if (chart->subtitle)
        y += 20 + 15 * (canvas_paragraph(d->canvas, MARGIN, y + 20, WIDTH - 2 * MARGIN, 15,
                                         &subtitle_type, chart->subtitle, draw) - 1);
    y += 24;
    y += draw_legend(d, y, draw);
    d->top = y + 22;
    double group = HEAD + chart->nseries * PITCH + 3;
    d->bottom = d->top + chart->ngroup * group;
    if (draw) {
        draw_grid(d);
        for (int g = 0; g < chart->ngroup; g++)
            draw_group(d, g, d->top + g * group);
        canvas_line(d->canvas, MARGIN, d->bottom, WIDTH - MARGIN, d->bottom, 0.75, RULE);
    }
    y = d->bottom + 28;
    if (chart->foot)
        y += 24 + 13 * (canvas_paragraph(d->canvas, MARGIN, y + 24, WIDTH - 2 * MARGIN, 13,
                                         &foot_type, chart->foot, draw) - 1);
    return y + MARGIN - 8;
}

bool chart_save(const struct chart *chart, const char *path, struct dph_error *err)
{
    size_t length = strlen(path);
    bool svg = length > 4 && strcasecmp(path + length - 4, ".svg") == 0,
         png = length > 4 && strcasecmp(path + length - 4, ".png") == 0, ok = false;
    struct drawing d = {.chart = chart};
    if (!svg && !png)
        return text_fail(err, DPH_ERROR_ARGUMENT, "%s: a chart is a .svg or a .png", path);
    if (chart->npanel < 1 || chart->npanel > MAX_PANELS || chart->ngroup < 1 ||
        chart->ngroup > MAX_GROUPS || chart->nseries < 1 || chart->nseries > MAX_SERIES)
        return text_fail(err, DPH_ERROR_ARGUMENT, "a chart of %d panels, %d groups, %d series",
                         chart->npanel, chart->ngroup, chart->nseries);
    d.axis = find_axis(chart);
    /* the height depends on line breaks, which the first, empty page measures */
    if (!(d.canvas = canvas_create(CANVAS_RASTER, 1, 1, 1, err)))
        return false;
    lay_out(&d);
    double height = draw_chart(&d, false);
    canvas_destroy(d.canvas);
    d.canvas = canvas_create(svg ? CANVAS_SVG : CANVAS_RASTER, WIDTH, ceil(height), PIXELS, err);
    if (d.canvas) {
        draw_chart(&d, true);
        ok = canvas_save(d.canvas, path, err);
        canvas_destroy(d.canvas);
    }
    canvas_forget_fonts();
    return ok;
}
