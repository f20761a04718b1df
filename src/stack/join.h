/* Slices joined into a solid, sampled on layers between them. */
#ifndef ZS_STACK_JOIN_H
#define ZS_STACK_JOIN_H

#include "samples/raster.h"
#include "stack/motion.h"
#include "stack/slices.h"

typedef enum zs_join_method {
  ZS_JOIN_AUTO,       /* variational, but extended where that thins the solid out less, and
                         between two slices alone */
  ZS_JOIN_LINEAR,     /* straight from distance to distance */
  ZS_JOIN_CUBIC,      /* from distance to distance by cubics with common slopes */
  ZS_JOIN_EXTENDED,   /* distances that move with the shapes (motion.h) */
  ZS_JOIN_VARIATIONAL /* the function of least bending through the outlines of four slices */
} zs_join_method;

/* What a place on the outline of one slice becomes on the next one: coordinates of the raster. */
typedef struct zs_join_way {
  float from[3], to[3];
} zs_join_way;

/* What is sampled of a stack: pixels first[0] .. and rows first[1] .. of its distances. */
typedef struct zs_joined {
  zs_raster *raster; /* heights in pixels above the first slice */
  size_t first[2];
  /* A sample of places that move with the shapes, gap by gap from the lowest up. */
  zs_join_way *ways;
  size_t way_count;
} zs_joined;

typedef enum zs_join_result { ZS_JOIN_DONE, ZS_JOIN_CANCELLED, ZS_JOIN_MEMORY } zs_join_result;

/* Join at least two slices, of which one is not empty.  In every slice the samples have the
 * signs of the pixels.
 *
 * Variational: between two slices f is a sum of radial functions r^3 through the points of
 * these and their neighbours, found in blocks (blocks.h), as a weighted mean of the sums of
 * the two nearest gaps, which makes it smooth across slices.  Where outlines are stairs of
 * pixels, as far as slices say so, the sums are smoothed by as much as takes these away.  The
 * distances, joined by cubics, count for up to a fifth half-way across gaps that are not wide,
 * and for all away from the surface; parts that touch no slice are left out.
 *
 * Extended: the distances of four slices, joined by cubics along ways on which shapes move
 * from one to the next. */
zs_join_result zs_slices_join(zs_joined *joined, const zs_slices *slices, zs_join_method method,
                              const zs_control *control);
void zs_joined_clear(zs_joined *joined);

/* ---- Between the files of this room ------------------------------------------------------ */

/* From 0 to 1, at rest at both ends; beyond them as there. */
static inline double zs_smooth_step(double t)
{
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  return t * t * (3 - 2 * t);
}

/* A joining under way. */
typedef struct zs_joiner {
  const zs_slices *slices;
  const zs_control *control;
  unsigned threads;
  zs_raster *raster;
  size_t first[2];
  uint32_t *level;  /* the layer of each slice */
  float **fields;   /* of each slice, as large as a layer: distances, or where it is empty that
                       to the next slice */
  zs_raster carrier; /* the slices' own heights, to tell how distances are joined */
  zs_motion *motions; /* of each gap; without fields where there is none */
} zs_joiner;

/* The gap of a layer. */
size_t zs_joiner_gap(const zs_joiner *j, uint32_t layer);

/* Add to all samples, which are 0, what sums of radial functions give (variational.c). */
zs_join_result zs_join_variational(const zs_joiner *j);

/* Find the motions of all gaps, with slices aligned first or only where they have to be;
 * false when memory is out (carry.c). */
bool zs_join_find_motions(zs_joiner *j, bool align);

/* Write all samples by distances that move, or mix these in where it takes them (carry.c). */
void zs_join_carry(const zs_joiner *j, bool all);

/* Sample the ways along which the places on outlines go that move, all or where it takes them;
 * false when memory is out (carry.c). */
bool zs_join_find_ways(const zs_joiner *j, bool all, zs_joined *joined);

/* Change samples so that they have the signs of the slices' pixels (mend.c). */
void zs_join_mend_levels(const zs_joiner *j);

/* Change the sign of all parts that touch no slice (mend.c). */
bool zs_join_drop_islands(const zs_joiner *j);

#endif
