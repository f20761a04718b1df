/* Certified roots of f on many straight lines at once. */
#ifndef ZS_POLYGONIZE_ROOTS_H
#define ZS_POLYGONIZE_ROOTS_H

#include "field/program.h"

/* What is known of one line.  Its bracket is a part of the line, low .. low +
 * width in units of its length, with the lower end inside and the upper end
 * outside. */
typedef enum zs_root_item {
  ZS_ROOT_FROM,                     /* 3: the inner end of the line, in the frame */
  ZS_ROOT_ALONG = ZS_ROOT_FROM + 3, /* 3: from there to the outer end */
  ZS_ROOT_LOW = ZS_ROOT_ALONG + 3,
  ZS_ROOT_WIDTH,
  ZS_ROOT_F_LOW,     /* f at the ends of the bracket */
  ZS_ROOT_F_HIGH,
  ZS_ROOT_SIDE,      /* 1 when the lower end moved last, -1 when the upper did, else 0 */
  ZS_ROOT_REACH,     /* see next_place */
  ZS_ROOT_TOLERANCE, /* half the width that is narrow enough */
  ZS_ROOT_LEAST,     /* roots stay this far from the ends of the line */
  ZS_ROOT_ITEMS
} zs_root_item;

/* A block of up to ZS_BLOCK lines.  Begin with count = pending = 0. */
typedef struct zs_roots {
  unsigned count;             /* lines of the block */
  float found[3][ZS_BLOCK];   /* by line: its root, in the frame */
  float inside[3][ZS_BLOCK];  /* and a place just inside of it */
  unsigned pending;           /* lines not solved yet, and what is known of them */
  float item[ZS_ROOT_ITEMS][ZS_BLOCK];
  uint16_t line[ZS_BLOCK];
  _Alignas(64) float t[ZS_BLOCK];
  _Alignas(64) float at[3][ZS_BLOCK];
  _Alignas(64) float f[ZS_BLOCK];
} zs_roots;

/* Add the line between two points of the frame, the first one inside and the
 * second one outside, with f there.  `tolerance`, `least`: lengths, as above. */
void zs_roots_add(zs_roots *roots, const float inner[3], const float outer[3], float f_inner,
                  float f_outer, float tolerance, float least);

/* Find all roots of the block; returns the number of evaluations.  The sign of f
 * changes within the tolerance of each, whatever f is. */
uint64_t zs_roots_solve(zs_roots *roots, zs_eval *eval, const zs_program *program,
                        const zs_frame *frame);

#endif
