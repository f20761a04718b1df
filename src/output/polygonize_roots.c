#include "output/polygonize_roots.h"

ZS_DECLARE_VARIANTS(zs_root_kernels, zs_root_kernels)
static const zs_root_kernels *const kernels[ZS_ISA_COUNT] = ZS_VARIANTS(zs_root_kernels, );

/* How far from its middle a bracket may be looked at in the first round, in units
 * of its line.  Halved in every round, it makes brackets close at most seven
 * rounds later than bisection would; until it is used up, the next place is the
 * straight line's root, a little beyond so that the bracket closes from the other
 * side too.  Fewer rounds are not enough: where f has a kink, the first few go
 * astray, and bisection takes longer than what follows them.  (I. Oliveira, R.
 * Takahashi: "An enhancement of the bisection method average performance
 * preserving minmax optimality", 2020, with its projection step.) */
static const float FIRST_REACH = 64;

/* Brackets that are narrow enough leave; those that are not move to the front. */
static void drop_closed(zs_roots *r)
{
  zs_brackets *b = &r->brackets;
  float *const items[] = {b->from[0],  b->from[1],  b->from[2], b->along[0], b->along[1],
                          b->along[2], b->low,      b->width,   b->f_low,    b->f_high,
                          b->side,     b->tolerance, b->root};
  uint16_t open[ZS_BLOCK];
  unsigned count = 0;
  for (unsigned i = 0; i < r->pending; i++) {
    r->t[r->line[i]] = b->root[i];
    open[count] = (uint16_t)i;
    count += b->width[i] > 2 * b->tolerance[i];
  }
  for (size_t k = 0; k < sizeof items / sizeof *items; k++)
    for (unsigned i = 0; i < count; i++)
      items[k][i] = items[k][open[i]];
  for (unsigned i = 0; i < count; i++)
    r->line[i] = r->line[open[i]];
  for (unsigned i = count; i % ZS_LANES; i++)
    b->width[i] = 0;
  r->pending = count;
}

/* Brackets close for any f, continuous or not: every round narrows them, and
 * once their reach is used up they are halved.  Closed ones stay in the block
 * until they are half of it: evaluating them costs less than moving the others. */
uint64_t zs_roots_solve(zs_roots *r, zs_eval *eval, const zs_program *program,
                        const zs_frame *frame, float tolerance, float least)
{
  const zs_root_kernels *loops = kernels[zs_eval_isa(eval)];
  uint64_t evaluations = 0;
  loops->begin(r, tolerance);
  r->pending = r->count;
  for (float reach = FIRST_REACH; r->pending; reach /= 2) {
    loops->look(r, reach);
    zs_program_values(eval, program, frame, r->pending, r->at[0], r->at[1], r->at[2], r->f);
    evaluations += r->pending;
    if (2 * loops->narrow(r) <= r->pending)
      drop_closed(r);
  }
  loops->finish(r, tolerance, least);
  return evaluations;
}
