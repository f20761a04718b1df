/* Outlines of plane shapes: lines, Bezier curves and arcs, as SVG has them. */
#ifndef ZS_OUTLINE_H
#define ZS_OUTLINE_H

#include "files/rings.h"

typedef enum zs_stroke_kind {
  ZS_STROKE_MOVE,  /* begin another ring at p[0] */
  ZS_STROKE_LINE,  /* to p[0] */
  ZS_STROKE_CUBIC, /* Bezier curve by p[0] and p[1] to p[2] */
  ZS_STROKE_ARC    /* p[0] + p[1] cos t + p[2] sin t, for t from p[3][0] to p[3][1], to p[4] */
} zs_stroke_kind;

typedef struct zs_stroke {
  zs_stroke_kind kind;
  double p[5][2];
} zs_stroke;

/* What is filled together, by one rule. */
typedef struct zs_outline_shape {
  size_t first; /* stroke */
  bool even_odd;
} zs_outline_shape;

/* A zero-initialised one is empty. */
typedef struct zs_outline {
  zs_stroke *strokes;
  size_t stroke_count, stroke_capacity;
  zs_outline_shape *shapes;
  size_t shape_count, shape_capacity;
} zs_outline;

void zs_outline_clear(zs_outline *outline);

/* Begin another shape.  False when memory is out. */
bool zs_outline_begin(zs_outline *outline, bool even_odd);

/* Add a stroke to the latest shape, under an affine map {a, b, c, d, e, f} as in SVG:
 * x' = a x + c y + e, y' = b x + d y + f.  False when memory is out. */
bool zs_outline_add(zs_outline *outline, const zs_stroke *stroke, const double map[6]);

/* What is wrong in path data, and where. */
typedef struct zs_path_error {
  size_t offset; /* bytes into the text */
  char message[120];
  bool memory; /* there is nothing wrong with the text: memory is out */
} zs_path_error;

/* Add the strokes of SVG path data to the latest shape: all commands, M L H V C S Q T A Z,
 * absolute and relative (https://www.w3.org/TR/SVG11/paths.html).  False with the error. */
bool zs_outline_add_path(zs_outline *outline, const char *data, size_t length,
                         const double map[6], zs_path_error *error);

/* The box around all strokes and the points that they are made with; false when there are
 * none. */
bool zs_outline_box(const zs_outline *outline, double lo[2], double hi[2]);

/* The rings of one shape, with chords no farther than `tolerance` from curves.  Open ones
 * are closed.  False after reporting that memory is out or there are too many points. */
bool zs_outline_flatten(const zs_outline *outline, size_t shape, double tolerance,
                        zs_rings *rings, zs_diag *diag);

#endif
