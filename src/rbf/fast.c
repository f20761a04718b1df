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

/* A product is added up in so many shares, whatever the threads are. */
enum { SHARES = 16 };

/* A cluster as a side of products. */
typedef struct part {
  double middle[ZS_RBF_MAXIMUM_DIMENSION], radius;
  zs_nodes nodes;
  size_t node_count; /* 0: its points stand for themselves */
  size_t first_node; /* among those of all parts */
} part;

/* One side of products. */
typedef struct side {
  const zs_rbf_clusters *clusters;
  part *parts; /* one per cluster */
  size_t node_count;
  double *nodes; /* coordinates */
} side;

/* Two clusters, one of the targets and one of the sources. */
typedef struct pair {
  uint32_t target, source;
} pair;

/* Where both sides are the same points, each pair of clusters is there once and phi of their
 * points is found once for both. */
struct zs_fast {
  zs_rbf_radial radial;
  unsigned order, threads;
  bool symmetric;
  side own[2]; /* the second is not used when both are the same */
  const side *targets, *sources;
  double *weights; /* of the sources' nodes */
  double *sums;    /* by share: of the targets' nodes, then of the targets */
  pair *pairs;
  size_t pair_count, pair_capacity;
  size_t shares[SHARES + 1]; /* the first pair of each */
  double terms; /* that a product adds up */
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
  if (!s->nodes)
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
}

/* ---- Pairs --------------------------------------------------------------------------- */

/* Numbers that stand for a cluster. */
static size_t size_of(const side *s, uint32_t index)
{
  const size_t nodes = s->parts[index].node_count;
  return nodes ? nodes : s->clusters->clusters[index].count;
}

static double terms_of(const zs_fast *fast, const pair *p)
{
  return (double)size_of(fast->targets, p->target) * (double)size_of(fast->sources, p->source);
}

static void add_pair(zs_fast *fast, uint32_t target, uint32_t source)
{
  pair *pairs =
    zs_array_grown(fast->pairs, fast->pair_count + 1, &fast->pair_capacity, sizeof *pairs);
  if (!pairs) {
    fast->failed = true;
    return;
  }
  fast->pairs = pairs;
  pairs[fast->pair_count] = (pair){target, source};
  fast->terms += terms_of(fast, &pairs[fast->pair_count++]);
}

static bool is_far(const zs_fast *fast, const part *a, const part *b)
{
  double square = 0;
  for (unsigned k = 0; k < fast->targets->clusters->dimension; k++)
    square += (a->middle[k] - b->middle[k]) * (a->middle[k] - b->middle[k]);
  const double radii = a->radius + b->radius;
  return radii * radii < FAR * FAR * square;
}

/* Find what adds up to the part of one cluster in another. */
static void pair_up(zs_fast *fast, uint32_t target, uint32_t source)
{
  const zs_rbf_cluster *a = &fast->targets->clusters->clusters[target];
  const zs_rbf_cluster *b = &fast->sources->clusters->clusters[source];
  const part *a_part = &fast->targets->parts[target], *b_part = &fast->sources->parts[source];
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

/* The same for a cluster in itself. */
static void pair_with_itself(zs_fast *fast, uint32_t index)
{
  const zs_rbf_cluster *cluster = &fast->targets->clusters->clusters[index];
  if (!is_divisible(cluster)) {
    add_pair(fast, index, index);
    return;
  }
  for (uint32_t i = 0; i < 2; i++)
    pair_with_itself(fast, cluster->children + i);
  pair_up(fast, cluster->children, cluster->children + 1);
}

/* Shares of about as many terms. */
static void share_out(zs_fast *fast)
{
  double terms = 0;
  size_t share = 0;
  for (size_t i = 0; i < fast->pair_count; i++) {
    while (share < SHARES && terms >= fast->terms * (double)share / SHARES)
      fast->shares[share++] = i;
    terms += terms_of(fast, &fast->pairs[i]);
  }
  while (share <= SHARES)
    fast->shares[share++] = fast->pair_count;
}

/* Numbers of a share. */
static size_t share_size(const zs_fast *fast)
{
  return fast->targets->node_count + fast->targets->clusters->count;
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
  fast->symmetric = targets == sources;
  fast->targets = &fast->own[0];
  fast->sources = &fast->own[fast->symmetric ? 0 : 1];
  fast->failed = !make_side(&fast->own[0], targets, order) ||
                 (!fast->symmetric && !make_side(&fast->own[1], sources, order));
  if (!fast->failed) {
    fast->weights = malloc((fast->sources->node_count + 1) * sizeof *fast->weights);
    fast->sums = malloc(SHARES * share_size(fast) * sizeof *fast->sums);
    fast->failed = !fast->weights || !fast->sums;
  }
  if (!fast->failed && fast->symmetric)
    pair_with_itself(fast, 0);
  else if (!fast->failed)
    pair_up(fast, 0, 0);
  if (!fast->failed) {
    share_out(fast);
    return fast;
  }
  zs_fast_free(fast);
  return NULL;
}

void zs_fast_free(zs_fast *fast)
{
  if (!fast)
    return;
  free(fast->pairs);
  free(fast->weights);
  free(fast->sums);
  for (int k = 0; k < 2; k++)
    free_side(&fast->own[k]);
  free(fast);
}

double zs_fast_bytes(size_t n, unsigned dimension)
{
  /* There is a part for some points, and up to two nodes for each point on all levels together;
   * there are fewer pairs of clusters than points. */
  const double parts = 4.0 * (double)n / DIRECT * 16, nodes = 2 * (double)n;
  return parts * sizeof(part) + nodes * (dimension + 1) * sizeof(double) +
         SHARES * (nodes + (double)n) * sizeof(double) +
         (double)n * (sizeof(pair) + sizeof(double));
}

double zs_fast_pairs(const zs_fast *fast)
{
  return fast->terms;
}

bool zs_fast_is_worthwhile(const zs_fast *fast)
{
  /* Pairs of clusters cost more than pairs of points in long rows. */
  static const double WORTHWHILE = 0.6;
  const double all =
    (double)fast->targets->clusters->count * (double)fast->sources->clusters->count;
  return fast->terms <= WORTHWHILE * (fast->symmetric ? all / 2 : all);
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
static void collect(const side *s, uint32_t index, const double *weights, double *node_weights,
                    size_t above)
{
  const zs_rbf_cluster *cluster = &s->clusters->clusters[index];
  const part *p = &s->parts[index];
  const unsigned dimension = s->clusters->dimension;
  if (!p->node_count || cluster->count <= above)
    return;
  double *values = node_weights + p->first_node;
  memset(values, 0, p->node_count * sizeof *values);
  for (uint32_t i = cluster->children; i < cluster->children + 2; i++) {
    const part *child = &s->parts[i];
    const zs_rbf_cluster *half = &s->clusters->clusters[i];
    collect(s, i, weights, node_weights, above);
    if (child->node_count && zs_nodes_match(&p->nodes, &child->nodes))
      zs_nodes_select()->collect_grid(&p->nodes, values, &child->nodes,
                                      node_weights + child->first_node);
    else if (child->node_count)
      zs_nodes_select()->collect(&p->nodes, values, s->nodes + child->first_node * dimension,
                                 child->node_count, node_weights + child->first_node);
    else
      zs_nodes_select()->collect(&p->nodes, values, s->clusters->points + half->first * dimension,
                                 half->count, weights + half->first);
  }
}

/* Add to the sums of a branch what was summed at nodes, from its root down to
 * clusters of at most `down_to` points. */
static void interpolate(const side *s, uint32_t index, double *node_sums, double *sums,
                        size_t down_to)
{
  const zs_rbf_cluster *cluster = &s->clusters->clusters[index];
  const part *p = &s->parts[index];
  const unsigned dimension = s->clusters->dimension;
  if (!p->node_count || cluster->count <= down_to)
    return;
  const double *values = node_sums + p->first_node;
  for (uint32_t i = cluster->children; i < cluster->children + 2; i++) {
    const part *child = &s->parts[i];
    const zs_rbf_cluster *half = &s->clusters->clusters[i];
    if (child->node_count && zs_nodes_match(&p->nodes, &child->nodes))
      zs_nodes_select()->interpolate_grid(&p->nodes, values, &child->nodes,
                                          node_sums + child->first_node);
    else if (child->node_count)
      zs_nodes_select()->interpolate(&p->nodes, values, s->nodes + child->first_node * dimension,
                                     child->node_count, node_sums + child->first_node);
    else
      zs_nodes_select()->interpolate(&p->nodes, values,
                                     s->clusters->points + half->first * dimension, half->count,
                                     sums + half->first);
    interpolate(s, i, node_sums, sums, down_to);
  }
}

/* A cluster as a side of a product: what stands for it, and where its numbers are. */
typedef struct operand {
  size_t count;
  const double *points, *weights;
  double *sums;
} operand;

static operand operand_of(const side *s, uint32_t index, const double *node_weights,
                          const double *weights, double *node_sums, double *sums)
{
  const part *p = &s->parts[index];
  const unsigned dimension = s->clusters->dimension;
  const size_t first = p->node_count ? p->first_node : s->clusters->clusters[index].first;
  return (operand){size_of(s, index),
                   (p->node_count ? s->nodes : s->clusters->points) + first * dimension,
                   (p->node_count ? node_weights : weights) + first,
                   (p->node_count ? node_sums : sums) + first};
}

/* Add up a share of the pairs in sums of its own. */
static void run_share(const zs_fast *fast, size_t share, const double *weights)
{
  double *node_sums = fast->sums + share * share_size(fast);
  double *sums = node_sums + fast->targets->node_count;
  zs_rbf_multiply_kernel *multiply = zs_rbf_multiply_select();
  memset(node_sums, 0, share_size(fast) * sizeof *node_sums);
  for (size_t i = fast->shares[share]; i < fast->shares[share + 1]; i++) {
    const pair *p = &fast->pairs[i];
    const operand a =
      operand_of(fast->targets, p->target, fast->weights, weights, node_sums, sums);
    const operand b =
      operand_of(fast->sources, p->source, fast->weights, weights, node_sums, sums);
    const bool both = fast->symmetric && p->target != p->source;
    multiply(&(zs_rbf_product){.radial = fast->radial,
                               .dimension = fast->targets->clusters->dimension,
                               .target_count = a.count,
                               .source_count = b.count,
                               .targets = a.points,
                               .sources = b.points,
                               .weights = b.weights,
                               .sums = a.sums,
                               .target_weights = both ? a.weights : NULL,
                               .source_sums = both ? b.sums : NULL});
  }
}

/* Put the shares together: those of nodes in the first one's place, those of points to `sums`. */
static void add_shares(const zs_fast *fast, double *sums)
{
  const size_t size = share_size(fast), nodes = fast->targets->node_count;
#pragma omp parallel for schedule(static) num_threads(fast->threads)
  for (size_t i = 0; i < size; i++) {
    double sum = 0;
    for (size_t share = 0; share < SHARES; share++)
      sum += fast->sums[share * size + i];
    if (i < nodes)
      fast->sums[i] = sum;
    else
      sums[i - nodes] += sum;
  }
}

bool zs_fast_multiply(zs_fast *fast, const double *weights, double *sums)
{
  const side *t = fast->targets, *s = fast->sources;
  branches to = {.count = 0}, from = {.count = 0};
  const bool ready = make_branches(t, &to) && make_branches(s, &from);
  if (ready) {
#pragma omp parallel for schedule(dynamic, 1) num_threads(fast->threads)
    for (size_t i = 0; i < from.count; i++)
      collect(s, index_of(s, from.list[i]), weights, fast->weights, 0);
    collect(s, 0, weights, fast->weights, from.most);
#pragma omp parallel for schedule(dynamic, 1) num_threads(fast->threads)
    for (size_t share = 0; share < SHARES; share++)
      run_share(fast, share, weights);
    add_shares(fast, sums);
    interpolate(t, 0, fast->sums, sums, to.most);
#pragma omp parallel for schedule(dynamic, 1) num_threads(fast->threads)
    for (size_t i = 0; i < to.count; i++)
      interpolate(t, index_of(t, to.list[i]), fast->sums, sums, 0);
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
  double *sums = calloc(fast->targets->clusters->count, sizeof *sums), error = INFINITY;
  if (sums && zs_fast_multiply(fast, weights, sums))
    error = compare(s, sums).mean;
  free(sums);
  return error;
}

zs_fast_errors zs_fast_compare(const zs_fast *fast, const double *weights, const double *sums)
{
  sample s = {.exact = NULL};
  zs_fast_errors e = {INFINITY, INFINITY};
  if (make_sample(&s, fast->radial, fast->targets->clusters, fast->sources->clusters, weights,
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
