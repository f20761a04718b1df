#include "rbf/clusters.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Building -------------------------------------------------------------------- */

/* Points being cut, given and in order so far. */
typedef struct cutter {
  zs_rbf_clusters *all;
  const double *given;
  size_t most;
} cutter;

static double coordinate(const cutter *c, size_t place, unsigned axis)
{
  return c->given[(size_t)c->all->order[place] * c->all->dimension + axis];
}

static void swap(uint32_t *order, size_t i, size_t j)
{
  const uint32_t kept = order[i];
  order[i] = order[j];
  order[j] = kept;
}

/* Order first .. last such that what is before `middle` is no greater along the
 * axis than what is not (Hoare's selection). */
static void select_median(const cutter *c, size_t first, size_t last, size_t middle, unsigned axis)
{
  while (first < last) {
    const double pivot = coordinate(c, first + (last - first) / 2, axis);
    size_t i = first, j = last;
    for (;;) {
      while (coordinate(c, i, axis) < pivot)
        i++;
      while (coordinate(c, j, axis) > pivot)
        j--;
      if (i >= j)
        break;
      swap(c->all->order, i++, j--);
    }
    /* first .. j <= pivot <= j + 1 .. last */
    if (middle <= j)
      last = j;
    else
      first = j + 1;
  }
}

static unsigned longest_side(const zs_rbf_cluster *cluster, unsigned dimension)
{
  unsigned longest = 0;
  for (unsigned k = 1; k < dimension; k++)
    if (cluster->hi[k] - cluster->lo[k] > cluster->hi[longest] - cluster->lo[longest])
      longest = k;
  return longest;
}

static void enclose(const cutter *c, zs_rbf_cluster *cluster)
{
  for (unsigned k = 0; k < c->all->dimension; k++) {
    cluster->lo[k] = INFINITY;
    cluster->hi[k] = -INFINITY;
    for (size_t i = cluster->first; i < cluster->first + cluster->count; i++) {
      cluster->lo[k] = fmin(cluster->lo[k], coordinate(c, i, k));
      cluster->hi[k] = fmax(cluster->hi[k], coordinate(c, i, k));
    }
  }
}

static void cut(const cutter *c, size_t index)
{
  zs_rbf_cluster *cluster = &c->all->clusters[index];
  enclose(c, cluster);
  if (cluster->count <= c->most)
    return;
  const size_t half = cluster->count / 2, first = cluster->first;
  select_median(c, first, first + cluster->count - 1, first + half,
                longest_side(cluster, c->all->dimension));
  const size_t children = c->all->cluster_count;
  cluster->children = (uint32_t)children;
  c->all->cluster_count += 2;
  c->all->clusters[children] = (zs_rbf_cluster){.first = first, .count = half};
  c->all->clusters[children + 1] =
    (zs_rbf_cluster){.first = first + half, .count = cluster->count - half};
  cut(c, children);
  cut(c, children + 1);
}

/* How many clusters there can be: halves differ by one point at most, so those
 * that are not cut have more than half of `most`. */
static size_t most_clusters(size_t count, size_t most)
{
  return most > 1 ? 4 * (count / most) + 3 : 2 * count;
}

zs_rbf_clusters *zs_rbf_clusters_new(const double *points, size_t count, unsigned dimension,
                                     size_t most)
{
  zs_rbf_clusters *all = calloc(1, sizeof *all);
  if (!all)
    return NULL;
  all->dimension = dimension;
  all->count = count;
  all->points = malloc(count * dimension * sizeof *all->points);
  all->order = malloc(count * sizeof *all->order);
  all->clusters = malloc(most_clusters(count, most) * sizeof *all->clusters);
  if (!all->points || !all->order || !all->clusters) {
    zs_rbf_clusters_free(all);
    return NULL;
  }
  for (size_t i = 0; i < count; i++)
    all->order[i] = (uint32_t)i;
  all->clusters[0] = (zs_rbf_cluster){.count = count};
  all->cluster_count = 1;
  cut(&(cutter){all, points, most}, 0);
  for (size_t i = 0; i < count; i++)
    memcpy(all->points + i * dimension, points + (size_t)all->order[i] * dimension,
           dimension * sizeof *points);
  return all;
}

void zs_rbf_clusters_free(zs_rbf_clusters *clusters)
{
  if (!clusters)
    return;
  free(clusters->points);
  free(clusters->order);
  free(clusters->clusters);
  free(clusters);
}

/* ---- Asking ---------------------------------------------------------------------- */

/* The nearest points so far, the farthest of them first (a heap). */
typedef struct nearest {
  const zs_rbf_clusters *all;
  const zs_rbf_cluster *without, *from;
  size_t count, most;
  zs_rbf_neighbour *heap;
} nearest;

/* The squared distance of a box from the cluster's own. */
static double gap_squared(const nearest *n, const double *lo, const double *hi)
{
  double sum = 0;
  for (unsigned k = 0; k < n->all->dimension; k++) {
    const double gap = fmax(fmax(n->from->lo[k] - hi[k], lo[k] - n->from->hi[k]), 0);
    sum += gap * gap;
  }
  return sum;
}

static void add_to_heap(nearest *n, zs_rbf_neighbour added)
{
  size_t place = n->count++;
  for (; place && n->heap[(place - 1) / 2].square < added.square; place = (place - 1) / 2)
    n->heap[place] = n->heap[(place - 1) / 2];
  n->heap[place] = added;
}

static void replace_farthest(nearest *n, zs_rbf_neighbour added)
{
  size_t place = 0;
  for (size_t child; (child = 2 * place + 1) < n->count; place = child) {
    if (child + 1 < n->count && n->heap[child + 1].square > n->heap[child].square)
      child++;
    if (added.square >= n->heap[child].square)
      break;
    n->heap[place] = n->heap[child];
  }
  n->heap[place] = added;
}

static void consider(nearest *n, uint32_t point)
{
  const double *p = n->all->points + (size_t)point * n->all->dimension;
  const zs_rbf_neighbour added = {gap_squared(n, p, p), point};
  if (n->count < n->most)
    add_to_heap(n, added);
  else if (added.square < n->heap[0].square)
    replace_farthest(n, added);
}

static void search(nearest *n, const zs_rbf_cluster *cluster)
{
  if (cluster == n->without)
    return;
  if (n->count == n->most && gap_squared(n, cluster->lo, cluster->hi) >= n->heap[0].square)
    return;
  if (!cluster->children) {
    for (size_t i = 0; i < cluster->count; i++)
      consider(n, (uint32_t)(cluster->first + i));
    return;
  }
  /* First the half that the cluster is in, or that is nearer. */
  const zs_rbf_cluster *half = &n->all->clusters[cluster->children];
  const bool second =
    gap_squared(n, half[1].lo, half[1].hi) < gap_squared(n, half[0].lo, half[0].hi);
  search(n, &half[second]);
  search(n, &half[!second]);
}

size_t zs_rbf_clusters_around(const zs_rbf_clusters *clusters, const zs_rbf_cluster *cluster,
                              const zs_rbf_cluster *part, size_t count, zs_rbf_neighbour *around)
{
  nearest n = {
    .all = clusters, .without = cluster, .from = part, .most = count, .heap = around};
  if (count)
    search(&n, &clusters->clusters[0]);
  return n.count;
}

static size_t list_cut(const zs_rbf_clusters *all, const zs_rbf_cluster *cluster, size_t most,
                       const zs_rbf_cluster **list, size_t count)
{
  if (cluster->count <= most || !cluster->children) {
    if (list)
      list[count] = cluster;
    return count + 1;
  }
  count = list_cut(all, &all->clusters[cluster->children], most, list, count);
  return list_cut(all, &all->clusters[cluster->children + 1], most, list, count);
}

size_t zs_rbf_clusters_cut(const zs_rbf_clusters *clusters, size_t most,
                           const zs_rbf_cluster **list)
{
  return list_cut(clusters, &clusters->clusters[0], most, list, 0);
}

size_t zs_rbf_clusters_parts(const zs_rbf_clusters *clusters, const zs_rbf_cluster *cluster,
                             const zs_rbf_cluster **list)
{
  return list_cut(clusters, cluster, 1, list, 0);
}
