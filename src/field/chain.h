/* Chains: a value joined with one primitive after another, all by joints of one
 * kind.  What is a primitive and a joint for every link otherwise is one operation
 * then: the value so far stays in registers, and a regional program is but a
 * shorter list of links. */
#ifndef ZS_CHAIN_H
#define ZS_CHAIN_H

#include "field/blend.h"
#include "field/primitive.h"
#include "field/program.h"

typedef enum zs_chain_profile {
  ZS_CHAIN_EXTREMUM, /* a maximum or minimum */
  ZS_CHAIN_QUADRATIC,
  ZS_CHAIN_CUBIC,
  ZS_CHAIN_CIRCULAR,
  ZS_CHAIN_CHAMFER,
  ZS_CHAIN_COUNT
} zs_chain_profile;

typedef struct zs_link {
  const zs_primitive *primitive; /* belongs to the field */
  zs_primitive_shape shape;
  bool negated; /* the complement is joined */
} zs_link;

/* Data of chain operations.  Their inputs are three coordinates, those that the
 * primitives would have, and the value so far. */
typedef struct zs_chain {
  zs_blend blend; /* of the joints; a maximum is a union */
  bool root;      /* of the frame's coordinates, not of registers */
  bool begins;    /* with its first link: there is no value so far */
  uint32_t count; /* of links, at least one */
  zs_link links[];
} zs_chain;

enum { ZS_CHAIN_SO_FAR = 3 /* the input */ };

/* Turn joints of primitives into chains where the primitives have no other use.
 * Instructions keep their places; those that are not used any more stay.  `result`
 * is the last one.  `links` becomes how many all chains have.  False when memory is
 * out. */
bool zs_chains_form(zs_instruction *instructions, uint32_t result, zs_arena *arena,
                    uint32_t *links);

/* The chain with some of its links only, given by ascending index, from `arena`; NULL
 * when memory is out. */
const zs_chain *zs_chain_shortened(const zs_chain *chain, bool begins, const uint32_t *links,
                                   uint32_t count, zs_arena *arena);

/* Whether two instructions join by the same joint, one by one or in chains. */
bool zs_joints_equal(const zs_instruction *a, const zs_instruction *b);

typedef zs_kernels zs_chain_table[ZS_CHAIN_COUNT];
ZS_DECLARE_VARIANTS(zs_chain_table, zs_chain_kernels)

#endif
