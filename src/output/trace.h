/* Finding what rays hit first.
 *
 * A tile of the picture is traced as a tree of boxes in the camera's local
 * coordinates, front to back, down to leaves of 8 x 8 rays and a few samples in
 * depth.  Bounds leave out what is empty, and what lies behind rays that have
 * hit something; the rest gets shorter programs.  Leaves are bounded once more,
 * in sixteen pieces, sample every ray around those left, look closer where f
 * rises and falls between two samples, and close in on the surface, by programs
 * that need only have the sign of f.  Without pruning a
 * leaf has the same samples inside, and the same hits but for what closing in
 * leaves open; it may overlook a sheet between samples that shorter programs
 * show. */
#ifndef ZS_TRACE_H
#define ZS_TRACE_H

#include "field/program.h"
#include "output/camera.h"

enum {
  ZS_TILE = 64,  /* rays along the sides of a tile */
  ZS_COLUMN = 8, /* rays along the sides of a column, the footprint of a leaf */
  ZS_COLUMNS = ZS_TILE / ZS_COLUMN,
  ZS_COLUMN_RAYS = ZS_COLUMN * ZS_COLUMN
};

typedef enum zs_hit_kind {
  ZS_HIT_NOTHING,
  ZS_HIT_SURFACE,
  ZS_HIT_CUT /* solid that the box, or the nearest depth, cuts through */
} zs_hit_kind;

typedef struct zs_hit {
  zs_hit_kind kind;
  float depth;
  float normal[3]; /* unit, out of the solid, along the scene's axes */
} zs_hit;

/* The rays of a tile, column by column. */
typedef struct zs_tile {
  uint32_t x, y;   /* of its first ray, in rays */
  uint32_t rays_per_pixel; /* along a pixel's side: 1 or 4 */
  /* Where rays are in the box; near > far for those that are done. */
  zs_ray_span spans[ZS_COLUMNS * ZS_COLUMNS][ZS_COLUMN_RAYS];
  zs_hit hits[ZS_COLUMNS * ZS_COLUMNS][ZS_COLUMN_RAYS];
  unsigned left[ZS_COLUMNS * ZS_COLUMNS]; /* rays of each column that go on */
  float near[ZS_COLUMNS * ZS_COLUMNS], far[ZS_COLUMNS * ZS_COLUMNS]; /* of these */
} zs_tile;

/* Where ray (i, j) of a tile is kept. */
static inline void zs_tile_place(uint32_t i, uint32_t j, uint32_t *column, uint32_t *ray)
{
  *column = j / ZS_COLUMN * ZS_COLUMNS + i / ZS_COLUMN;
  *ray = j % ZS_COLUMN * ZS_COLUMN + i % ZS_COLUMN;
}

/* Of several rays to a pixel every second one is traced, as on a board of chess; within their
 * places these stand so that a pixel of 4 x 4 has eight rays in eight rows and eight columns,
 * which show an edge of any slant in as many steps. */
static inline bool zs_tile_has_ray(const zs_tile *tile, uint32_t i, uint32_t j)
{
  return tile->rays_per_pixel == 1 || ((i ^ j) & 1) == 0;
}

/* Local coordinates of ray (i, j) of a tile. */
void zs_tile_ray(const zs_tile *tile, const zs_camera *camera, uint32_t i, uint32_t j, double *u,
                 double *v);

/* Set up the rays of a tile.  `wanted`, when not NULL, has a byte for every
 * pixel of the picture; rays of pixels with 0 are left out. */
void zs_tile_begin(zs_tile *tile, const zs_camera *camera, uint32_t x, uint32_t y,
                   uint32_t rays_per_pixel, const uint8_t *wanted);

/* What one thread traces with. */
typedef struct zs_tracer {
  const zs_camera *camera;
  zs_eval *eval;
  bool brute; /* no pruning */
  bool signs; /* programs for signs are shorter than others, in the tile at hand */
  uint32_t leaves; /* in depth */
  uint64_t evaluations;
  zs_arena arena;
} zs_tracer;

/* `eval` stays the caller's, and must outlive the tracer. */
void zs_tracer_init(zs_tracer *tracer, const zs_camera *camera, zs_eval *eval, bool brute);
void zs_tracer_clear(zs_tracer *tracer);

/* Fill in the hits of a tile's rays. */
void zs_tracer_run(zs_tracer *tracer, zs_tile *tile);

#endif
