#include "rbf/fast.h"

#include "base/array.h"
#include "rbf/nodes.h"
#include "rbf/product.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Two clusters are far from each other when their radii add up to less than this
 * part of the distance of their middles. */
static const double FAR = 0.85;
/* Where a cluster's points are seen from, at least, by half its longest side:
 * what decides how many nodes its shorter sides need. */
static const double NEAREST = 4;

_Static_assert((int)ZS_FAST_MOST_ORDER <= (int)ZS_NODES_MOST, "grids have room for the nodes");

enum { DIRECT = 128 }; /* points that are not divided further when near others */

/* A cluster as a side of products. */
typedef struct part {
  double middle[ZS_RBF_MAXIMUM_DIMENSION], radius;
  zs_nodes nodes;
  size_t node_count; /* 0: its points stand for themselves */
  size_t first_node; /* among those of all parts */
  uint32_t job;      /* of targets: where its sums belong */
} part;

/* One side of products. */
typedef struct side {
  const zs_rbf_clusters *clusters;
  part *parts; /* one per cluster */
  size_t node_count;
  double *nodes, *values; /* coordinates; weights of sources, sums of targets */
} side;

/* Sources for a cluster of targets. */
typedef struct pair {
  uint32_t target, source;
} pair;

/* Everything that is added to the same sums, by one thread: those of a cluster's
 * nodes, or of a whole branch of clusters whose points stand for themselves. */
typedef struct job {
  pair *pairs;
  size_t count, capacity;
} job;

struct zs_fast {
  zs_rbf_radial radial;
  unsigned order, threads;
  side targets, sources;
  job *jobs;
  size_t job_count;
  double pair_count;
  bool failed; /* memory was out */
};

/* ---- Sides -------------------------------------------------------------------------- */

/* How fast errors fall with nodes along a side: Bernstein's ellipse through
 * what is `distance` from the middle of an interval of half length 1. */
static double rate(double distance)
{
  return log(distance + sqrt(distance * distance - 1));
}

/* Whether a cluster is to be divided rather than summed point by point. */
static bool is_divisible(const zs_rbf_cluster *cluster)
{
  return cluster->children && cluster->count > DIRECT;
}

static void place_nodes(const zs_rbf_cluster *cluster, unsigned dimension, unsigned order,
                        zs_nodes *nodes)
{
  double longest = 0;
  *nodes = (zs_nodes){.dimension = dimension};
  for (unsigned k = 0; k < dimension; k++)
    longest = fmax(longest, cluster->hi[k] - cluster->lo[k]);
  for (unsigned k = 0; k < dimension; k++) {
    const double length = cluster->hi[k] - cluster->lo[k];
    nodes->lo[k] = cluster->lo[k];
    nodes->hi[k] = cluster->hi[k];
    nodes->side[k] = length > 0 ? (unsigned)ceil(order * rate(NEAREST) /
                                                 rate(NEAREST * longest / length) - 1e-9)
                                : 1;
  }
}

static void make_part(side *s, size_t index, unsigned order, bool nodes)
{
  const zs_rbf_cluster *cluster = &s->clusters->clusters[index];
  part *p = &s->parts[index];
  double square = 0;
  for (unsigned k = 0; k < s->clusters->dimension; k++) {
    const double half = 0.5 * (cluster->hi[k] - cluster->lo[k]);
    p->middle[k] = cluster->lo[k] + half;
    square += half * half;
  }
  p->radius = sqrt(square);
  place_nodes(cluster, s->clusters->dimension, order, &p->nodes);
  const size_t count = zs_nodes_count(&p->nodes);
  if (nodes && count < cluster->count && is_divisible(cluster)) {
    p->node_count = count;
    p->first_node = s->node_count;
    s->node_count += count;
  }
}

/* The parts of a branch; below one that has no nodes, none has. */
static void make_parts(side *s, size_t index, unsigned order, bool nodes)
{
  const uint32_t children = s->clusters->clusters[index].children;
  make_part(s, index, order, nodes);
  for (uint32_t i = 0; children && i < 2; i++)
    make_parts(s, children + i, order, s->parts[index].node_count > 0);
}

static bool make_side(side *s, const zs_rbf_clusters *clusters, unsigned order)
{
  s->clusters = clusters;
  s->parts = calloc(clusters->cluster_count, sizeof *s->parts);
  if (!s->parts)
    return false;
  make_parts(s, 0, order, true);
  s->nodes = malloc((s->node_count * clusters->dimension + 1) * sizeof *s->nodes);
  s->values = malloc((s->node_count + 1) * sizeof *s->values);
  if (!s->nodes || !s->values)
    return false;
  for (size_t i = 0; i < clusters->cluster_count; i++)
    if (s->parts[i].node_count)
      zs_nodes_points(&s->parts[i].nodes, s->nodes + s->parts[i].first_node * clusters->dimension);
  return true;
}

static void free_side(side *s)
{
  free(s->parts);
  free(s->nodes);
  free(s->values);
}

/* ---- Pairs --------------------------------------------------------------------------- */

/* Numbers that stand for a cluster. */
static size_t size_of(const side *s, uint32_t index)
{
  const size_t nodes = s->parts[index].node_count;
  return nodes ? nodes : s->clusters->clusters[index].count;
}

static void add_pair(zs_fast *fast, uint32_t target, uint32_t source)
{
  job *j = &fast->jobs[fast->targets.parts[target].job];
  pair *pairs = zs_array_grown(j->pairs, j->count + 1, &j->capacity, sizeof *pairs);
  if (!pairs) {
    fast->failed = true;
    return;
  }
  j->pairs = pairs;
  pairs[j->count++] = (pair){target, source};
  fast->pair_count += (double)size_of(&fast->targets, target) *
                      (double)size_of(&fast->sources, source);
}

static bool is_far(const zs_fast *fast, const part *a, const part *b)
{
  double square = 0;
  for (unsigned k = 0; k < fast->targets.clusters->dimension; k++)
    square += (a->middle[k] - b->middle[k]) * (a->middle[k] - b->middle[k]);
  const double radii = a->radius + b->radius;
  return radii * radii < FAR * FAR * square;
}

/* Find what adds up to the part of one cluster in another. */
static void pair_up(zs_fast *fast, uint32_t target, uint32_t source)
{
  const zs_rbf_cluster *a = &fast->targets.clusters->clusters[target];
  const zs_rbf_cluster *b = &fast->sources.clusters->clusters[source];
  const part *a_part = &fast->targets.parts[target], *b_part = &fast->sources.parts[source];
  if (is_far(fast, a_part, b_part) || (!is_divisible(a) && !is_divisible(b))) {
    add_pair(fast, target, source);
    return;
  }
  const bool divide_target =
    is_divisible(a) && (!is_divisible(b) || a_part->radius >= b_part->radius);
  for (uint32_t i = 0; i < 2; i++) {
    if (divide_target)
      pair_up(fast, a->children + i, source);
    else
      pair_up(fast, target, b->children + i);
  }
}

/* Number the jobs. */
static void assign_jobs(zs_fast *fast, uint32_t index, uint32_t job)
{
  part *p = &fast->targets.parts[index];
  const uint32_t children = fast->targets.clusters->clusters[index].children;
  p->job = job;
  for (uint32_t i = 0; children && i < 2; i++)
    assign_jobs(fast, children + i, p->node_count ? (uint32_t)fast->job_count++ : job);
}

zs_fast *zs_fast_new(zs_rbf_radial radial, const zs_rbf_clusters *targets,
                     const zs_rbf_clusters *sources, unsigned order, unsigned threads)
{
  zs_fast *fast = calloc(1, sizeof *fast);
  if (!fast)
    return NULL;
  fast->radial = radial;
  fast->order = order;
  fast->threads = threads;
  fast->failed =
    !make_side(&fast->targets, targets, order) || !make_side(&fast->sources, sources, order);
  if (!fast->failed) {
    fast->job_count = 1;
    assign_jobs(fast, 0, 0);
    fast->jobs = calloc(fast->job_count, sizeof *fast->jobs);
    fast->failed = !fast->jobs;
  }
  if (!fast->failed)
    pair_up(fast, 0, 0);
  if (!fast->failed)
    return fast;
  zs_fast_free(fast);
  return NULL;
}

void zs_fast_free(zs_fast *fast)
{
  if (!fast)
    return;
  for (size_t i = 0; fast->jobs && i < fast->job_count; i++)
    free(fast->jobs[i].pairs);
  free(fast->jobs);
  free_side(&fast->targets);
  free_side(&fast->sources);
  free(fast);
}

double zs_fast_bytes(size_t n, unsigned dimension)
{
  /* Both sides have one part for some points, and up to two nodes for each point
   * on all levels together; there are fewer pairs of clusters than points. */
  const double parts = 4.0 * (double)n / DIRECT * 16;
  return 2 * (parts * sizeof(part) + 2 * (double)n * (dimension + 1) * sizeof(double)) +
         (double)n * (sizeof(pair) + sizeof(double));
}

double zs_fast_pairs(const zs_fast *fast)
{
  return fast->pair_count;
}

bool zs_fast_is_worthwhile(const zs_fast *fast)
{
  /* Pairs of clusters cost more than pairs of points in long rows. */
  static const double WORTHWHILE = 0.6;
  return fast->pair_count <= WORTHWHILE * (double)fast->targets.clusters->count *
                               (double)fast->sources.clusters->count;
}

/* ---- Products ------------------------------------------------------------------------- */

/* Branches of a tree for threads to take, and the clusters above them. */
typedef struct branches {
  const zs_rbf_cluster **list;
  size_t count, most; /* points of a branch */
} branches;

static uint32_t index_of(const side *s, const zs_rbf_cluster *cluster)
{
  return (uint32_t)(cluster - s->clusters->clusters);
}

static bool make_branches(const side *s, branches *b)
{
  enum { BRANCHES = 64 };
  b->most = s->clusters->count / BRANCHES + 1;
  b->list = malloc(zs_rbf_clusters_cut(s->clusters, b->most, NULL) * sizeof *b->list);
  b->count = b->list ? zs_rbf_clusters_cut(s->clusters, b->most, b->list) : 0;
  return b->list;
}

/* Replace the sources of a branch by weights at nodes, from its ends up to
 * clusters of more than `above` points. */
static void collect(const side *s, uint32_t index, const double *weights, size_t above)
{
  const zs_rbf_cluster *cluster = &s->clusters->clusters[index];
  const part *p = &s->parts[index];
  const unsigned dimension = s->clusters->dimension;
  if (!p->node_count || cluster->count <= above)
    return;
  double *values = s->values + p->first_node;
  memset(values, 0, p->node_count * sizeof *values);
  for (uint32_t i = cluster->children; i < cluster->children + 2; i++) {
    const part *child = &s->parts[i];
    const zs_rbf_cluster *half = &s->clusters->clusters[i];
    collect(s, i, weights, above);
    if (child->node_count)
      zs_nodes_select()->collect(&p->nodes, values, s->nodes + child->first_node * dimension,
                                 child->node_count, s->values + child->first_node);
    else
      zs_nodes_select()->collect(&p->nodes, values, s->clusters->points + half->first * dimension,
                                 half->count, weights + half->first);
  }
}

/* Add to the sums of a branch what was summed at nodes, from its root down to
 * clusters of at most `down_to` points. */
static void interpolate(const side *s, uint32_t index, double *sums, size_t down_to)
{
  const zs_rbf_cluster *cluster = &s->clusters->clusters[index];
  const part *p = &s->parts[index];
  const unsigned dimension = s->clusters->dimension;
  if (!p->node_count || cluster->count <= down_to)
    return;
  const double *values = s->values + p->first_node;
  for (uint32_t i = cluster->children; i < cluster->children + 2; i++) {
    const part *child = &s->parts[i];
    const zs_rbf_cluster *half = &s->clusters->clusters[i];
    if (child->node_count)
      zs_nodes_select()->interpolate(&p->nodes, values, s->nodes + child->first_node * dimension,
                                     child->node_count, s->values + child->first_node);
    else
      zs_nodes_select()->interpolate(&p->nodes, values,
                                     s->clusters->points + half->first * dimension, half->count,
                                     sums + half->first);
    interpolate(s, i, sums, down_to);
  }
}

static void run_job(const zs_fast *fast, const job *j, const double *weights, double *sums)
{
  const side *t = &fast->targets, *s = &fast->sources;
  const unsigned dimension = t->clusters->dimension;
  zs_rbf_multiply_kernel *multiply = zs_rbf_multiply_select();
  for (size_t i = 0; i < j->count; i++) {
    const uint32_t target = j->pairs[i].target, source = j->pairs[i].source;
    const part *a = &t->parts[target], *b = &s->parts[source];
    const size_t to = t->clusters->clusters[target].first;
    const size_t from = s->clusters->clusters[source].first;
    multiply(&(zs_rbf_product){
      .radial = fast->radial,
      .dimension = dimension,
      .target_count = size_of(t, target),
      .source_count = size_of(s, source),
      .targets = a->node_count ? t->nodes + a->first_node * dimension
                               : t->clusters->points + to * dimension,
      .sources = b->node_count ? s->nodes + b->first_node * dimension
                               : s->clusters->points + from * dimension,
      .weights = b->node_count ? s->values + b->first_node : weights + from,
      .sums = a->node_count ? t->values + a->first_node : sums + to});
  }
}

bool zs_fast_multiply(zs_fast *fast, const double *weights, double *sums)
{
  side *t = &fast->targets, *s = &fast->sources;
  branches to = {.count = 0}, from = {.count = 0};
  const bool ready = make_branches(t, &to) && make_branches(s, &from);
  if (ready) {
#pragma omp parallel for schedule(dynamic, 1) num_threads(fast->threads)
    for (size_t i = 0; i < from.count; i++)
      collect(s, index_of(s, from.list[i]), weights, 0);
    collect(s, 0, weights, from.most);
    memset(t->values, 0, t->node_count * sizeof *t->values);
#pragma omp parallel for schedule(dynamic, 1) num_threads(fast->threads)
    for (size_t i = 0; i < fast->job_count; i++)
      run_job(fast, &fast->jobs[i], weights, sums);
    interpolate(t, 0, sums, to.most);
#pragma omp parallel for schedule(dynamic, 1) num_threads(fast->threads)
    for (size_t i = 0; i < to.count; i++)
      interpolate(t, index_of(t, to.list[i]), sums, 0);
  }
  free(to.list);
  free(from.list);
  return ready;
}

/* ---- Choosing -------------------------------------------------------------------------- */

/* Some targets, and what is added to their sums. */
typedef struct sample {
  size_t count, stride;
  double *exact;
} sample;

static bool make_sample(sample *s, zs_rbf_radial radial, const zs_rbf_clusters *targets,
                        const zs_rbf_clusters *sources, const double *weights, unsigned threads)
{
  enum { MOST = 256 };
  const unsigned dimension = targets->dimension;
  s->stride = targets->count / MOST + 1;
  s->count = (targets->count - 1) / s->stride + 1;
  s->exact = calloc(s->count, sizeof *s->exact);
  double *points = malloc(s->count * dimension * sizeof *points);
  const bool ready = s->exact && points;
  if (ready) {
    for (size_t i = 0; i < s->count; i++)
      memcpy(points + i * dimension, targets->points + i * s->stride * dimension,
             dimension * sizeof *points);
    zs_rbf_multiply(&(zs_rbf_product){.radial = radial,
                                      .dimension = dimension,
                                      .target_count = s->count,
                                      .source_count = sources->count,
                                      .targets = points,
                                      .sources = sources->points,
                                      .weights = weights,
                                      .sums = s->exact},
                    threads);
  }
  free(points);
  return ready;
}

static zs_fast_errors compare(const sample *s, const double *sums)
{
  zs_fast_errors e = {0, 0};
  for (size_t i = 0; i < s->count; i++) {
    const double off = fabs(sums[i * s->stride] - s->exact[i]);
    e.mean += off * off / (double)s->count;
    e.most = off <= e.most ? e.most : off;
  }
  e.mean = sqrt(e.mean);
  return e;
}

static double measure(zs_fast *fast, const sample *s, const double *weights)
{
  double *sums = calloc(fast->targets.clusters->count, sizeof *sums), error = INFINITY;
  if (sums && zs_fast_multiply(fast, weights, sums))
    error = compare(s, sums).mean;
  free(sums);
  return error;
}

zs_fast_errors zs_fast_compare(const zs_fast *fast, const double *weights, const double *sums)
{
  sample s = {.exact = NULL};
  zs_fast_errors e = {INFINITY, INFINITY};
  if (make_sample(&s, fast->radial, fast->targets.clusters, fast->sources.clusters, weights,
                  fast->threads))
    e = compare(&s, sums);
  free(s.exact);
  return e;
}

zs_fast *zs_fast_choose(zs_rbf_radial radial, const zs_rbf_clusters *targets,
                        const zs_rbf_clusters *sources, const double *weights, double accuracy,
                        unsigned threads)
{
  enum { FIRST = 6 }; /* order to try */
  sample s = {.exact = NULL};
  zs_fast *fast = NULL;
  double error = INFINITY;
  bool going = make_sample(&s, radial, targets, sources, weights, threads);
  for (unsigned order = FIRST; going && order <= ZS_FAST_MOST_ORDER;) {
    zs_fast_free(fast);
    fast = zs_fast_new(radial, targets, sources, order, threads);
    going = fast && zs_fast_is_worthwhile(fast);
    error = going ? measure(fast, &s, weights) : INFINITY;
    going = error > accuracy && isfinite(error);
    /* Errors fall about tenfold with each order. */
    if (going)
      order += (unsigned)fmin(ceil(log10(error / accuracy)), ZS_FAST_MOST_ORDER);
  }
  free(s.exact);
  if (error <= accuracy)
    return fast;
  zs_fast_free(fast);
  return NULL;
}
