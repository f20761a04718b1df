/* A function through scattered constraints in a part of space, by many small fits: the part
 * is divided into overlapping blocks across z, and their fits are added up with weights that
 * fall to nothing at the blocks' sides (Wendland, "Scattered Data Approximation", 2005,
 * chapter 29: partition of unity). */
#ifndef ZS_STACK_BLOCKS_H
#define ZS_STACK_BLOCKS_H

#include "field/operation.h"
#include "rbf/cells.h"

typedef struct zs_block {
  double lo[2], hi[2]; /* where it has weight */
  zs_rbf_terms terms;  /* the fit, in its unit box; no centres: there are too few constraints */
  double centre[3], size;
} zs_block;

typedef struct zs_blocks {
  size_t count, capacity;
  zs_block *blocks;
} zs_blocks;

typedef struct zs_block_constraint {
  double at[3], value;
} zs_block_constraint;

/* How constraints are put into blocks, and met there. */
typedef struct zs_block_rules {
  size_t most;      /* constraints of a block, about */
  double overlap;   /* of blocks, at the least */
  double smoothing; /* a length to the third: 0 meets constraints; else the fit minimizes its
                       energy and the squares of what it misses them by, so many times less */
  unsigned threads;
} zs_block_rules;

/* Fits of blocks.  False when memory is out. */
bool zs_blocks_make(zs_blocks *blocks, const zs_block_constraint *constraints, size_t count,
                    const zs_block_rules *rules);
void zs_blocks_clear(zs_blocks *blocks);

/* Places in a plane z: x = first[0] .. first[0] + size[0] - 1, and y alike; x fastest. */
typedef struct zs_block_plane {
  double z, first[2];
  size_t size[2];
  const bool *wanted;      /* by place */
  double *sums, *weights;  /* by place: what has been added up */
} zs_block_plane;

/* Add weight times value, and the weight, of all blocks at the places that are wanted. */
void zs_blocks_add(const zs_blocks *blocks, const zs_block_plane *plane);

#endif
