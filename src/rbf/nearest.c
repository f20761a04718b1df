#include "rbf/nearest.h"

#include <math.h>

static void consider(zs_nearest *n, const double *position, uint32_t point)
{
  double square = 0;
  for (int k = 0; k < 3; k++)
    square += (position[k] - n->from[k]) * (position[k] - n->from[k]);
  if (point == n->except || (n->count == n->most && square >= n->square[n->count - 1]))
    return;
  unsigned i = n->count < n->most ? n->count++ : n->count - 1;
  for (; i > 0 && n->square[i - 1] > square; i--) {
    n->square[i] = n->square[i - 1];
    n->point[i] = n->point[i - 1];
  }
  n->square[i] = square;
  n->point[i] = point;
}

double zs_nearest_gap(const zs_rbf_cluster *cluster, const double from[3])
{
  double square = 0;
  for (int k = 0; k < 3; k++) {
    const double gap = fmax(fmax(cluster->lo[k] - from[k], from[k] - cluster->hi[k]), 0);
    square += gap * gap;
  }
  return square;
}

static void search(zs_nearest *n, const zs_rbf_clusters *tree, const zs_rbf_cluster *cluster)
{
  if (n->count == n->most && zs_nearest_gap(cluster, n->from) >= n->square[n->count - 1])
    return;
  if (cluster->children) {
    const zs_rbf_cluster *a = &tree->clusters[cluster->children], *b = a + 1;
    const bool swap = zs_nearest_gap(b, n->from) < zs_nearest_gap(a, n->from);
    search(n, tree, swap ? b : a);
    search(n, tree, swap ? a : b);
    return;
  }
  for (size_t i = cluster->first; i < cluster->first + cluster->count; i++)
    consider(n, tree->points + 3 * i, tree->order[i]);
}

void zs_nearest_find(zs_nearest *nearest, const zs_rbf_clusters *tree)
{
  nearest->count = 0;
  search(nearest, tree, &tree->clusters[0]);
}
