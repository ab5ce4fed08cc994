/* canvas.h - a page that texts, lines, rectangles and pictures are drawn on, as pixels or as SVG.
 * The only place that knows the drawing library.
 *
 * Coordinates are in points from the upper left corner, y down. A point is `scale` pixels of a
 * raster page and one unit of an SVG. Colours are 0xRRGGBB as a screen has them (sRGB). What goes
 * wrong while drawing (memory) is remembered and told by canvas_save. Equal calls give equal bytes
 * on one machine; another machine may have another version of the font. Where there is no font at
 * all the drawing library's own strokes serve, and where a glyph is missing, a box. */
#ifndef CANVAS_H
#define CANVAS_H

#include <diaphan/image.h>

struct canvas;

enum canvas_kind { CANVAS_RASTER, CANVAS_SVG };

enum align { ALIGN_LEFT, ALIGN_CENTRE, ALIGN_RIGHT };

/* How a text looks. */
struct type {
    double size; /* of the em, points */
    unsigned colour;
    bool bold;
    enum align align; /* of the point that canvas_text is given */
};

/* A white page. `scale` counts for raster pages only. NULL: DPH_ERROR_ARGUMENT (a raster side
 * beyond 32000 pixels), DPH_ERROR_MEMORY. */
struct canvas *canvas_create(enum canvas_kind kind, double width, double height, double scale,
                             struct dph_error *err);
/* Accepts NULL. */
void canvas_destroy(struct canvas *canvas);
/* Frees what is kept for the next text: fonts, and what is known about them. No page may be alive. */
void canvas_forget_fonts(void);

void canvas_rectangle(struct canvas *canvas, double x, double y, double width, double height,
                      unsigned colour);
/* The outline, its outer edge being the rectangle. */
void canvas_frame(struct canvas *canvas, double x, double y, double width, double height,
                  double line, unsigned colour);
void canvas_line(struct canvas *canvas, double x0, double y0, double x1, double y1, double line,
                 unsigned colour);

/* (x, y) is on the base line. The text is UTF-8; what is not becomes '?'. */
void canvas_text(struct canvas *canvas, double x, double y, const struct type *type,
                 const char *text);
double canvas_text_width(struct canvas *canvas, const struct type *type, const char *text);
/* The same, with the middle of the text replaced by an ellipsis where it is wider than `width`. */
void canvas_text_within(struct canvas *canvas, double x, double y, double width,
                        const struct type *type, const char *text);
/* Breaks the text between words into lines of at most `width`, `leading` apart, the first on y;
 * returns how many lines. `draw` false: only counts. */
int canvas_paragraph(struct canvas *canvas, double x, double y, double width, double leading,
                     const struct type *type, const char *text, bool draw);

/* A linear picture, shown through the same clip and sRGB curve as a written PNG. It should have
 * the size that it is shown at, in the page's pixels: then each is set as it is. */
void canvas_picture(struct canvas *canvas, double x, double y, double width, double height,
                    const struct dph_image *image, double exposure);

/* Writes a raster page as .png, through the project's own writer, or an SVG page as .svg, whole or
 * not at all. False: DPH_ERROR_OUTPUT, DPH_ERROR_MEMORY, and what went wrong before. */
bool canvas_save(struct canvas *canvas, const char *path, struct dph_error *err);

#endif
