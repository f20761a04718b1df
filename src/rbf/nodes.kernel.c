/* Interpolation on Chebyshev nodes.  Compiled once per instruction set: a vector
 * holds one number for each of several points. */
#include "rbf/nodes.h"
#include "rbf/vector.h"

#include <math.h>
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

const zs_nodes_kernels ZS_KERNELS(zs_nodes_table) = {interpolate, collect};
