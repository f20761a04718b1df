#include "rbf/swarms.h"

#include "base/array.h"
#include "rbf/nodes.h"

#include <stdlib.h>
#include <string.h>

enum {
  BITS = 20,  /* of a coordinate in a key */
  LEAF = 12,  /* centres that are not divided further */
  DEPTH = 12
};
const unsigned zs_swarm_orders[ZS_SWARM_GRIDS] = {6, 8, 10};

/* The cell of the cube's octree that holds the unit box. */
static const double HALF = ZS_CELLS_HALF / 8;

/* A centre by the octree's order. */
typedef struct keyed {
  uint64_t key;
  zs_rbf_centre centre;
} keyed;

static uint64_t spread(double coordinate)
{
  const double scaled = (coordinate + HALF) / (2 * HALF) * (1 << BITS);
  uint64_t a = scaled > 0 ? (uint64_t)fmin(scaled, (1 << BITS) - 1) : 0, result = 0;
  for (int i = 0; i < BITS; i++)
    result |= (a >> i & 1) << 3 * i;
  return result;
}

static int compare(const void *a, const void *b)
{
  const keyed *x = a, *y = b;
  return x->key < y->key ? -1 : x->key > y->key;
}

static double axis_of(const zs_rbf_centre *c, int axis)
{
  return axis == 0 ? c->x : axis == 1 ? c->y : c->z;
}

static void measure(zs_swarm *s, const keyed *list)
{
  double sum = 0, squares = 0;
  s->lift = INFINITY;
  for (int k = 0; k < 3; k++) {
    s->lo[k] = INFINITY;
    s->hi[k] = -INFINITY;
  }
  for (uint32_t j = s->range.first; j < s->range.first + s->range.count; j++) {
    const zs_rbf_centre *c = &list[j].centre;
    for (int k = 0; k < 3; k++) {
      s->lo[k] = fmin(s->lo[k], axis_of(c, k));
      s->hi[k] = fmax(s->hi[k], axis_of(c, k));
    }
    s->lift = fmin(s->lift, c->lift);
    sum += c->weight;
    squares += c->weight * c->weight;
  }
  s->weight = fabs(sum) + sqrt(squares);
}

/* The end of the part of a range that is in one child of a cell of `level`. */
static uint32_t child_end(const keyed *list, uint32_t first, uint32_t end, int level)
{
  const int shift = 3 * (BITS - 1 - level);
  const uint64_t child = list[first].key >> shift;
  while (first < end && list[first].key >> shift == child)
    first++;
  return first;
}

/* Divide the swarm `index` at `level`.  False when memory is out. */
static bool divide(zs_swarms *swarms, size_t *capacity, const keyed *list, size_t index,
                   int level)
{
  const zs_rbf_range range = swarms->list[index].range;
  const double half = swarms->list[index].half / 2;
  measure(&swarms->list[index], list);
  if (range.count <= LEAF || level == DEPTH)
    return true;
  zs_swarm *longer = zs_array_grown(swarms->list, swarms->count + 8, capacity, sizeof *longer);
  if (!longer)
    return false;
  swarms->list = longer;
  const size_t first = swarms->count;
  for (uint32_t at = range.first, end = at + range.count; at < end; swarms->count++) {
    const uint32_t next = child_end(list, at, end, level);
    swarms->list[swarms->count] = (zs_swarm){.range = {at, next - at}, .half = half};
    at = next;
  }
  swarms->list[index].children = (uint32_t)first;
  swarms->list[index].child_count = (uint32_t)(swarms->count - first);
  const size_t last = swarms->count;
  for (size_t i = first; i < last; i++)
    if (!divide(swarms, capacity, list, i, level + 1))
      return false;
  return true;
}

/* Make the grid of one of the orders. */
static bool make_grid(zs_swarm *s, const zs_rbf_centre *centres, int which)
{
  const unsigned order = zs_swarm_orders[which], count = order * order * order;
  zs_nodes grid = {.dimension = 3};
  zs_rbf_centre *nodes = malloc(count * sizeof *nodes);
  double *points = malloc(3 * count * sizeof *points);
  double *weights = calloc(count, sizeof *weights);
  const bool done = nodes && points && weights;
  for (int k = 0; k < 3; k++) {
    grid.side[k] = order;
    grid.lo[k] = s->lo[k];
    grid.hi[k] = s->hi[k];
  }
  if (done) {
    enum { PART = 64 };
    double at[3 * PART], weight[PART];
    for (uint32_t j = 0; j < s->range.count; j += PART) {
      const uint32_t n = s->range.count - j < PART ? s->range.count - j : PART;
      for (uint32_t i = 0; i < n; i++) {
        const zs_rbf_centre *c = &centres[s->range.first + j + i];
        for (int k = 0; k < 3; k++)
          at[3 * i + (uint32_t)k] = axis_of(c, k);
        weight[i] = c->weight;
      }
      zs_nodes_select()->collect(&grid, weights, at, n, weight);
    }
    zs_nodes_points(&grid, points);
    for (size_t i = 0; i < count; i++)
      nodes[i] =
        (zs_rbf_centre){points[3 * i], points[3 * i + 1], points[3 * i + 2], 0, weights[i]};
    s->grids[which] = nodes;
  } else {
    free(nodes);
  }
  free(points);
  free(weights);
  return done;
}

bool zs_swarms_make(zs_swarms *swarms, const zs_rbf_terms *terms)
{
  size_t capacity = 64;
  bool flat = true;
  keyed *list = malloc(terms->count * sizeof *list);
  *swarms = (zs_swarms){calloc(capacity, sizeof *swarms->list), 1};
  bool done = list && swarms->list;
  for (size_t j = 0; done && j < terms->count; j++) {
    const zs_rbf_centre *c = &terms->centres[j];
    list[j] = (keyed){spread(c->x) | spread(c->y) << 1 | spread(c->z) << 2, *c};
    flat = flat && c->lift <= 0;
  }
  if (done) {
    qsort(list, terms->count, sizeof *list, compare);
    for (size_t j = 0; j < terms->count; j++)
      terms->centres[j] = list[j].centre;
    swarms->list[0] = (zs_swarm){.range = {0, (uint32_t)terms->count}, .half = HALF};
    done = divide(swarms, &capacity, list, 0, 0);
  }
  free(list);
  for (size_t i = 0; done && flat && i < swarms->count; i++)
    for (int which = 0; done && which < ZS_SWARM_GRIDS; which++)
      if (swarms->list[i].range.count > pow(zs_swarm_orders[which], 3))
        done = make_grid(&swarms->list[i], terms->centres, which);
  return done;
}

void zs_swarms_clear(zs_swarms *swarms)
{
  for (size_t i = 0; swarms->list && i < swarms->count; i++)
    for (int which = 0; which < ZS_SWARM_GRIDS; which++)
      free((void *)swarms->list[i].grids[which]);
  free(swarms->list);
  *swarms = (zs_swarms){NULL, 0};
}
