/* Creases while they are looked for: shared by the files about them only. */
#ifndef ZS_POLYGONIZE_CREASES_H
#define ZS_POLYGONIZE_CREASES_H

#include "output/polygonize.h"
#include "output/polygonize_roots.h"

enum { ZS_LONGEST_LOOP = 7, ZS_LOOPS = 64 /* of a block */ };

/* A block of loops whose normals may disagree. */
typedef struct zs_loops {
  unsigned count;
  uint16_t cell[ZS_LOOPS], edges[ZS_LOOPS]; /* see zs_crease */
  _Alignas(64) float length[ZS_LOOPS];      /* the number of vertices */
  float point[ZS_LONGEST_LOOP][3][ZS_LOOPS]; /* in the scene */
  float normal[ZS_LONGEST_LOOP][3][ZS_LOOPS];
  /* Where the tangent planes meet, less the first vertex, and the direction that
   * leads away from all of them alike: out of the solid, however many vertices lie
   * on either side of the edge. */
  float place[3][ZS_LOOPS], direction[3][ZS_LOOPS];
} zs_loops;

/* Where the creases of a block may settle: within this distance of the first
 * corner of their cell, and in the box first .. last, in the brick's frame. */
typedef struct zs_room {
  float side[3]; /* of a cell */
  float below[3], above[3];
  float first[3], last[3];
} zs_room;

/* A block of creases that settle, in the brick's frame. */
typedef struct zs_settling {
  unsigned count;
  uint16_t number[ZS_BLOCK];              /* of each among those found */
  _Alignas(64) float corner[3][ZS_BLOCK]; /* of the cell, in cells */
  float place[3][ZS_BLOCK], normal[3][ZS_BLOCK];
  float lo[3][ZS_BLOCK], hi[3][ZS_BLOCK];     /* the room of each */
  float from[3][ZS_BLOCK], to[3][ZS_BLOCK];   /* a line in it */
  float f_from[ZS_BLOCK], f_to[ZS_BLOCK];     /* f at its ends */
  float at[3][ZS_BLOCK];
  uint16_t line[ZS_BLOCK]; /* of each root: which of these it belongs to */
  zs_roots roots;
} zs_settling;

/* Loops over these for one instruction set. */
typedef struct zs_crease_kernels {
  /* Find where planes meet.  Says which loops are sharp and have such a place, one
   * bit each. */
  uint64_t (*meet)(zs_loops *loops);
  /* From places to rooms, and to lines that begin as close to the place as they can. */
  void (*rooms)(zs_settling *settling, const zs_room *room);
  /* End the lines along the normal, outward when they begin inside, where the room
   * ends or after the length `reach`. */
  void (*lines)(zs_settling *settling, float reach);
} zs_crease_kernels;

const zs_crease_kernels *zs_crease_kernels_of(zs_isa_kind isa);

/* A crease that was found in a brick. */
typedef struct zs_found {
  zs_crease crease;
  bool settled;   /* on the surface */
  uint8_t holder; /* see polygonize_creases_settle.c */
} zs_found;

/* Move creases onto the surface: those for which `settled` is true then. */
void zs_creases_settle(const zs_polygonize_job *job, zs_polygonize_worker *worker,
                       const zs_brick *brick, zs_found *found, uint32_t count,
                       zs_settling *scratch);

#endif
