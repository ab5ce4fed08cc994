/* Errors over all directions of light, and from the truth averaged over views. */
#include "report_truths.h"

#include <math.h>

bool report_has_views(const struct dph_judged *judged)
{
    return judged->truth && judged->truth[0].views.pixel;
}

static void put_number(FILE *out, double value, const char *classes)
{
    if (isnan(value))
        fprintf(out, "<td%s data-value=\"\">\xe2\x80\x93</td>", classes);
    else
        fprintf(out, "<td%s data-value=\"%.9g\">%.3f</td>", classes, value, value);
}

static const char FIRST[] = " class=\"first\"";

static void put_head(FILE *out, const struct dph_comparison *comparison, bool views)
{
    static const char *const name[] = {"Method", "Variant", "Fitted"};
    int column = 0;
    fputs("<thead><tr>", out);
    for (int i = 0; i < 3; i++)
        fprintf(out, "<th class=\"text\" scope=\"col\" data-column=\"%d\">%s</th>", column++,
                name[i]);
    fprintf(out, "<th%s scope=\"col\" data-column=\"%d\">all lights</th>", FIRST, column++);
    for (size_t l = 0; l <= comparison->nlight && views; l++)
        fprintf(out, "<th%s scope=\"col\" data-column=\"%d\">%s, from the average</th>",
                l ? "" : FIRST, column++, l ? comparison->light[l - 1].name : "all lights");
    fputs("</tr></thead>\n<tbody>\n", out);
}

void report_truths_html(FILE *out, const struct dph_comparison *comparison,
                        const struct dph_judged *judged)
{
    bool views = report_has_views(judged);
    if (!judged->held.nlight && !views)
        return;
    fprintf(out, "<p class=\"note\">RMSE once more: over the pixels of %d lights together that cover "
            "the sphere", judged->held.nlight);
    if (views)
        fputs(", and from the truth averaged over views, which a response is an answer to without "
              "what the eye makes of it, and is drawn so for this. "
              "The last row is the distance of that truth from the picture", out);
    fputs(".</p>\n<div class=\"wide\"><table class=\"sortable\"><caption>All lights", out);
    fputs(views ? ", and both truths</caption>\n" : "</caption>\n", out);
    put_head(out, comparison, views);
    for (size_t e = 0; e < judged->nentry; e++) {
        const struct dph_entry *entry = &judged->entry[e];
        fprintf(out, "<tr><th class=\"text\" scope=\"row\">%s</th><td class=\"text\">%s</td>"
                "<td class=\"text\">%s</td>",
                entry->method->name, entry->variant, entry->fitted ? "yes" : "no");
        put_number(out, entry->rmse_all_lights, FIRST);
        for (size_t l = 0; l <= comparison->nlight && views; l++)
            put_number(out,
                       l ? entry->shot[l - 1].scores.rmse_view_averaged
                         : entry->rmse_all_lights_view_averaged,
                       l ? "" : FIRST);
        fputs("</tr>\n", out);
    }
    fputs("</tbody>\n", out);
    if (views) {
        fputs("<tfoot><tr><th class=\"text\" scope=\"row\" colspan=\"3\">distance of the average "
              "from the picture</th>", out);
        put_number(out, judged->held.views_rmse, FIRST);
        put_number(out, judged->held.views_rmse, FIRST);
        for (size_t l = 0; l < comparison->nlight; l++)
            put_number(out, judged->truth[l].views_rmse, "");
        fputs("</tr></tfoot>\n", out);
    }
    fputs("</table></div>\n", out);
}

void report_truths_text(FILE *out, const struct dph_comparison *comparison,
                        const struct dph_judged *judged)
{
    bool views = report_has_views(judged);
    char name[80];
    if (!judged->held.nlight && !views)
        return;
    fprintf(out, "\n%-46s %7s", views ? "rmse, from the average over views" : "rmse", "all");
    if (views)
        fprintf(out, " %7s", "all av.");
    for (size_t l = 0; l < comparison->nlight && views; l++)
        fprintf(out, " %7s", comparison->light[l].name);
    fputc('\n', out);
    for (size_t e = 0; e < judged->nentry; e++) {
        const struct dph_entry *entry = &judged->entry[e];
        snprintf(name, sizeof name, "%s%s%s%s", entry->method->name, *entry->variant ? ", " : "",
                 entry->variant, entry->fitted ? ", fitted" : "");
        fprintf(out, "  %-44s %7.4f", name, entry->rmse_all_lights);
        if (views)
            fprintf(out, " %7.4f", entry->rmse_all_lights_view_averaged);
        for (size_t l = 0; l < comparison->nlight && views; l++)
            fprintf(out, " %7.4f", entry->shot[l].scores.rmse_view_averaged);
        fputc('\n', out);
    }
    if (!views)
        return;
    fprintf(out, "  %-44s %7.4f %7.4f", "distance of the average from the picture",
            judged->held.views_rmse, judged->held.views_rmse);
    for (size_t l = 0; l < comparison->nlight; l++)
        fprintf(out, " %7.4f", judged->truth[l].views_rmse);
    fputc('\n', out);
}
