#include "rbf/schwarz.h"

#include "rbf/adaptive.h"
#include "rbf/fgmres.h"
#include "rbf/local.h"
#include "rbf/product.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  INNER = 80,          /* most points of a leaf */
  AROUND = 224,        /* points around it, ... */
  AROUND_FEW = 96,     /* ... or so many, ... */
  AROUND_PART = 8,     /* ... or one in so many of all: iterations take less than leaves when
                          points are few */
  LAST = 4096,         /* most points of the last level */
  COARSENING = 25,     /* on each level there is one point for so many at least, ... */
  LEAST = 500,         /* ... and so many; */
  REMOTE = 2,          /* and for so many of those another one, far from them */
  LEVELS = 6,
  BATCH = 256          /* leaves between two looks for cancellation */
};

/* From so many pairs of points of one level and of the next on, products between them take
 * clusters together.  They may be off by this part of residuals of random sign: with all pairs
 * the iterations are as many, with ten times as much they still are, with a hundred times as much
 * three times as many. */
static const double MANY_PAIRS = 2e8, DOWN = 0.5;

/* What solving for a level in the middle may leave, by the residual above, and the part of
 * this that products may be off by. */
static const double LEFT = 0.01, OFF = 0.1;

/* A leaf's points are first .. first + inner of its level. */
typedef struct leaf {
  size_t first, inner, count;
  uint32_t *points; /* count: those of the leaf and those around it */
  float *rows;      /* inner x count, column-major: from residuals to weights */
} leaf;

typedef struct level {
  zs_rbf_system system;
  zs_rbf_clusters *own; /* what the points belong to; NULL on the first level */
  const zs_rbf_clusters *clusters;
  leaf *leaves;
  size_t leaf_count;
  zs_span span;
  uint32_t *next;       /* points of the next level among this one's, in its order */
  zs_fast *down;        /* products with weights here at those points; NULL: of all pairs */
  double *residual, *weights;
  double *given, *found; /* a residual, and the weights for it: of levels in the middle */
  zs_adaptive products;  /* of theirs, ... */
  zs_adaptive_series series; /* ... which are all alike */
} level;

struct zs_schwarz {
  unsigned levels; /* the last one is dense */
  level level[LEVELS];
  double *matrix;
  zs_dense dense;
};

/* The most points of a cluster that has one point on the next level. */
static size_t coarsening(size_t count)
{
  const size_t most = count / LEAST + 1;
  return most < COARSENING ? most : COARSENING;
}

/* Points of the next level when there are so many clusters: one for each, and others. */
static size_t room_for(size_t clusters)
{
  return clusters + clusters / REMOTE;
}

/* ---- Leaves ----------------------------------------------------------------------- */

static size_t padded(size_t n)
{
  return (n + ZS_LOCAL_BLOCK - 1) / ZS_LOCAL_BLOCK * ZS_LOCAL_BLOCK;
}

enum {
  MOST = INNER + AROUND, /* points of a leaf's system */
  /* Its size: polynomials take some points out, padding adds to both parts. */
  SIZE = MOST + 2 * ZS_LOCAL_BLOCK,
  TERMS = 2 * ZS_LOCAL_BLOCK /* at least ZS_RBF_MAXIMUM_TERMS */
};

enum { CANDIDATES = 2 * AROUND + INNER }; /* to be around a leaf */

/* One thread's memory for making leaves. */
typedef struct scratch {
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
  double matrix[SIZE * SIZE], rows[(INNER + ZS_LOCAL_BLOCK) * SIZE];
  double eliminated[(INNER + ZS_LOCAL_BLOCK) * TERMS];
} scratch;

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
  const level *level;
  scratch *s;
  size_t around, inner, rank;
  uint32_t special[ZS_RBF_MAXIMUM_TERMS];
  size_t front, size; /* padding before the first row; rows */
  size_t inner_rows;  /* the last ones */
} making;

/* Monomials about the middle of the points, on their scale. */
static void find_monomials(const making *m, size_t count)
{
  const zs_rbf_system *system = &m->level->system;
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
  const unsigned terms = m->level->system.terms;
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
  const unsigned terms = m->level->system.terms;
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
  scratch *s = m->s;
  const unsigned dimension = m->level->system.dimension;
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
    s->signs[i] = real ? zs_rbf_sign(m->level->system.radial.kernel) : 0;
    memcpy(s->ordered + i * dimension, s->at + s->order[i] * dimension,
           dimension * sizeof *s->at);
  }
}

/* A between all rows and some points. */
static void tabulate(const making *m, const double *sources, const double *signs, size_t count,
                     double *matrix)
{
  const zs_rbf_system *system = &m->level->system;
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
  scratch *s = m->s;
  const zs_rbf_system *system = &m->level->system;
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
  scratch *s = m->s;
  const size_t n = m->size;
  double greatest = 0;
  tabulate(m, s->ordered, s->signs, n, s->matrix);
  kernels->subtract(s->matrix, n, n, n, s->panel, n, s->panel + m->rank * n, n, 2 * m->rank);
  for (size_t j = 0; j < n; j++) {
    double *column = s->matrix + j * n;
    for (size_t i = m->front + m->around - m->rank + m->inner; i < n; i++)
      column[i] = 0;
    column[j] += m->level->system.smoothing;
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
  scratch *s = m->s;
  const size_t n = m->size;
  memset(s->eliminated, 0, m->inner_rows * TERMS * sizeof *s->eliminated);
  memset(s->transposed, 0, n * TERMS * sizeof *s->transposed);
  for (size_t k = 0; k < m->rank; k++)
    for (size_t i = 0; i < n; i++)
      s->transposed[i * TERMS + k] = s->panel[k * n + i];
  kernels->subtract(s->eliminated, m->inner_rows, m->inner_rows, TERMS, s->rows, m->inner_rows,
                    s->transposed, TERMS, n);
}

static void store_row(const making *m, leaf *l, uint32_t point, const double *row)
{
  l->points[l->count] = m->s->points[point];
  for (size_t i = 0; i < l->inner; i++)
    l->rows[l->count * l->inner + i] = (float)row[i];
  l->count++;
}

static bool store(const making *m, leaf *l)
{
  const scratch *s = m->s;
  const size_t count = m->around + m->inner;
  l->points = malloc(count * sizeof *l->points);
  l->rows = malloc(count * l->inner * sizeof *l->rows);
  if (!l->points || !l->rows)
    return false;
  for (size_t i = 0; i < m->size; i++)
    if (s->signs[i] != 0)
      store_row(m, l, s->order[i], s->rows + i * m->inner_rows);
  for (size_t k = 0; k < m->rank; k++)
    store_row(m, l, m->special[k], s->eliminated + k * m->inner_rows);
  return true;
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

static size_t most_around(const level *level)
{
  const size_t part = level->system.count / AROUND_PART;
  return part < AROUND_FEW ? AROUND_FEW : part < AROUND ? part : AROUND;
}

/* Those outside a leaf that are nearest to the smallest clusters of the leaf,
 * measured by how far the neighbours of each one reach: so a leaf has some on
 * all sides, also where points are much denser on one side. */
static size_t find_around(const level *level, const zs_rbf_cluster *leaf, scratch *s)
{
  const zs_rbf_cluster *parts[INNER];
  const size_t count = zs_rbf_clusters_parts(level->clusters, leaf, parts);
  const size_t wanted = most_around(level);
  size_t found = 0, distinct = 0;
  for (size_t i = 0; i < count; i++) {
    zs_rbf_neighbour *near = s->around + found;
    const size_t most = zs_rbf_clusters_around(level->clusters, leaf, parts[i],
                                               2 * wanted / count + 1, near);
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

static zs_rbf_result make_leaf(const level *level, const zs_rbf_cluster *cluster,
                                   scratch *s, leaf *l)
{
  const zs_local_kernels *kernels = zs_local_select();
  const unsigned dimension = level->system.dimension;
  making m = {.level = level, .s = s, .inner = cluster->count};
  m.around = find_around(level, cluster, s);
  const size_t count = m.around + m.inner;
  for (size_t i = 0; i < count; i++) {
    s->points[i] =
      i < m.around ? s->around[i].point : (uint32_t)(cluster->first + i - m.around);
    memcpy(s->at + i * dimension, level->system.points + (size_t)s->points[i] * dimension,
           dimension * sizeof *s->at);
  }
  find_monomials(&m, count);
  find_lagrange(&m, count);
  order_rows(&m);
  make_panel(&m);
  *l = (leaf){.first = cluster->first, .inner = cluster->count};
  if (!factorise(&m, kernels))
    return ZS_RBF_SINGULAR;
  eliminate_special(&m, kernels);
  return store(&m, l) ? ZS_RBF_DONE : ZS_RBF_MEMORY;
}

static void solve_leaf(const leaf *l, const zs_local_kernels *kernels, const double *residual,
                       double *weights)
{
  double values[MOST];
  for (size_t j = 0; j < l->count; j++)
    values[j] = residual[l->points[j]];
  memset(weights + l->first, 0, l->inner * sizeof *weights);
  kernels->apply(l->rows, l->inner, l->count, values, weights + l->first);
}

static void solve_leaves(const level *l)
{
  const zs_local_kernels *kernels = zs_local_select();
#pragma omp parallel for schedule(static) num_threads(l->system.threads)
  for (size_t i = 0; i < l->leaf_count; i++)
    solve_leaf(&l->leaves[i], kernels, l->residual, l->weights);
  zs_rbf_system_project(&l->span, l->weights);
}

/* ---- Levels ------------------------------------------------------------------------ */

/* The point of a cluster that is nearest to the middle of its box. */
static uint32_t middle_point(const zs_rbf_clusters *all, const zs_rbf_cluster *cluster)
{
  double least = INFINITY;
  size_t nearest = cluster->first;
  for (size_t i = cluster->first; i < cluster->first + cluster->count; i++) {
    double square = 0;
    for (unsigned k = 0; k < all->dimension; k++) {
      const double d =
        2 * all->points[i * all->dimension + k] - cluster->lo[k] - cluster->hi[k];
      square += d * d;
    }
    if (square < least) {
      least = square;
      nearest = i;
    }
  }
  return (uint32_t)nearest;
}

/* Look for cancellation, and tell how much is done. */
typedef struct poll {
  bool (*call)(void *context, double fraction);
  void *context;
  size_t done, all; /* leaves */
} poll;

/* Some leaves, by all threads. */
static zs_rbf_result make_batch(level *l, const zs_rbf_cluster **list, size_t first, size_t last)
{
  zs_rbf_result worst = ZS_RBF_DONE;
#pragma omp parallel num_threads(l->system.threads) reduction(max : worst)
  {
    scratch *s = malloc(sizeof *s);
#pragma omp for schedule(dynamic, 1)
    for (size_t i = first; i < last; i++) {
      const zs_rbf_result result =
        s ? make_leaf(l, list[i], s, &l->leaves[i]) : ZS_RBF_MEMORY;
      worst = result > worst ? result : worst;
    }
    free(s);
  }
  return worst;
}

static zs_rbf_result make_leaves(level *l, poll *p)
{
  const size_t count = zs_rbf_clusters_cut(l->clusters, INNER, NULL);
  const zs_rbf_cluster **list = malloc(count * sizeof *list);
  l->leaves = calloc(count, sizeof *l->leaves);
  zs_rbf_result result = ZS_RBF_MEMORY;
  if (list && l->leaves) {
    l->leaf_count = zs_rbf_clusters_cut(l->clusters, INNER, list);
    result = ZS_RBF_DONE;
  }
  for (size_t i = 0; result == ZS_RBF_DONE && i < count; i += BATCH) {
    const size_t last = i + BATCH < count ? i + BATCH : count;
    result = make_batch(l, list, i, last);
    p->done += last - i;
    if (result == ZS_RBF_DONE && !p->call(p->context, (double)p->done / (double)p->all))
      result = ZS_RBF_CANCELLED;
  }
  free(list);
  return result;
}

/* A point that may be on the next level too, and how far it is from those that are. */
typedef struct candidate {
  double square;
  uint32_t point;
} candidate;

static int by_remoteness(const void *a, const void *b)
{
  const candidate *p = a, *q = b;
  if (p->square != q->square)
    return p->square > q->square ? -1 : 1;
  return (p->point > q->point) - (p->point < q->point);
}

/* List the other points of a cluster, each the farthest from those before it and from the
 * chosen one. */
static void list_candidates(const zs_rbf_clusters *all, const zs_rbf_cluster *cluster,
                            uint32_t chosen, candidate *list)
{
  const unsigned dimension = all->dimension;
  size_t count = 0;
  for (size_t i = cluster->first; i < cluster->first + cluster->count; i++)
    if (i != chosen)
      list[count++] = (candidate){INFINITY, (uint32_t)i};
  for (size_t next = 0; next < count; next++) {
    const double *from = all->points + (size_t)(next ? list[next - 1].point : chosen) * dimension;
    size_t farthest = next;
    for (size_t i = next; i < count; i++) {
      double square = 0;
      for (unsigned k = 0; k < dimension; k++) {
        const double d = all->points[(size_t)list[i].point * dimension + k] - from[k];
        square += d * d;
      }
      list[i].square = fmin(list[i].square, square);
      if (list[i].square > list[farthest].square)
        farthest = i;
    }
    const candidate kept = list[next];
    list[next] = list[farthest];
    list[farthest] = kept;
  }
}

/* Choose points of the next level: one of each cluster, and those that are farthest from
 * them, as many as there is room for.  Where points are sparse beside others that are dense,
 * a cluster's one point does not stand for all of it.  Returns how many, 0 when memory is
 * out. */
static size_t choose_points(const zs_rbf_clusters *clusters, size_t most, size_t room,
                            uint32_t *chosen)
{
  const size_t count = zs_rbf_clusters_cut(clusters, most, NULL);
  const zs_rbf_cluster **list = malloc(count * sizeof *list);
  candidate *candidates = malloc((clusters->count + 1) * sizeof *candidates);
  size_t chosen_count = 0, candidate_count = 0;
  if (list && candidates) {
    zs_rbf_clusters_cut(clusters, most, list);
    for (size_t i = 0; i < count; i++) {
      chosen[chosen_count++] = middle_point(clusters, list[i]);
      list_candidates(clusters, list[i], chosen[i], candidates + candidate_count);
      candidate_count += list[i]->count - 1;
    }
    qsort(candidates, candidate_count, sizeof *candidates, by_remoteness);
    for (size_t i = 0; i < candidate_count && chosen_count < room; i++)
      chosen[chosen_count++] = candidates[i].point;
  }
  free(list);
  free(candidates);
  return chosen_count;
}

/* The points of the next level, and their places in this one. */
static zs_rbf_result make_next(level *l, level *next)
{
  const unsigned dimension = l->system.dimension;
  const size_t most = coarsening(l->system.count);
  const size_t room = room_for(zs_rbf_clusters_cut(l->clusters, most, NULL));
  uint32_t *chosen = malloc(room * sizeof *chosen);
  double *points = malloc(room * dimension * sizeof *points);
  const size_t count = chosen ? choose_points(l->clusters, most, room, chosen) : 0;
  l->next = malloc(room * sizeof *l->next);
  if (count && points && l->next) {
    for (size_t i = 0; i < count; i++)
      memcpy(points + i * dimension, l->system.points + (size_t)chosen[i] * dimension,
             dimension * sizeof *points);
    next->own = zs_rbf_clusters_new(points, count, dimension, ZS_SCHWARZ_CLUSTER);
    next->clusters = next->own;
  }
  if (next->own) {
    next->system = l->system;
    next->system.count = count;
    next->system.points = next->own->points;
    for (size_t i = 0; i < count; i++)
      l->next[i] = chosen[next->own->order[i]];
  }
  free(chosen);
  free(points);
  return next->own ? ZS_RBF_DONE : ZS_RBF_MEMORY;
}

static bool has_many_pairs(double count, double next)
{
  return count * next >= MANY_PAIRS;
}

/* Choose products between the points of a level and of the next. */
static void choose_down(level *l, const level *next)
{
  if (!has_many_pairs((double)l->system.count, (double)next->system.count))
    return;
  zs_rbf_system_roughen(&l->system, l->residual);
  solve_leaves(l);
  l->down = zs_fast_choose(l->system.radial, next->clusters, l->clusters, l->weights, DOWN,
                           l->system.threads);
}

/* What every level needs; the last one also its matrix. */
static zs_rbf_result make_level(zs_schwarz *schwarz, level *l, bool last)
{
  const size_t n = l->system.count;
  double *monomials = zs_rbf_system_monomials(&l->system);
  l->residual = malloc(n * sizeof *l->residual);
  l->weights = malloc(n * sizeof *l->weights);
  if (last)
    schwarz->matrix = malloc(n * n * sizeof *schwarz->matrix);
  zs_rbf_result result = ZS_RBF_MEMORY;
  if (monomials && l->residual && l->weights && (!last || schwarz->matrix)) {
    if (last)
      zs_rbf_system_matrix(&l->system, schwarz->matrix);
    result = zs_rbf_result_of(last ? zs_dense_factorise(&schwarz->dense, n, l->system.terms,
                                                 schwarz->matrix, monomials)
                            : zs_span_make(&l->span, n, l->system.terms, monomials));
  }
  free(monomials);
  return result;
}

/* What levels between the first and the last need. */
static zs_rbf_result make_middle(level *l)
{
  l->given = malloc(l->system.count * sizeof *l->given);
  l->found = malloc(l->system.count * sizeof *l->found);
  l->products = (zs_adaptive){.system = &l->system, .clusters = l->clusters};
  return l->given && l->found ? ZS_RBF_DONE : ZS_RBF_MEMORY;
}

static zs_rbf_result make_levels(zs_schwarz *schwarz, poll *p)
{
  for (unsigned i = 0; i < LEVELS; i++) {
    level *l = &schwarz->level[i];
    const bool last = i > 0 && (l->system.count <= LAST || i == LEVELS - 1);
    schwarz->levels = i + 1;
    zs_rbf_result result = make_level(schwarz, l, last);
    if (result == ZS_RBF_DONE && i > 0 && !last)
      result = make_middle(l);
    if (result == ZS_RBF_DONE && !last)
      result = make_leaves(l, p);
    if (result == ZS_RBF_DONE && !last)
      result = make_next(l, l + 1);
    if (result == ZS_RBF_DONE && !last)
      choose_down(l, l + 1);
    if (result != ZS_RBF_DONE || last)
      return result;
  }
  return ZS_RBF_DONE;
}

zs_rbf_result zs_schwarz_new(const zs_rbf_system *system, const zs_rbf_clusters *clusters,
                                 bool (*call)(void *context, double fraction), void *context,
                                 zs_schwarz **schwarz)
{
  poll p = {.call = call, .context = context};
  for (size_t n = system->count; n > LAST || n == system->count; n /= COARSENING)
    p.all += 2 * n / INNER + 2;
  *schwarz = calloc(1, sizeof **schwarz);
  if (!*schwarz)
    return ZS_RBF_MEMORY;
  (*schwarz)->level[0].system = *system;
  (*schwarz)->level[0].clusters = clusters;
  zs_rbf_result result = make_levels(*schwarz, &p);
  if (result != ZS_RBF_DONE) {
    zs_schwarz_free(*schwarz);
    *schwarz = NULL;
  }
  return result;
}

void zs_schwarz_free(zs_schwarz *schwarz)
{
  if (!schwarz)
    return;
  for (unsigned i = 0; i < LEVELS; i++) {
    level *l = &schwarz->level[i];
    for (size_t j = 0; j < l->leaf_count; j++) {
      free(l->leaves[j].points);
      free(l->leaves[j].rows);
    }
    free(l->leaves);
    free(l->next);
    zs_fast_free(l->down);
    free(l->residual);
    free(l->weights);
    free(l->given);
    free(l->found);
    zs_adaptive_clear(&l->products);
    zs_span_free(&l->span);
    zs_rbf_clusters_free(l->own);
  }
  zs_dense_free(&schwarz->dense);
  free(schwarz->matrix);
  free(schwarz);
}

/* ---- Applying --------------------------------------------------------------------- */

/* Add to `sums`, at the points of the next level, what the weights of one make there. */
static bool multiply_down(const level *l, const level *next, double *sums)
{
  const zs_rbf_system *system = &l->system;
  if (l->down)
    return zs_fast_multiply(l->down, l->weights, sums);
  zs_rbf_multiply(&(zs_rbf_product){.radial = system->radial,
                                    .dimension = system->dimension,
                                    .target_count = next->system.count,
                                    .source_count = system->count,
                                    .targets = next->system.points,
                                    .sources = system->points,
                                    .weights = l->weights,
                                    .sums = sums},
                  system->threads);
  return true;
}

/* What the weights of a level leave over at the points of the next. */
static bool restrict_residual(const level *l, level *next)
{
  const zs_rbf_system *system = &l->system;
  const size_t count = next->system.count;
  const double sign = zs_rbf_sign(system->radial.kernel);
  memset(next->residual, 0, count * sizeof *next->residual);
  if (!multiply_down(l, next, next->residual))
    return false;
  for (size_t i = 0; i < count; i++)
    next->residual[i] = l->residual[l->next[i]] - sign * next->residual[i] -
                        system->smoothing * l->weights[l->next[i]];
  return true;
}

/* Solving for the residual of a level. */
typedef struct place {
  zs_schwarz *schwarz;
  unsigned index;   /* of the level */
  double aim, norm; /* what may be left, and what is */
} place;

static bool solve_level(place *p);

static double norm_of(const double *v, size_t count)
{
  double square = 0;
  for (size_t i = 0; i < count; i++)
    square += v[i] * v[i];
  return sqrt(square);
}

/* Weights for the residual of a level, by its leaves and then by the levels below. */
static bool sweep(const place *p)
{
  level *l = &p->schwarz->level[p->index], *next = l + 1;
  const double part = sqrt((double)next->system.count / (double)l->system.count);
  place below = {.schwarz = p->schwarz,
                 .index = p->index + 1,
                 .aim = LEFT * part * norm_of(l->residual, l->system.count)};
  solve_leaves(l);
  if (!restrict_residual(l, next) || !solve_level(&below))
    return false;
  for (size_t i = 0; i < next->system.count; i++)
    l->weights[l->next[i]] += next->weights[i];
  return true;
}

static bool precondition(void *context, const double *r, double *z)
{
  const place *p = context;
  level *l = &p->schwarz->level[p->index];
  memcpy(l->residual, r, l->system.count * sizeof *r);
  if (!sweep(p))
    return false;
  memcpy(z, l->weights, l->system.count * sizeof *z);
  zs_rbf_system_project(&l->span, z);
  return true;
}

static bool multiply(void *context, const double *x, double *result)
{
  const place *p = context;
  level *l = &p->schwarz->level[p->index];
  const double off = OFF * fmin(1, p->aim / p->norm) / sqrt((double)l->system.count);
  if (!zs_adaptive_multiply(&l->products, &l->series, x, off, result, NULL))
    return false;
  zs_rbf_system_project(&l->span, result);
  return true;
}

static bool stepped(void *context, double norm)
{
  place *p = context;
  p->norm = norm;
  return true;
}

/* Weights for the residual of a level in the middle, by some steps.  Leaves add up to much more
 * far from them than near, and leave residuals that are many times those above: one sweep would
 * leave too much of that. */
static bool iterate(place *p)
{
  level *l = &p->schwarz->level[p->index];
  const size_t n = l->system.count;
  const zs_fgmres fgmres = {n, p, multiply, precondition, stepped};
  zs_rbf_system_project(&l->span, l->residual);
  p->norm = norm_of(l->residual, n);
  memcpy(l->given, l->residual, n * sizeof *l->given);
  memset(l->found, 0, n * sizeof *l->found);
  const zs_fgmres_result result = zs_fgmres_solve(&fgmres, l->given, p->aim, l->found);
  memcpy(l->weights, l->found, n * sizeof *l->weights);
  return result == ZS_FGMRES_DONE || result == ZS_FGMRES_STALLED;
}

static bool solve_level(place *p)
{
  double polynomial[ZS_RBF_MAXIMUM_TERMS];
  const level *l = &p->schwarz->level[p->index];
  return p->index < p->schwarz->levels - 1
           ? iterate(p)
           : zs_dense_solve(&p->schwarz->dense, l->residual, l->weights, polynomial) ==
               ZS_DENSE_DONE;
}

bool zs_schwarz_apply(zs_schwarz *schwarz, const double *r, double *z)
{
  level *first = &schwarz->level[0];
  memcpy(first->residual, r, first->system.count * sizeof *r);
  if (!sweep(&(place){.schwarz = schwarz}))
    return false;
  memcpy(z, first->weights, first->system.count * sizeof *z);
  return true;
}

double zs_schwarz_bytes(const zs_rbf_system *system)
{
  double bytes = (double)system->threads * sizeof(scratch), n = (double)system->count;
  do {
    const double leaves = 2 * n / INNER + 1, here = n;
    bytes += leaves * (sizeof(leaf) + sizeof(zs_rbf_cluster *) + MOST * sizeof(uint32_t)) +
             n * MOST * sizeof(float) +
             n * sizeof(double) * (2 * system->terms + system->dimension + 5) +
             n / ZS_SCHWARZ_CLUSTER * 4 * sizeof(zs_rbf_cluster);
    /* Clusters are halves of halves: their number is a power of two. */
    n = (double)room_for((size_t)exp2(ceil(log2(n / (double)coarsening((size_t)n)))));
    if (has_many_pairs(here, n)) /* each side is one of two */
      bytes += zs_fast_bytes((size_t)(here + n) / 2, system->dimension);
    if (n > LAST) {
      zs_rbf_system middle = *system;
      middle.count = (size_t)n;
      bytes += zs_fgmres_bytes(middle.count) + zs_adaptive_bytes(&middle);
    }
  } while (n > LAST);
  return bytes + zs_dense_bytes((size_t)n, system->terms);
}
