#include "rbf/cells.h"

#include "field/program.h"
#include "rbf/poll.h"
#include "rbf/target.h"

#include <stdlib.h>
#include <string.h>

enum {
  ORDER = ZS_CHEBYSHEV_ORDER,
  NEAR = 300, /* centres that a leaf may keep */
  NEAR_GAUSSIAN = 2000, /* that overlap: cells in which they are polynomials are small */
  FEW = 600,  /* which are not worth cells */
  DEPTH = 13
};
/* Limits, against sums that no such tolerance can be had for, some and so many a
 * centre: cells, swarms that are near to them, and pairs of nodes and centres. */
static const double MOST_CELLS[2] = {4096, 8}, MOST_NEAR[2] = {1e6, 64};
static const double MOST_PAIRS[2] = {2e9, 4e6}, MOST_GAUSSIAN_PAIRS[2] = {2e9, 4e5};

/* ---- Levels --------------------------------------------------------------------------- */

/* Targets that will be divided, and their places in the list of cells. */
typedef struct level {
  zs_target **targets;
  uint32_t *places;
  size_t count;
  double pairs; /* on all levels so far */
} level;

static void free_level(level *l)
{
  for (size_t i = 0; l->targets && i < l->count; i++)
    zs_target_free(l->targets[i]);
  free(l->targets);
  free(l->places);
}

/* Whether points that are asked for can lie in the child of a target: those of the plane
 * z = 0 are in the cells above it. */
static bool is_used(const zs_target_maker *m, const zs_target *parent, unsigned child)
{
  const double z = parent->middle[2];
  return !m->terms->flat || (child & 4 ? z == 0 : z > 0);
}

static bool is_gaussian(const zs_target_maker *m)
{
  return m->terms->radial.kernel == ZS_RBF_GAUSSIAN;
}

/* Make the child of a target at one of the next level's places. */
static bool grow(const zs_target_maker *m, const zs_target *parent, unsigned child, bool last,
                 zs_rbf_cell *cell, zs_target **result, double *pairs)
{
  if (!is_used(m, parent, child))
    return true;
  zs_target *t = zs_target_part(m, parent, child);
  bool done = t != NULL;
  if (t)
    *pairs = t->pairs;
  if (done && (last || t->near_centres <= (is_gaussian(m) ? NEAR_GAUSSIAN : NEAR))) {
    done = zs_target_finish(m, t, cell);
    zs_target_free(t);
    t = NULL;
  }
  *result = t;
  return done;
}

/* Divide all targets of a level, eight more cells each; what is left is the next
 * level. */
static bool divide(const zs_target_maker *m, zs_rbf_cells *cells, level *l, bool last,
                   zs_rbf_poll *poll)
{
  const size_t count = 8 * l->count, first = cells->count;
  level next = {calloc(count, sizeof *next.targets), malloc(count * sizeof *next.places), 0,
                l->pairs};
  double *pairs = calloc(count, sizeof *pairs);
  zs_rbf_cell *all = realloc(cells->cells, (first + count) * sizeof *all);
  bool done = next.targets && next.places && pairs && all;
  if (all)
    cells->cells = all;
  if (done) {
    memset(all + first, 0, count * sizeof *all);
    cells->count += count;
    next.count = count;
    for (size_t i = 0; i < l->count; i++)
      all[l->places[i]].children = (uint32_t)(first + 8 * i);
#pragma omp parallel for schedule(dynamic, 1) num_threads(zs_control_threads(poll->control)) \
  reduction(&& : done)
    for (size_t i = 0; i < count; i++)
      done = done && zs_rbf_poll_rounds(poll, 1) &&
             grow(m, l->targets[i / 8], (unsigned)(i % 8), last, &all[first + i],
                  &next.targets[i], &pairs[i]);
    size_t left = 0;
    for (size_t i = 0; i < count; i++) {
      next.pairs += pairs[i];
      if (next.targets[i]) {
        next.places[left] = (uint32_t)(first + i);
        next.targets[left++] = next.targets[i];
      }
    }
    next.count = left;
  }
  free(pairs);
  free_level(l);
  *l = next;
  return done;
}

static bool is_last(const zs_target_maker *m, const zs_rbf_cells *cells, const level *l,
                    unsigned depth)
{
  const double count = (double)m->terms->count;
  double near = 0;
  for (size_t i = 0; i < l->count; i++)
    near += (double)l->targets[i]->near_count;
  return depth + 1 == DEPTH ||
         (double)(cells->count + 8 * l->count) > MOST_CELLS[0] + MOST_CELLS[1] * count ||
         near > MOST_NEAR[0] + MOST_NEAR[1] * count ||
         l->pairs > MOST_PAIRS[0] + MOST_PAIRS[1] * count;
}

/* Wide Gaussians overlap so much that none is far from any cell, and on the next level each may
 * meet every node: whether that costs more than it is worth. */
static bool is_enough(const zs_target_maker *m, const level *l)
{
  double pairs = l->pairs;
  if (!is_gaussian(m))
    return false;
  for (size_t i = 0; i < l->count; i++)
    pairs += 8.0 * ZS_TARGET_TERMS * (double)l->targets[i]->near_centres;
  return pairs > MOST_GAUSSIAN_PAIRS[0] + MOST_GAUSSIAN_PAIRS[1] * (double)m->terms->count;
}

/* Make leaves of all targets of a level, which is then empty. */
static bool finish(const zs_target_maker *m, zs_rbf_cells *cells, level *l)
{
  bool done = true;
  for (size_t i = 0; i < l->count; i++) {
    done = done && zs_target_finish(m, l->targets[i], &cells->cells[l->places[i]]);
    zs_target_free(l->targets[i]);
  }
  l->count = 0;
  return done;
}

static bool make_cells(const zs_target_maker *m, zs_rbf_cells *cells, zs_rbf_poll *poll)
{
  level l = {calloc(1, sizeof *l.targets), calloc(1, sizeof *l.places), 1, 0};
  cells->cells = calloc(1, sizeof *cells->cells);
  cells->half = zs_rbf_terms_half(m->terms);
  cells->count = 1;
  if (l.targets)
    l.targets[0] = zs_target_cube(m);
  bool done = l.targets && l.places && cells->cells && l.targets[0];
  if (done && m->terms->count <= FEW)
    done = finish(m, cells, &l);
  for (unsigned depth = 0; done && l.count; depth++)
    if (is_enough(m, &l))
      done = finish(m, cells, &l);
    else
      done = zs_rbf_poll_begin(poll, 8 * l.count, (double)depth / DEPTH,
                               (double)(depth + 1) / DEPTH) &&
             divide(m, cells, &l, is_last(m, cells, &l, depth), poll);
  free_level(&l);
  return done;
}

/* Measure what the cells are off by, at and near some of the centres. */
static double measure(const zs_rbf_cells *cells, const zs_rbf_terms *terms)
{
  static const double nearest = 0.002, farthest = 0.1;
  const size_t stride = terms->count / (ZS_BLOCK - 1) + 1;
  double point[3][ZS_BLOCK], exact[ZS_BLOCK], sums[1][ZS_BLOCK], most = 0, away = 0;
  unsigned n = 0;
  for (size_t j = 0; j < terms->count; j += stride, n++) {
    const zs_rbf_centre *c = &terms->centres[j];
    point[0][n] = c->x + away;
    point[1][n] = c->y - away;
    point[2][n] = terms->flat ? 0 : c->z + away;
    away = away > farthest ? 0 : fmax(nearest, 1.6 * away);
  }
  zs_rbf_terms_values(terms, n, point, exact);
  zs_cells_select(terms->radial.kernel)
    ->evaluate(cells, terms, n, (const double(*)[ZS_BLOCK])point, sums, false);
  for (unsigned i = 0; i < n; i++)
    most = fmax(most, fabs(sums[0][i] - exact[i]));
  return most;
}

zs_rbf_cells *zs_rbf_cells_new(const zs_rbf_terms *terms, double tolerance,
                               const zs_control *control, zs_diag *diag)
{
  zs_rbf_poll poll = {.control = control, .stage = "cells"};
  zs_swarms swarms;
  zs_rbf_cells *cells = calloc(1, sizeof *cells);
  zs_target_maker *maker = malloc(sizeof *maker);
  bool done = zs_swarms_make(&swarms, terms) && cells && maker;
  if (done) {
    zs_target_maker_init(maker, terms, &swarms, tolerance);
    done = make_cells(maker, cells, &poll);
  }
  zs_swarms_clear(&swarms);
  free(maker);
  if (!done) {
    zs_rbf_poll_fail(&poll, diag);
    zs_rbf_cells_free(cells);
    return NULL;
  }
  cells->bytes = sizeof *cells + cells->count * sizeof *cells->cells;
  for (size_t i = 0; i < cells->count; i++) {
    const zs_rbf_cell *c = &cells->cells[i];
    cells->bytes += c->near_count * sizeof *c->near +
                    c->order * zs_cells_stride(c->order) * sizeof *c->polynomial;
  }
  cells->error = 4 * measure(cells, terms);
  return cells;
}

void zs_rbf_cells_free(zs_rbf_cells *cells)
{
  if (!cells)
    return;
  for (size_t i = 0; cells->cells && i < cells->count; i++) {
    free((void *)cells->cells[i].polynomial);
    free((void *)cells->cells[i].near);
  }
  free(cells->cells);
  free(cells);
}

/* ---- Asking ----------------------------------------------------------------------------- */

const zs_rbf_cell *zs_rbf_cells_find(const zs_rbf_cells *cells, const double point[3],
                                     double middle[3], double *half)
{
  const zs_rbf_cell *cell = cells->cells;
  middle[0] = middle[1] = middle[2] = 0;
  *half = cells->half;
  while (cell->children) {
    unsigned child = 0;
    *half /= 2;
    for (unsigned k = 0; k < 3; k++) {
      const bool up = point[k] >= middle[k];
      child |= (unsigned)up << k;
      middle[k] += up ? *half : -*half;
    }
    cell = &cells->cells[cell->children + child];
  }
  return cell;
}

static double centre_value(const zs_rbf_terms *terms, size_t j, const double point[3])
{
  const zs_rbf_centre *c = &terms->centres[j];
  const double x = point[0] - c->x, y = point[1] - c->y, z = point[2] - c->z;
  return c->weight * zs_rbf_phi(terms->radial, x * x + y * y + z * z + c->lift);
}

static double polynomial_value(const double c[10], double x, double y, double z)
{
  return c[0] + x * (c[1] + c[4] * x + c[5] * y + c[6] * z) + y * (c[2] + c[7] * y + c[8] * z) +
         z * (c[3] + c[9] * z);
}

double zs_rbf_terms_value(const zs_rbf_terms *terms, const double point[3])
{
  double f = polynomial_value(terms->polynomial, point[0], point[1], point[2]);
  for (size_t j = 0; j < terms->count; j++)
    f += centre_value(terms, j, point);
  return f;
}

void zs_rbf_terms_values(const zs_rbf_terms *terms, unsigned n, double (*point)[ZS_BLOCK],
                         double f[ZS_BLOCK])
{
  const double *const rows[3] = {point[0], point[1], point[2]};
  for (unsigned i = 0; i < ZS_BLOCK; i++) {
    for (int k = 0; i >= n && k < 3; k++)
      point[k][i] = 0;
    f[i] = polynomial_value(terms->polynomial, point[0][i], point[1][i], point[2][i]);
  }
  zs_cells_select(terms->radial.kernel)
    ->add(terms->radial.rate, terms->centres, terms->count, rows, (n + 15) / 16 * 16, f);
}

double zs_rbf_cells_value(const zs_rbf_cells *cells, const zs_rbf_terms *terms,
                          const double point[3])
{
  double middle[3], half, t[3][ORDER];
  const zs_rbf_cell *cell = zs_rbf_cells_find(cells, point, middle, &half);
  const unsigned order = cell->order, stride = zs_cells_stride(order);
  for (int k = 0; k < 3; k++) {
    const double at = (point[k] - middle[k]) / half;
    t[k][0] = 1;
    t[k][1] = at;
    for (unsigned n = 2; n < order; n++)
      t[k][n] = 2 * at * t[k][n - 1] - t[k][n - 2];
  }
  double f = 0;
  for (unsigned k = 0; k < order; k++)
    for (unsigned j = 0; j < order; j++)
      for (unsigned i = 0; i < order; i++)
        f += cell->polynomial[k * stride + j * order + i] * t[0][i] * t[1][j] * t[2][k];
  for (uint32_t r = 0; r < cell->near_count; r++)
    for (uint32_t j = 0; j < cell->near[r].count; j++)
      f += centre_value(terms, cell->near[r].first + j, point);
  return f;
}

const zs_cells_kernels *zs_cells_select(zs_rbf_kernel kernel)
{
  static const zs_cells_kernel_table *const table[ZS_ISA_COUNT] =
    ZS_VARIANTS(zs_cells_kernels, );
  return &(*table[zs_isa_select()])[kernel];
}
