/* SVG files as outlines. */
#ifndef ZS_SVG_H
#define ZS_SVG_H

#include "files/outline.h"

/* Read the shapes of an SVG file, one for every <path>, <rect>, <circle>, <ellipse>,
 * <polygon> and <polyline>, in groups and nested documents, under all transforms, however
 * they are painted.  What is not displayed or only defined (<defs>, <symbol>, <clipPath>,
 * ...) is left out, and text and pictures too, with a warning.  So are style sheets, with a warning
 * where they say what is displayed or filled by which rule.  A page whose size is in a
 * unit of length (mm, cm, in, pt, pc, Q) is read in millimetres, others in pixels.  y grows
 * upwards from the lower side of the page, or with `down` downwards from its upper one.
 *
 * `group` is the id of the element to read, or NULL for the whole document.
 *
 * False after reporting with file, line, element and attribute; the outline is then
 * empty.  No shape at all is an error. */
bool zs_svg_read(zs_outline *outline, const char *path, const char *group, bool down,
                 zs_diag *diag);

/* A group of shapes that stand for themselves. */
typedef struct zs_svg_group {
  char *name;  /* its id; "" when it has none */
  size_t place; /* in the document */
  zs_outline outline; /* may be empty */
} zs_svg_group;

typedef struct zs_svg_groups {
  zs_svg_group *groups;
  size_t count;
} zs_svg_groups;

/* Read the groups (<g>) of an SVG file apart: those in the root, or in its only group when
 * there are several in that, under all transforms, in the natural order of their ids and else
 * of the document.  Groups that are not displayed are left out, and shapes in none too, with a
 * warning.  False after reporting, also when there is no group. */
bool zs_svg_read_groups(zs_svg_groups *groups, const char *path, bool down, zs_diag *diag);
void zs_svg_groups_clear(zs_svg_groups *groups);

#endif
