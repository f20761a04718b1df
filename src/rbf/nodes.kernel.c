/* Interpolation on Chebyshev nodes.  Compiled once per instruction set: a vector
 * holds one number for each of several points. */
#include "rbf/nodes.h"
#include "rbf/vector.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { SIDE = ZS_NODES_MOST, AXES = ZS_RBF_MAXIMUM_DIMENSION };

typedef zs_vector vector;

/* The parts of the nodes along each axis in the value at some points:
 *   l_j (x) = (1 + 2 sum_k T_k (x_j) T_k (x)) / n,  x in -1 .. 1. */
typedef struct parts {
  vector part[AXES][SIDE];
} parts;

/* T_k (x_j) 2 / n, the half of it for k = 0. */
typedef struct coefficients {
  double at[AXES][SIDE][SIDE];
} coefficients;

static void find_coefficients(const zs_nodes *nodes, coefficients *c)
{
  for (unsigned axis = 0; axis < nodes->dimension; axis++) {
    const unsigned n = nodes->side[axis];
    for (unsigned j = 0; j < n; j++)
      for (unsigned k = 0; k < n; k++)
        c->at[axis][j][k] =
          (k ? 2.0 : 1.0) / n * cos(3.14159265358979323846 * k * (j + 0.5) / n);
  }
}

/* For ZS_WIDTH points; idle lanes repeat the last. */
static void find_parts(const zs_nodes *nodes, const coefficients *c, const double *points,
                       size_t count, parts *p)
{
  for (unsigned axis = 0; axis < nodes->dimension; axis++) {
    const unsigned n = nodes->side[axis];
    const double middle = 0.5 * (nodes->lo[axis] + nodes->hi[axis]);
    const double half = 0.5 * (nodes->hi[axis] - nodes->lo[axis]);
    double row[ZS_WIDTH];
    vector x, t[SIDE];
    for (unsigned i = 0; i < ZS_WIDTH; i++)
      row[i] = points[(i < count ? i : count - 1) * nodes->dimension + axis];
    memcpy(&x, row, sizeof x);
    x = half > 0 ? (x - middle) / half : (vector){0};
    t[0] = (vector){0} + 1;
    t[1] = x;
    for (unsigned k = 2; k < n; k++)
      t[k] = 2 * x * t[k - 1] - t[k - 2];
    for (unsigned j = 0; j < n; j++) {
      vector sum = {0};
      for (unsigned k = 0; k < n; k++)
        sum += c->at[axis][j][k] * t[k];
      p->part[axis][j] = sum;
    }
  }
}

/* The value at some points of the polynomial in the axes from `axis` on; moves
 * past the nodes' values. */
static vector evaluate(const zs_nodes *nodes, const parts *p, unsigned axis, const double **values)
{
  vector sum = {0};
  const unsigned n = nodes->side[axis];
  if (axis + 1 >= nodes->dimension) {
    for (unsigned j = 0; j < n; j++)
      sum += (*values)[j] * p->part[axis][j];
    *values += n;
    return sum;
  }
  for (unsigned j = 0; j < n; j++)
    sum += p->part[axis][j] * evaluate(nodes, p, axis + 1, values);
  return sum;
}

static void interpolate(const zs_nodes *nodes, const double *values, const double *points,
                        size_t count, double *sums)
{
  coefficients c;
  parts p;
  find_coefficients(nodes, &c);
  for (size_t i = 0; i < count; i += ZS_WIDTH) {
    const size_t lanes = count - i < ZS_WIDTH ? count - i : ZS_WIDTH;
    const double *next = values;
    find_parts(nodes, &c, points + i * nodes->dimension, lanes, &p);
    const vector sum = evaluate(nodes, &p, 0, &next);
    for (size_t lane = 0; lane < lanes; lane++)
      sums[i + lane] += sum[lane];
  }
}

/* Some points' weights times the parts along the axes so far, to the nodes. */
static void distribute(const zs_nodes *nodes, const parts *p, unsigned axis, vector weight,
                       double **values)
{
  const unsigned n = nodes->side[axis];
  for (unsigned j = 0; j < n; j++) {
    const vector part = weight * p->part[axis][j];
    if (axis + 1 < nodes->dimension) {
      distribute(nodes, p, axis + 1, part, values);
      continue;
    }
    double sum = 0;
    for (unsigned lane = 0; lane < ZS_WIDTH; lane++)
      sum += part[lane];
    *(*values)++ += sum;
  }
}

static void collect(const zs_nodes *nodes, double *values, const double *points, size_t count,
                    const double *weights)
{
  coefficients c;
  parts p;
  find_coefficients(nodes, &c);
  for (size_t i = 0; i < count; i += ZS_WIDTH) {
    const size_t lanes = count - i < ZS_WIDTH ? count - i : ZS_WIDTH;
    double row[ZS_WIDTH] = {0}, *next = values;
    vector weight;
    memcpy(row, weights + i, lanes * sizeof *row);
    memcpy(&weight, row, sizeof weight);
    find_parts(nodes, &c, points + i * nodes->dimension, lanes, &p);
    distribute(nodes, &p, 0, weight, &next);
  }
}

/* ---- From grid to grid --------------------------------------------------------------- */

/* The parts of a grid's nodes along an axis in the value at another one's: [of][at]. */
typedef struct exchange {
  unsigned of, at;
  double part[SIDE * SIDE];
} exchange;

static void find_exchange(const zs_nodes *of, const zs_nodes *at, unsigned axis, exchange *e)
{
  const zs_nodes one = {
    .dimension = 1, .side = {of->side[axis]}, .lo = {of->lo[axis]}, .hi = {of->hi[axis]}};
  const zs_nodes other = {
    .dimension = 1, .side = {at->side[axis]}, .lo = {at->lo[axis]}, .hi = {at->hi[axis]}};
  double place[SIDE];
  coefficients c;
  parts p;
  zs_nodes_points(&other, place);
  find_coefficients(&one, &c);
  e->of = one.side[0];
  e->at = other.side[0];
  for (unsigned i = 0; i < e->at; i += ZS_WIDTH) {
    const unsigned lanes = e->at - i < ZS_WIDTH ? e->at - i : ZS_WIDTH;
    find_parts(&one, &c, place + i, lanes, &p);
    for (unsigned j = 0; j < e->of; j++)
      for (unsigned lane = 0; lane < lanes; lane++)
        e->part[j * e->at + i + lane] = p.part[0][j][lane];
  }
}

/* to[r][i] = sum_j from[j][r] part[j][i]: the first axis of `from` is exchanged, and becomes the
 * last one. */
static void exchange_first(const exchange *e, size_t rest, const double *from, double *to)
{
  memset(to, 0, rest * e->at * sizeof *to);
  for (size_t r = 0; r < rest; r++)
    for (unsigned j = 0; j < e->of; j++) {
      const double x = from[j * rest + r], *part = &e->part[j * e->at];
      double *row = &to[r * e->at];
#pragma omp simd
      for (unsigned i = 0; i < e->at; i++)
        row[i] += x * part[i];
    }
}

/* The other way round. */
static void transpose(exchange *e)
{
  const exchange before = *e;
  e->of = before.at;
  e->at = before.of;
  for (unsigned j = 0; j < e->of; j++)
    for (unsigned i = 0; i < e->at; i++)
      e->part[j * e->at + i] = before.part[i * before.at + j];
}

/* Add what numbers on one grid are on the other: `back` from the nodes of `at` to those of
 * `of`. */
static void bring(const zs_nodes *of, const zs_nodes *at, bool back, const double *from, double *to)
{
  double scratch[2][ZS_NODES_ROOM];
  size_t size = zs_nodes_count(back ? at : of);
  exchange e;
  for (unsigned axis = 0; axis < of->dimension; axis++) {
    find_exchange(of, at, axis, &e);
    if (back)
      transpose(&e);
    exchange_first(&e, size / e.of, from, scratch[axis % 2]);
    from = scratch[axis % 2];
    size = size / e.of * e.at;
  }
  for (size_t i = 0; i < size; i++)
    to[i] += from[i];
}

static void interpolate_grid(const zs_nodes *nodes, const double *values, const zs_nodes *at,
                             double *sums)
{
  bring(nodes, at, false, values, sums);
}

static void collect_grid(const zs_nodes *nodes, double *values, const zs_nodes *at,
                         const double *weights)
{
  bring(nodes, at, true, weights, values);
}

const zs_nodes_kernels ZS_KERNELS(zs_nodes_table) = {interpolate, collect, interpolate_grid,
                                                     collect_grid};
