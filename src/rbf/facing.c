#include "rbf/facing.h"

#include "base/vector3.h"
#include "rbf/nearest.h"
#include "rbf/normals.h"

#include <stdlib.h>

enum {
  NEIGHBOURS = 6,
  LOOKED_AT = 10000, /* of more samples, about so many */
  SMALLEST = 12      /* cluster */
};

/* Samples on the surface, with normals of length 1. */
typedef struct sheet {
  size_t count;
  double *positions, *normals; /* 3 each */
} sheet;

static bool select_samples(sheet *s, const zs_rbf_samples *samples, size_t first)
{
  const size_t most = 3 * (samples->count - first) + 1;
  *s = (sheet){0, malloc(most * sizeof *s->positions), malloc(most * sizeof *s->normals)};
  if (!s->positions || !s->normals)
    return false;
  s->count = zs_rbf_samples_oriented(samples, first, s->positions, s->normals);
  return true;
}

static bool is_against(const sheet *s, const zs_rbf_clusters *tree, size_t i)
{
  zs_nearest near = {.from = s->positions + 3 * i, .except = (uint32_t)i, .most = NEIGHBOURS};
  double sum = 0;
  zs_nearest_find(&near, tree);
  for (unsigned j = 0; j < near.count; j++)
    sum += zs_rbf_normals_agreement(s->positions, s->normals, i, near.point[j]);
  return sum < 0;
}

static double outwards(const sheet *s)
{
  double middle[3] = {0, 0, 0}, sum = 0;
  for (size_t i = 0; i < 3 * s->count; i++)
    middle[i % 3] += s->positions[i] / (double)s->count;
  for (size_t i = 0; i < s->count; i++) {
    double way[3];
    zs_subtract3(s->positions + 3 * i, middle, way);
    if (zs_normalise3(way))
      sum += zs_dot3(way, s->normals + 3 * i);
  }
  return sum / (double)s->count;
}

bool zs_rbf_facing_find(zs_rbf_facing *facing, const zs_rbf_samples *samples, size_t first)
{
  sheet s;
  zs_rbf_clusters *tree = NULL;
  *facing = (zs_rbf_facing){0};
  bool memory = select_samples(&s, samples, first);
  if (memory && s.count > NEIGHBOURS) {
    tree = zs_rbf_clusters_new(s.positions, s.count, 3, SMALLEST);
    memory = tree;
    for (size_t i = 0; memory && i < s.count; i += s.count / LOOKED_AT + 1) {
      facing->looked_at++;
      facing->against += is_against(&s, tree, i);
    }
    facing->outwards = outwards(&s);
  }
  zs_rbf_clusters_free(tree);
  free(s.positions);
  free(s.normals);
  return memory;
}
