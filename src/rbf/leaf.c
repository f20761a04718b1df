#include "rbf/leaf.h"

#include "base/memory.h"
#include "rbf/local.h"
#include "rbf/product.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  AROUND = 224,        /* points around a leaf, ... */
  AROUND_FEW = 96,     /* ... or so many, ... */
  AROUND_PART = 8      /* ... or one in so many of all: iterations take less than leaves when
                          points are few */
};

static size_t padded(size_t n)
{
  return (n + ZS_LOCAL_BLOCK - 1) / ZS_LOCAL_BLOCK * ZS_LOCAL_BLOCK;
}

enum {
  MOST = ZS_LEAF_POINTS + AROUND, /* points of a leaf's system */
  /* Its size: polynomials take some points out, padding adds to both parts. */
  SIZE = MOST + 2 * ZS_LOCAL_BLOCK,
  TERMS = 2 * ZS_LOCAL_BLOCK /* at least ZS_RBF_MAXIMUM_TERMS */
};

enum { CANDIDATES = 2 * AROUND + ZS_LEAF_POINTS }; /* to be around a leaf */

struct zs_leaf_maker {
  zs_rbf_neighbour around[CANDIDATES];
  uint32_t points[MOST];
  double at[MOST * ZS_RBF_MAXIMUM_DIMENSION];       /* the points' coordinates */
  double lagrange[MOST * ZS_RBF_MAXIMUM_TERMS];     /* monomials, then their Lagrange basis */
  bool special[MOST];
  uint32_t order[SIZE];                             /* which point each row is of */
  double ordered[SIZE * ZS_RBF_MAXIMUM_DIMENSION];
  double signs[SIZE];
  double panel[3 * ZS_RBF_MAXIMUM_TERMS * SIZE];
  double transposed[TERMS * SIZE];
  double matrix[SIZE * SIZE], rows[(ZS_LEAF_POINTS + ZS_LOCAL_BLOCK) * SIZE];
  double eliminated[(ZS_LEAF_POINTS + ZS_LOCAL_BLOCK) * TERMS];
};

/* What is being made: `around` points come first, then the leaf's `inner`.
 *
 * Some of those around, `rank` of them, are special: polynomials are determined
 * by their values there.  Weights orthogonal to polynomials are determined by
 * the weights of all others, y: with E the other points' values of the basis
 * polynomials that are 1 at one special point and 0 at the others,
 * the special weights are -E^T y, and y solves
 *   (A_rr - E A_sr - A_rs E^T + E A_ss E^T) y = h_r - E h_s.
 * Rows of that system: padding, others around, inner points, padding. */
typedef struct making {
  const zs_rbf_system *system;
  zs_leaf_maker *s;
  size_t around, inner, rank;
  uint32_t special[ZS_RBF_MAXIMUM_TERMS];
  size_t front, size; /* padding before the first row; rows */
  size_t inner_rows;  /* the last ones */
} making;

/* Monomials about the middle of the points, on their scale. */
static void find_monomials(const making *m, size_t count)
{
  const zs_rbf_system *system = m->system;
  const unsigned dimension = system->dimension;
  double lo[ZS_RBF_MAXIMUM_DIMENSION], hi[ZS_RBF_MAXIMUM_DIMENSION], size = 0;
  for (unsigned k = 0; k < dimension; k++) {
    lo[k] = INFINITY;
    hi[k] = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      lo[k] = fmin(lo[k], m->s->at[i * dimension + k]);
      hi[k] = fmax(hi[k], m->s->at[i * dimension + k]);
    }
    size = fmax(size, hi[k] - lo[k]);
  }
  for (size_t i = 0; i < count; i++) {
    double u[ZS_RBF_MAXIMUM_DIMENSION];
    for (unsigned k = 0; k < dimension; k++)
      u[k] = (2 * m->s->at[i * dimension + k] - lo[k] - hi[k]) / size;
    zs_rbf_monomials(dimension, system->degree, u, m->s->lagrange + i * system->terms);
  }
}

/* The greatest of the monomials, by elimination so far, that no point was
 * chosen for. */
static double find_pivot(const making *m, size_t *point, size_t *column)
{
  const unsigned terms = m->system->terms;
  double greatest = 0;
  for (size_t i = 0; i < m->around; i++)
    for (size_t j = m->rank; j < terms; j++)
      if (fabs(m->s->lagrange[i * terms + j]) > greatest) {
        greatest = fabs(m->s->lagrange[i * terms + j]);
        *point = i;
        *column = j;
      }
  return greatest;
}

/* Turn the monomials into polynomials of which each is 1 at one special point
 * and 0 at the others, by Gauss-Jordan elimination of columns. */
static void find_lagrange(making *m, size_t count)
{
  static const double FLAT = 1e-6; /* as in dense.c */
  const unsigned terms = m->system->terms;
  double *p = m->s->lagrange;
  size_t point = 0, column = 0;
  memset(m->s->special, 0, count * sizeof *m->s->special);
  while (m->rank < terms && find_pivot(m, &point, &column) > FLAT) {
    const size_t chosen = m->rank++;
    const double pivot = p[point * terms + column];
    double factor[ZS_RBF_MAXIMUM_TERMS];
    m->s->special[point] = true;
    m->special[chosen] = (uint32_t)point;
    for (size_t i = 0; i < count; i++) {
      double *row = p + i * terms, kept = row[column];
      row[column] = row[chosen];
      row[chosen] = kept / pivot;
    }
    memcpy(factor, p + point * terms, sizeof *factor * terms);
    for (size_t i = 0; i < count; i++)
      for (size_t j = 0; j < terms; j++)
        if (j != chosen)
          p[i * terms + j] -= factor[j] * p[i * terms + chosen];
  }
}

/* Put the rows in order. */
static void order_rows(making *m)
{
  zs_leaf_maker *s = m->s;
  const unsigned dimension = m->system->dimension;
  const size_t others = m->around - m->rank, outer = padded(others);
  m->front = outer - others;
  m->inner_rows = padded(m->inner);
  m->size = outer + m->inner_rows;
  size_t row = m->front;
  for (size_t i = 0; i < m->around + m->inner; i++)
    if (i >= m->around || !s->special[i])
      s->order[row++] = (uint32_t)i;
  for (size_t i = 0; i < m->size; i++) {
    const bool real = i >= m->front && i < row;
    if (!real)
      s->order[i] = 0;
    s->signs[i] = real ? zs_rbf_sign(m->system->radial.kernel) : 0;
    memcpy(s->ordered + i * dimension, s->at + s->order[i] * dimension,
           dimension * sizeof *s->at);
  }
}

/* A between all rows and some points. */
static void tabulate(const making *m, const double *sources, const double *signs, size_t count,
                     double *matrix)
{
  const zs_rbf_system *system = m->system;
  zs_rbf_multiply_select()(&(zs_rbf_product){.radial = system->radial,
                                             .dimension = system->dimension,
                                             .target_count = m->size,
                                             .source_count = count,
                                             .targets = m->s->ordered,
                                             .sources = sources,
                                             .weights = signs,
                                             .matrix = matrix,
                                             .stride = m->size});
}

/* The panel [E C E], C = A_rs - E A_ss / 2, of which E C^T + C E^T is made. */
static void make_panel(const making *m)
{
  zs_leaf_maker *s = m->s;
  const zs_rbf_system *system = m->system;
  const unsigned dimension = system->dimension;
  const size_t n = m->size, rank = m->rank;
  const double sign = zs_rbf_sign(system->radial.kernel);
  double *e = s->panel, *c = e + rank * n;
  for (size_t k = 0; k < rank; k++) {
    const double *at = s->at + m->special[k] * dimension;
    tabulate(m, at, &sign, 1, c + k * n);
    for (size_t i = 0; i < n; i++)
      e[k * n + i] = s->lagrange[s->order[i] * system->terms + k];
  }
  for (size_t k = 0; k < rank; k++)
    for (size_t l = 0; l < rank; l++) {
      double square = 0;
      for (unsigned x = 0; x < dimension; x++) {
        const double difference = s->at[m->special[k] * dimension + x] -
                                  s->at[m->special[l] * dimension + x];
        square += difference * difference;
      }
      const double a = sign * zs_rbf_phi(system->radial, square) +
                       (k == l ? system->smoothing : 0);
      for (size_t i = 0; i < n; i++)
        c[k * n + i] -= 0.5 * a * e[l * n + i];
    }
  for (size_t k = 0; k < 2 * rank; k++)
    for (size_t i = 0; i < n; i++)
      if (s->signs[i] == 0)
        e[k * n + i] = 0;
  memcpy(c + rank * n, e, rank * n * sizeof *e);
}

/* The matrix of y, with `extra` on its diagonal; returns the greatest entry
 * there.  Padding has a one on the diagonal, and is alone. */
static double make_matrix(const making *m, const zs_local_kernels *kernels, double extra)
{
  zs_leaf_maker *s = m->s;
  const size_t n = m->size;
  double greatest = 0;
  tabulate(m, s->ordered, s->signs, n, s->matrix);
  kernels->subtract(s->matrix, n, n, n, s->panel, n, s->panel + m->rank * n, n, 2 * m->rank);
  for (size_t j = 0; j < n; j++) {
    double *column = s->matrix + j * n;
    for (size_t i = m->front + m->around - m->rank + m->inner; i < n; i++)
      column[i] = 0;
    column[j] += m->system->smoothing;
    greatest = fmax(greatest, column[j]);
    column[j] = s->signs[j] == 0 ? 1 : column[j] + extra;
  }
  return greatest;
}

/* Factorise the leaf's system; where rounding makes it indefinite, one with a
 * little more smoothing, which will do for a preconditioner. */
static bool factorise(const making *m, const zs_local_kernels *kernels)
{
  const zs_local local = {m->size, m->inner_rows, m->s->matrix, m->s->rows};
  double extra = 0;
  for (int attempt = 0; attempt < 6; attempt++) {
    const double greatest = make_matrix(m, kernels, extra);
    if (kernels->invert(&local))
      return true;
    extra = extra > 0 ? 100 * extra : 1e-14 * greatest;
  }
  return false;
}

/* What special points contribute to the rows: - rows E. */
static void eliminate_special(const making *m, const zs_local_kernels *kernels)
{
  zs_leaf_maker *s = m->s;
  const size_t n = m->size;
  memset(s->eliminated, 0, m->inner_rows * TERMS * sizeof *s->eliminated);
  memset(s->transposed, 0, n * TERMS * sizeof *s->transposed);
  for (size_t k = 0; k < m->rank; k++)
    for (size_t i = 0; i < n; i++)
      s->transposed[i * TERMS + k] = s->panel[k * n + i];
  kernels->subtract(s->eliminated, m->inner_rows, m->inner_rows, TERMS, s->rows, m->inner_rows,
                    s->transposed, TERMS, n);
}

static void store_row(const making *m, zs_leaf *l, uint32_t point, const double *row)
{
  l->points[l->count] = m->s->points[point];
  for (size_t i = 0; i < l->inner; i++)
    l->rows[l->count * l->inner + i] = (float)row[i];
  l->count++;
}

static void store(const making *m, zs_leaf *l)
{
  const zs_leaf_maker *s = m->s;
  l->count = 0;
  for (size_t i = 0; i < m->size; i++)
    if (s->signs[i] != 0)
      store_row(m, l, s->order[i], s->rows + i * m->inner_rows);
  for (size_t k = 0; k < m->rank; k++)
    store_row(m, l, m->special[k], s->eliminated + k * m->inner_rows);
}

static int by_point(const void *a, const void *b)
{
  const zs_rbf_neighbour *p = a, *q = b;
  if (p->point != q->point)
    return p->point < q->point ? -1 : 1;
  return (p->square > q->square) - (p->square < q->square);
}

static int by_distance(const void *a, const void *b)
{
  const zs_rbf_neighbour *p = a, *q = b;
  if (p->square != q->square)
    return p->square < q->square ? -1 : 1;
  return (p->point > q->point) - (p->point < q->point);
}

static size_t most_around(const zs_rbf_system *system)
{
  const size_t part = system->count / AROUND_PART;
  return part < AROUND_FEW ? AROUND_FEW : part < AROUND ? part : AROUND;
}

/* Those outside a leaf that are nearest to the smallest clusters of the leaf,
 * measured by how far the neighbours of each one reach: so a leaf has some on
 * all sides, also where points are much denser on one side. */
static size_t find_around(const zs_rbf_system *system, const zs_rbf_clusters *clusters,
                          const zs_rbf_cluster *leaf, zs_leaf_maker *s)
{
  const zs_rbf_cluster *parts[ZS_LEAF_POINTS];
  const size_t count = zs_rbf_clusters_parts(clusters, leaf, parts);
  const size_t wanted = most_around(system);
  size_t found = 0, distinct = 0;
  for (size_t i = 0; i < count; i++) {
    zs_rbf_neighbour *near = s->around + found;
    const size_t most =
      zs_rbf_clusters_around(clusters, leaf, parts[i], 2 * wanted / count + 1, near);
    double farthest = 0;
    for (size_t j = 0; j < most; j++)
      farthest = fmax(farthest, near[j].square);
    for (size_t j = 0; farthest > 0 && j < most; j++)
      near[j].square /= farthest;
    found += most;
  }
  qsort(s->around, found, sizeof *s->around, by_point);
  for (size_t i = 0; i < found; i++)
    if (i == 0 || s->around[i].point != s->around[i - 1].point)
      s->around[distinct++] = s->around[i];
  qsort(s->around, distinct, sizeof *s->around, by_distance);
  return distinct < wanted ? distinct : wanted;
}

bool zs_leaf_make(zs_leaf *l, const zs_rbf_system *system, const zs_rbf_clusters *clusters,
                  const zs_rbf_cluster *cluster, zs_leaf_maker *s)
{
  const zs_local_kernels *kernels = zs_local_select();
  const unsigned dimension = system->dimension;
  making m = {.system = system, .s = s, .inner = cluster->count};
  m.around = find_around(system, clusters, cluster, s);
  const size_t count = m.around + m.inner;
  for (size_t i = 0; i < count; i++) {
    s->points[i] =
      i < m.around ? s->around[i].point : (uint32_t)(cluster->first + i - m.around);
    memcpy(s->at + i * dimension, system->points + (size_t)s->points[i] * dimension,
           dimension * sizeof *s->at);
  }
  find_monomials(&m, count);
  find_lagrange(&m, count);
  order_rows(&m);
  make_panel(&m);
  if (!factorise(&m, kernels))
    return false;
  eliminate_special(&m, kernels);
  store(&m, l);
  return true;
}

void zs_leaf_solve(const zs_leaf *l, const double *residual, double *weights)
{
  double values[MOST];
  for (size_t j = 0; j < l->count; j++)
    values[j] = residual[l->points[j]];
  memset(weights + l->first, 0, l->inner * sizeof *weights);
  zs_local_select()->apply(l->rows, l->inner, l->count, values, weights + l->first);
}

bool zs_leaves_begin(zs_leaves *leaves, const zs_rbf_system *system,
                     const zs_rbf_cluster *const *clusters, size_t count)
{
  const size_t around = most_around(system);
  size_t points = 0, rows = 0;
  for (size_t i = 0; i < count; i++) {
    points += clusters[i]->count + around;
    rows += clusters[i]->count * (clusters[i]->count + around);
  }
  *leaves = (zs_leaves){.list = calloc(count, sizeof *leaves->list),
                        .count = count,
                        .points = zs_memory_new(points, sizeof *leaves->points),
                        .rows = zs_memory_new(rows, sizeof *leaves->rows)};
  if (!leaves->list || !leaves->points || !leaves->rows)
    return false;
  uint32_t *point = leaves->points;
  float *row = leaves->rows;
  for (size_t i = 0; i < count; i++) {
    const size_t inner = clusters[i]->count;
    leaves->list[i] =
      (zs_leaf){.first = clusters[i]->first, .inner = inner, .points = point, .rows = row};
    point += inner + around;
    row += inner * (inner + around);
  }
  return true;
}

void zs_leaves_clear(zs_leaves *leaves)
{
  free(leaves->list);
  free(leaves->points);
  free(leaves->rows);
}

zs_leaf_maker *zs_leaf_maker_new(void)
{
  return malloc(sizeof(zs_leaf_maker));
}

double zs_leaf_maker_bytes(void)
{
  return (double)sizeof(zs_leaf_maker);
}

double zs_leaf_bytes(double leaves, double points)
{
  return leaves * (sizeof(zs_leaf) + MOST * sizeof(uint32_t)) + points * MOST * sizeof(float);
}
