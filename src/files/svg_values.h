/* Between the files that read SVG: messages, and values of attributes. */
#ifndef ZS_SVG_VALUES_H
#define ZS_SVG_VALUES_H

#include "base/xml.h"
#include "files/outline.h"

/* A document that is being read. */
typedef struct zs_svg_reader {
  zs_outline *outline; /* to which shapes are added */
  const char *group;   /* the id of what is wanted; NULL: everything */
  zs_diag *diag;
  bool failed, found, left_out, sheet;
} zs_svg_reader;

/* What an element takes from those around it. */
typedef struct zs_svg_context {
  double map[6];
  double size[2]; /* of the viewport, for percentages */
  bool even_odd;
  bool wanted;    /* inside the group that is read */
} zs_svg_context;

/* Report at an attribute, or at the element (NULL), and fail; both return false. */
bool zs_svg_fail(zs_svg_reader *r, const zs_element *e, const char *attribute,
                 const char *problem);
bool zs_svg_fail_memory(zs_svg_reader *r);

/* An attribute as it is written, or NULL. */
const char *zs_svg_value(const zs_element *e, const char *name);

/* What follows blanks and commas. */
const char *zs_svg_skip(const char *text);

/* Numbers separated by blanks and commas; how many, or -1 for more than `most` and what is
 * none. */
int zs_svg_numbers(const char *text, double *out, int most);

/* A length in pixels, `otherwise` when it is not there; per cent are of `whole`. */
bool zs_svg_length(zs_svg_reader *r, const zs_element *e, const char *name, double whole,
                   double otherwise, double *out);

/* Whether a property, as an attribute or in a style, has a value. */
bool zs_svg_is_property(const zs_element *e, const char *name, const char *expected);

/* map = map * inner: `inner` is applied first. */
void zs_svg_compose(double map[6], const double inner[6]);

/* Compose with the transforms of an element; false after reporting. */
bool zs_svg_apply_transform(zs_svg_reader *r, const zs_element *e, double map[6]);

/* Compose with the map from the viewBox of an element to a viewport of that size at the
 * origin; *box becomes what the size of the viewport is inside. */
bool zs_svg_apply_view_box(zs_svg_reader *r, const zs_element *e, const double size[2],
                           double map[6], double box[2]);

#endif
