/* Fields about skeletons: sums over points, segments, polylines and triangles of a value
 * that falls off with the distance (soft objects, blobs, metaballs), or of the Cauchy kernel
 * integrated over the skeleton (convolution surfaces).  An operation on x, y and z; a region
 * keeps the parts whose fields reach it.
 *
 * Where fields end, a tree of boxes over the parts leaves out most of them, so that the cost
 * is that of the parts nearby.  Fields that do not end are added up everywhere. */
#ifndef ZS_SKELETON_H
#define ZS_SKELETON_H

#include "field/operation.h"

/* By u = distance / radius. */
typedef enum zs_skeleton_field {
  ZS_SKELETON_WYVILL,   /* 1 - 22/9 u^2 + 17/9 u^4 - 4/9 u^6 up to 1, then 0 */
  ZS_SKELETON_BLOBTREE, /* (1 - u^2)^3 up to 1, then 0 */
  ZS_SKELETON_BLINN,    /* 2^(-4 u^2) */
  ZS_SKELETON_METABALL, /* 1 - 3 u^2 up to 1/3, 3/2 (1 - u)^2 up to 1, then 0 */
  ZS_SKELETON_CAUCHY    /* the integral of 1 / (1 + u^2)^2 over the skeleton */
} zs_skeleton_field;

typedef enum zs_skeleton_shape {
  ZS_SKELETON_POINT = 1,
  ZS_SKELETON_SEGMENT = 2,
  ZS_SKELETON_TRIANGLE = 3
} zs_skeleton_shape; /* the number of corners */

/* A piece in single precision, in units of the radius, for the kernels. */
typedef struct zs_skeleton_form {
  float from[3], scale; /* a point x of the scene is at (x - from) * scale */
  float corner[3][3];   /* the first is 0 */
  /* Of the side from each corner to the next; for triangles across it, outward in their plane. */
  float along[3][3], length[3], outward[3][3];
  float normal[3];
  float largest;        /* coordinate of a corner, wherever the scene's origin is */
  float sides, measure; /* sum of the lengths; 1 of a point, the length, or the area */
  float unit;           /* weight, times what a unit of the measure is in the scene */
} zs_skeleton_form;

typedef struct zs_skeleton_piece {
  double corner[3][3];
  zs_skeleton_shape shape;
  zs_skeleton_form form;
} zs_skeleton_piece;

/* Pieces whose nearest one counts (their sum, for ZS_SKELETON_CAUCHY). */
typedef struct zs_skeleton_part {
  double radius, weight;
  uint32_t first, count;  /* pieces */
  double measure;         /* of all of them: 1 a point, lengths of segments, areas */
  double lo[3], hi[3];    /* the box of the pieces */
  double reach;           /* distance from the pieces from which on the field is 0 */
} zs_skeleton_part;

/* Parts near to each other, and after it the groups that it is divided into.  Those without
 * are of few parts. */
typedef struct zs_skeleton_group {
  float lo[3], hi[3];    /* the box outside of which their fields are 0 */
  float below, above;    /* sums of their weights that take away, and of the others */
  uint32_t first, count; /* parts */
  uint32_t next;         /* the group after it and all of its own */
} zs_skeleton_group;

/* Immutable. */
typedef struct zs_skeleton {
  zs_skeleton_field field;
  uint32_t part_count, group_count;
  const zs_skeleton_part *parts;
  const zs_skeleton_piece *pieces;
  const zs_skeleton_group *groups; /* the first is of all parts; none where fields are endless */
} zs_skeleton;

/* The skeleton of some parts, whose radius, weight and pieces are given, and of these corners
 * and shape.  All memory is the arena's, and the skeleton keeps `parts`, which it puts in
 * another order, and `pieces`.  NULL when memory is out.  Takes a time of n log^2 n. */
zs_skeleton *zs_skeleton_new(zs_arena *arena, zs_skeleton_field field, zs_skeleton_part *parts,
                             uint32_t count, zs_skeleton_piece *pieces);

/* Distance from a part's pieces from which on its field is no larger than `least`: for 0,
 * where it ends, infinite if it does not. */
double zs_skeleton_reach(zs_skeleton_field field, const zs_skeleton_part *part, double least);

/* The field of one part at a point, and unless `slope` is NULL its derivatives. */
double zs_skeleton_value(const zs_skeleton *skeleton, const zs_skeleton_part *part,
                         const double at[3], double slope[3]);

/* Inputs x, y and z; data: a zs_skeleton that lives as long as the field. */
extern const zs_operation zs_skeleton_operation;

ZS_DECLARE_KERNELS(zs_skeleton_kernels)

#endif
