/* Certified roots of f on many straight lines at once. */
#ifndef ZS_POLYGONIZE_ROOTS_H
#define ZS_POLYGONIZE_ROOTS_H

#include "field/program.h"

/* What is known of lines that are being solved.  A bracket is a part of a line,
 * low .. low + width in units of its length, with the lower end inside and the
 * upper end outside. */
typedef struct zs_brackets {
  _Alignas(64) float from[3][ZS_BLOCK];
  float along[3][ZS_BLOCK];
  float low[ZS_BLOCK], width[ZS_BLOCK];
  float f_low[ZS_BLOCK], f_high[ZS_BLOCK]; /* f at its ends */
  float side[ZS_BLOCK]; /* 1 when the lower end moved last, -1 when the upper did, else 0 */
  float tolerance[ZS_BLOCK]; /* half the width that is narrow enough */
  float next[ZS_BLOCK];      /* where to look next */
  float root[ZS_BLOCK];      /* the best guess */
} zs_brackets;

/* A block of up to ZS_BLOCK lines.  Begin with count = 0. */
typedef struct zs_roots {
  unsigned count;
  _Alignas(64) float from[3][ZS_BLOCK]; /* the inner end of a line, in the frame */
  float along[3][ZS_BLOCK];             /* from there to the outer end */
  float f_inner[ZS_BLOCK], f_outer[ZS_BLOCK]; /* f there; NaN when not known */
  float t[ZS_BLOCK];          /* its root, in units of its length */
  float found[3][ZS_BLOCK];   /* its root */
  float inside[3][ZS_BLOCK];  /* and a place just inside of it */
  /* Lines not solved yet; of which line each bracket is. */
  unsigned pending;
  uint16_t line[ZS_BLOCK];
  zs_brackets brackets;
  _Alignas(64) float at[3][ZS_BLOCK];
  float f[ZS_BLOCK];
} zs_roots;

/* Add the line between two points of the frame, the first one inside and the
 * second one outside, with f there (NaN when not known). */
static inline void zs_roots_add(zs_roots *roots, const float inner[3], const float outer[3],
                                float f_inner, float f_outer)
{
  unsigned i = roots->count++;
  for (int k = 0; k < 3; k++) {
    roots->from[k][i] = inner[k];
    roots->along[k][i] = outer[k] - inner[k];
  }
  roots->f_inner[i] = f_inner;
  roots->f_outer[i] = f_outer;
}

/* Find all roots of the block; returns the number of evaluations.  The sign of f
 * changes within `tolerance` of each, whatever f is; roots stay the length
 * `least` away from the ends of their line. */
uint64_t zs_roots_solve(zs_roots *roots, zs_eval *eval, const zs_program *program,
                        const zs_frame *frame, float tolerance, float least);

/* The loops of the above, for one instruction set. */
typedef struct zs_root_kernels {
  /* From all lines to brackets. */
  void (*begin)(zs_roots *roots, float tolerance);
  /* Where to evaluate f; `reach`: see polygonize_roots.c. */
  void (*look)(zs_roots *roots, float reach);
  /* Narrow the brackets by f there; returns how many are not narrow enough. */
  unsigned (*narrow)(zs_roots *roots);
  /* From roots on lines to places. */
  void (*finish)(zs_roots *roots, float tolerance, float least);
} zs_root_kernels;

#endif
