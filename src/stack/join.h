/* Slices joined into a solid, sampled on layers between them. */
#ifndef ZS_STACK_JOIN_H
#define ZS_STACK_JOIN_H

#include "samples/raster.h"
#include "stack/slices.h"

typedef enum zs_join_method {
  ZS_JOIN_LINEAR,     /* straight from distance to distance */
  ZS_JOIN_VARIATIONAL /* the function of least bending through the outlines of four slices */
} zs_join_method;

/* What is sampled of a stack: pixels first[0] .. and rows first[1] .. of its distances. */
typedef struct zs_joined {
  zs_raster *raster; /* heights in pixels above the first slice */
  size_t first[2];
} zs_joined;

typedef enum zs_join_result { ZS_JOIN_DONE, ZS_JOIN_CANCELLED, ZS_JOIN_MEMORY } zs_join_result;

/* Join at least two slices, of which one is not empty.  In every slice the samples have the
 * signs of the pixels.
 *
 * Variational: between two slices f is a sum of radial functions r^3 through the points of
 * these and their neighbours, found in blocks (blocks.h), as a weighted mean of the sums of
 * the two nearest gaps, which makes it smooth across slices.  Away from the surface it goes
 * over into the distances, joined by cubics; parts that touch no slice are left out. */
zs_join_result zs_slices_join(zs_joined *joined, const zs_slices *slices, zs_join_method method,
                              const zs_control *control);

/* ---- Between the files of this room ------------------------------------------------------ */

/* A joining under way. */
typedef struct zs_joiner {
  const zs_slices *slices;
  const zs_control *control;
  unsigned threads;
  zs_raster *raster;
  size_t first[2];
  uint32_t *level;  /* the layer of each slice */
  zs_raster carrier; /* the slices' own heights, to tell how distances are joined */
} zs_joiner;

/* The sample of slice i at pixel (x, y) of the raster: a distance, or that to the next slice
 * where it is empty. */
float zs_joiner_distance(const zs_joiner *j, size_t i, size_t x, size_t y);

/* The gap of a layer. */
size_t zs_joiner_gap(const zs_joiner *j, uint32_t layer);

/* Write all layers by sums of radial functions (variational.c). */
zs_join_result zs_join_variational(const zs_joiner *j);

/* Change samples so that they have the signs of the slices' pixels (mend.c). */
bool zs_join_mend_levels(const zs_joiner *j);

/* Change the sign of all parts that touch no slice (mend.c). */
bool zs_join_drop_islands(const zs_joiner *j);

#endif
