#include "stack/blocks.h"

#include "base/array.h"
#include "rbf/fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  LEAST = 12,  /* a fit of fewer says nothing */
  MOST_HALVINGS = 40
};

/* Blocks overlap by at least this part of their own side. */
static const double OVERLAP = 0.2;

/* Constraints on their way to blocks. */
typedef struct maker {
  zs_blocks *blocks;
  const zs_block_constraint *constraints;
  size_t count;
  const zs_block_rules *rules;
} maker;

/* ---- Division ----------------------------------------------------------------------- */

/* How many constraints are in a box; their numbers go to `found` unless that is NULL. */
static size_t count_in(const maker *m, const double lo[2], const double hi[2], uint32_t *found)
{
  size_t count = 0;
  for (size_t i = 0; i < m->count; i++) {
    const double *p = m->constraints[i].at;
    if (p[0] < lo[0] || p[0] > hi[0] || p[1] < lo[1] || p[1] > hi[1])
      continue;
    if (found)
      found[count] = (uint32_t)i;
    count++;
  }
  return count;
}

static bool add_block(maker *m, const double lo[2], const double hi[2])
{
  zs_blocks *b = m->blocks;
  zs_block *blocks = zs_array_grown(b->blocks, b->count + 1, &b->capacity, sizeof *blocks);
  if (!blocks)
    return false;
  b->blocks = blocks;
  zs_block *block = &blocks[b->count++];
  *block = (zs_block){.size = 1};
  memcpy(block->lo, lo, sizeof block->lo);
  memcpy(block->hi, hi, sizeof block->hi);
  return true;
}

/* Divide a rectangle until it, widened by the overlap, holds few enough constraints. */
static bool divide(maker *m, const double lo[2], const double hi[2], int halvings)
{
  double from[2], to[2];
  for (int k = 0; k < 2; k++) {
    const double overlap = fmax(m->rules->overlap, OVERLAP * (hi[k] - lo[k]));
    from[k] = lo[k] - overlap;
    to[k] = hi[k] + overlap;
  }
  const int axis = hi[1] - lo[1] > hi[0] - lo[0];
  const size_t count = count_in(m, from, to, NULL);
  const bool small = hi[axis] - lo[axis] < m->rules->overlap;
  if (count <= m->rules->most || small || halvings == MOST_HALVINGS)
    return add_block(m, from, to);
  double left[2] = {hi[0], hi[1]}, right[2] = {lo[0], lo[1]};
  left[axis] = right[axis] = (lo[axis] + hi[axis]) / 2;
  return divide(m, lo, left, halvings + 1) && divide(m, right, hi, halvings + 1);
}

/* ---- Fits ------------------------------------------------------------------------------ */

static bool keep_fit(zs_block *block, const zs_rbf *rbf)
{
  zs_rbf_centre *centres = malloc(rbf->count * sizeof *centres);
  if (!centres)
    return false;
  for (size_t i = 0; i < rbf->count; i++) {
    const double *c = rbf->centres + 3 * i;
    centres[i] = (zs_rbf_centre){c[0], c[1], c[2], 0, rbf->weights[i]};
  }
  block->terms =
    (zs_rbf_terms){.radial = rbf->radial, .count = rbf->count, .centres = centres};
  memcpy(block->terms.polynomial, rbf->polynomial, 4 * sizeof *rbf->polynomial);
  memcpy(block->centre, rbf->centre, sizeof block->centre);
  block->size = rbf->size;
  return true;
}

/* The fit of a block; none where its constraints allow none.  False when memory is out. */
static bool fit(const maker *m, zs_block *block)
{
  uint32_t *found = malloc(m->count * sizeof *found);
  const size_t count = found ? count_in(m, block->lo, block->hi, found) : 0;
  double *positions = malloc(3 * count * sizeof *positions + 1);
  double *values = malloc(count * sizeof *values + 1);
  bool memory = found && positions && values;
  if (memory && count >= LEAST) {
    for (size_t i = 0; i < count; i++) {
      memcpy(positions + 3 * i, m->constraints[found[i]].at, 3 * sizeof *positions);
      values[i] = m->constraints[found[i]].value;
    }
    const zs_rbf_problem problem = {.dimension = 3,
                                    .kernel = ZS_RBF_R3,
                                    .smoothing = m->rules->smoothing,
                                    .count = count,
                                    .positions = positions,
                                    .values = values};
    const zs_control here = {.threads = 1}; /* blocks are what threads share */
    zs_diag quiet = {0};
    zs_rbf *rbf = zs_rbf_fit(&problem, &here, NULL, &quiet);
    memory = rbf ? keep_fit(block, rbf) : quiet.status != ZS_ERROR_MEMORY;
    zs_rbf_free(rbf);
  }
  free(found);
  free(positions);
  free(values);
  return memory;
}

bool zs_blocks_make(zs_blocks *blocks, const zs_block_constraint *constraints, size_t count,
                    const zs_block_rules *rules)
{
  *blocks = (zs_blocks){0};
  maker m = {blocks, constraints, count, rules};
  double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
  for (size_t i = 0; i < count; i++)
    for (int k = 0; k < 2; k++) {
      lo[k] = fmin(lo[k], constraints[i].at[k]);
      hi[k] = fmax(hi[k], constraints[i].at[k]);
    }
  bool memory = count == 0 || divide(&m, lo, hi, 0);
  if (memory) {
#pragma omp parallel for schedule(dynamic, 1) num_threads(rules->threads) reduction(&& : memory)
    for (size_t i = 0; i < blocks->count; i++)
      memory = memory && fit(&m, &blocks->blocks[i]);
  }
  if (!memory)
    zs_blocks_clear(blocks);
  return memory;
}

void zs_blocks_clear(zs_blocks *blocks)
{
  for (size_t i = 0; i < blocks->count; i++)
    free(blocks->blocks[i].terms.centres);
  free(blocks->blocks);
  *blocks = (zs_blocks){0};
}

/* ---- Values ------------------------------------------------------------------------------ */

/* (1 - t^2)^2 for |t| <= 1: smooth, and 0 with its slope at both ends. */
static double bump(double x, double lo, double hi)
{
  const double t = (2 * x - lo - hi) / (hi - lo), u = 1 - t * t;
  return u > 0 ? u * u : 0;
}

/* Places that wait for their sums. */
typedef struct batch {
  unsigned count;
  size_t place[ZS_BLOCK];
  double point[3][ZS_BLOCK], weight[ZS_BLOCK];
} batch;

static void flush(const zs_block *block, batch *b, const zs_block_plane *plane)
{
  double f[ZS_BLOCK];
  if (b->count == 0)
    return;
  zs_rbf_terms_values(&block->terms, b->count, b->point, f);
  for (unsigned i = 0; i < b->count; i++) {
    plane->sums[b->place[i]] += b->weight[i] * f[i];
    plane->weights[b->place[i]] += b->weight[i];
  }
  b->count = 0;
}

static void add_row(const zs_block *block, const zs_block_plane *plane, size_t j, double across,
                    batch *b)
{
  const double before = block->lo[0] - plane->first[0];
  for (size_t i = before > 0 ? (size_t)before : 0; i < plane->size[0]; i++) {
    const size_t place = j * plane->size[0] + i;
    const double at[3] = {plane->first[0] + (double)i, plane->first[1] + (double)j, plane->z};
    if (at[0] >= block->hi[0])
      break;
    if (!plane->wanted[place] || at[0] <= block->lo[0])
      continue;
    for (int k = 0; k < 3; k++)
      b->point[k][b->count] = (at[k] - block->centre[k]) / block->size;
    b->weight[b->count] = across * bump(at[0], block->lo[0], block->hi[0]);
    b->place[b->count++] = place;
    if (b->count == ZS_BLOCK)
      flush(block, b, plane);
  }
}

void zs_blocks_add(const zs_blocks *blocks, const zs_block_plane *plane)
{
  batch b;
  b.count = 0;
  for (size_t i = 0; i < blocks->count; i++) {
    const zs_block *block = &blocks->blocks[i];
    for (size_t j = 0; block->terms.centres && j < plane->size[1]; j++) {
      const double across = bump(plane->first[1] + (double)j, block->lo[1], block->hi[1]);
      if (across > 0)
        add_row(block, plane, j, across, &b);
    }
    flush(block, &b, plane);
  }
}
