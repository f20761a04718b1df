#include "rbf/schwarz.h"

#include "base/memory.h"
#include "rbf/adaptive.h"
#include "rbf/fgmres.h"
#include "rbf/leaf.h"
#include "rbf/product.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
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

typedef struct level {
  zs_rbf_system system;
  zs_rbf_clusters *own; /* what the points belong to; NULL on the first level */
  const zs_rbf_clusters *clusters;
  zs_leaves leaves;
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
static zs_rbf_result make_batch(level *l, const zs_rbf_cluster *const *list, size_t first,
                                size_t last)
{
  zs_rbf_result worst = ZS_RBF_DONE;
#pragma omp parallel num_threads(l->system.threads) reduction(max : worst)
  {
    zs_leaf_maker *maker = zs_leaf_maker_new();
#pragma omp for schedule(dynamic, 1)
    for (size_t i = first; i < last; i++) {
      const zs_rbf_result result =
        !maker ? ZS_RBF_MEMORY
        : zs_leaf_make(&l->leaves.list[i], &l->system, l->clusters, list[i], maker)
          ? ZS_RBF_DONE
          : ZS_RBF_SINGULAR;
      worst = result > worst ? result : worst;
    }
    free(maker);
  }
  return worst;
}

static zs_rbf_result make_leaves(level *l, poll *p)
{
  const size_t count = zs_rbf_clusters_cut(l->clusters, ZS_LEAF_POINTS, NULL);
  const zs_rbf_cluster **list = malloc(count * sizeof *list);
  if (list)
    zs_rbf_clusters_cut(l->clusters, ZS_LEAF_POINTS, list);
  zs_rbf_result result = list && zs_leaves_begin(&l->leaves, &l->system, list, count)
                           ? ZS_RBF_DONE
                           : ZS_RBF_MEMORY;
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

static void solve_leaves(const level *l)
{
#pragma omp parallel for schedule(static) num_threads(l->system.threads)
  for (size_t i = 0; i < l->leaves.count; i++)
    zs_leaf_solve(&l->leaves.list[i], l->residual, l->weights);
  zs_rbf_system_project(&l->span, l->weights);
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
    schwarz->matrix = zs_memory_new(n * n, sizeof *schwarz->matrix);
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
    p.all += 2 * n / ZS_LEAF_POINTS + 2;
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
    zs_leaves_clear(&l->leaves);
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
  double bytes = system->threads * zs_leaf_maker_bytes(), n = (double)system->count;
  do {
    const double leaves = 2 * n / ZS_LEAF_POINTS + 1, here = n;
    bytes += zs_leaf_bytes(leaves, n) + leaves * sizeof(zs_rbf_cluster *) +
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
