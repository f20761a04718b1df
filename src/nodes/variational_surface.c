/* Samples of the edges and faces of meshes, where the vertices alone would not hold a
 * variational surface to them. */
#include "nodes/variational_surface.h"

#include "rbf/fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The automatic deviation, by the samples' size. */
static const double AUTOMATIC = 1.0 / 2500;
/* Samples nearer to each other than so many deviations say nothing new.  An automatic deviation
 * is not worth as many samples along creases as it takes there. */
static const double CLOSE = 3, CLOSE_AUTOMATIC = 10;
/* A sample nearer than this part of the size to one with a normal needs none of its own: the
 * constraints beside the surface there do for both. */
static const double SAME_NORMAL = 0.02;
/* Rounds of halving edges. */
enum { ROUNDS = 16 };

/* ---- Halving edges ---------------------------------------------------------------- */

/* An edge of a triangle, from corner to corner. */
typedef struct edge {
  uint32_t a, b, triangle; /* a < b */
  uint8_t corner;          /* the first one */
} edge;

static int by_ends(const void *x, const void *y)
{
  const edge *p = x, *q = y;
  if (p->a != q->a)
    return p->a < q->a ? -1 : 1;
  if (p->b != q->b)
    return p->b < q->b ? -1 : 1;
  return p->triangle < q->triangle ? -1 : p->triangle > q->triangle;
}

/* How far a smooth curve with these normals leaves the edge: a cubic, in the middle. */
static double bulge(const zs_rbf_sample *a, const zs_rbf_sample *b)
{
  double along[3], difference[3];
  for (int k = 0; k < 3; k++) {
    along[k] = b->position[k] - a->position[k];
    difference[k] = a->normal[k] - b->normal[k];
  }
  return fabs(zs_dot3(along, difference)) / 8;
}

/* The edges of all triangles, those with the same ends together; NULL when memory is out. */
static edge *list_edges(const zs_surface *s)
{
  const size_t count = 3 * s->triangle_count;
  edge *edges = malloc((count + 1) * sizeof *edges);
  for (size_t i = 0; edges && i < count; i++) {
    const uint32_t a = s->triangles[i], b = s->triangles[i - i % 3 + (i + 1) % 3];
    edges[i] = (edge){a < b ? a : b, a < b ? b : a, (uint32_t)(i / 3), (uint8_t)(i % 3)};
  }
  if (edges)
    qsort(edges, count, sizeof *edges, by_ends);
  return edges;
}

/* A sample in the middle of an edge, with the mean normal of its triangles. */
static bool add_middle(const zs_surface *s, const edge *edges, size_t count, zs_diag *diag)
{
  zs_rbf_sample middle = {.value = 0};
  for (int k = 0; k < 3; k++)
    middle.position[k] = 0.5 * (zs_surface_vertex(s, edges[0].a)->position[k] +
                                zs_surface_vertex(s, edges[0].b)->position[k]);
  for (size_t i = 0; i < count; i++) {
    double area[3];
    zs_surface_area_vector(s, edges[i].triangle, area);
    zs_normalise3(area);
    for (int k = 0; k < 3; k++)
      middle.normal[k] += area[k];
  }
  zs_normalise3(middle.normal);
  return zs_rbf_samples_add(s->list, &middle, diag);
}

/* Divide a triangle at the middles of its edges (0: not divided); returns how many there are. */
static size_t divide(const uint32_t corner[3], const uint32_t middle[3], uint32_t *to)
{
  size_t divided = 0;
  unsigned first = 0;
  for (unsigned j = 0; j < 3; j++)
    divided += middle[j] != 0;
  /* Begin after an edge that is whole, or with the only one that is divided. */
  while (divided % 3 && (divided == 1 ? !middle[first] : middle[(first + 2) % 3] != 0))
    first++;
  const uint32_t a = corner[first], b = corner[(first + 1) % 3], c = corner[(first + 2) % 3];
  const uint32_t ab = middle[first], bc = middle[(first + 1) % 3], ca = middle[(first + 2) % 3];
  const uint32_t parts[4][12] = {{a, b, c},
                                 {a, ab, c, ab, b, c},
                                 {ab, b, bc, a, ab, bc, a, bc, c},
                                 {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca}};
  memcpy(to, parts[divided], 3 * (divided + 1) * sizeof *to);
  return divided + 1;
}

/* Halve the edges that bulge, once; `changed` tells whether there were any.  False after
 * reporting. */
static bool halve(zs_surface *s, double deviation, bool *changed, zs_diag *diag)
{
  const size_t count = 3 * s->triangle_count;
  edge *edges = list_edges(s);
  uint32_t *middles = calloc(count + 1, sizeof *middles);
  uint32_t *triangles = malloc((4 * count + 1) * sizeof *triangles);
  bool done = edges && middles && triangles;
  if (!done)
    zs_fail_memory(diag);
  *changed = false;
  for (size_t i = 0, end; done && i < count; i = end) {
    for (end = i + 1; end < count && edges[end].a == edges[i].a && edges[end].b == edges[i].b;)
      end++;
    if (bulge(zs_surface_vertex(s, edges[i].a), zs_surface_vertex(s, edges[i].b)) <= deviation)
      continue;
    const uint32_t index = (uint32_t)(s->list->count - s->first);
    done = add_middle(s, &edges[i], end - i, diag);
    *changed = true;
    for (size_t j = i; j < end; j++)
      middles[3 * (size_t)edges[j].triangle + edges[j].corner] = index;
  }
  size_t made = 0;
  for (size_t t = 0; done && t < s->triangle_count; t++)
    made += divide(s->triangles + 3 * t, middles + 3 * t, triangles + 3 * made);
  free(edges);
  free(middles);
  if (!done) {
    free(triangles);
    return false;
  }
  free(s->triangles);
  s->triangles = triangles;
  s->triangle_count = made;
  return true;
}

/* ---- Thinning --------------------------------------------------------------------- */

/* Samples by the cells of a grid: lists of those whose cells have the same hash. */
typedef struct grid {
  double cell;
  size_t size;              /* of `head`, a power of two */
  uint32_t *head, *next;    /* index + 1 of a sample; 0: none */
} grid;

static size_t hash(const grid *g, const double position[3], const int offset[3])
{
  static const uint64_t factor[3] = {UINT64_C(0x9e3779b97f4a7c15), UINT64_C(0xbf58476d1ce4e5b9),
                                     UINT64_C(0x94d049bb133111eb)};
  uint64_t h = 0;
  for (int k = 0; k < 3; k++) {
    const double at = floor(position[k] / g->cell) + offset[k];
    h = (h ^ (uint64_t)(int64_t)fmax(fmin(at, 1e18), -1e18)) * factor[k];
    h ^= h >> 29;
  }
  return (size_t)h & (g->size - 1);
}

/* Whether a kept sample is nearer than a cell is wide. */
static bool is_crowded(const grid *g, const zs_rbf_sample *samples, const zs_rbf_sample *sample)
{
  for (int n = 0; n < 27; n++) {
    const int offset[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
    for (uint32_t i = g->head[hash(g, sample->position, offset)]; i; i = g->next[i - 1]) {
      double square = 0;
      for (int k = 0; k < 3; k++)
        square += pow(samples[i - 1].position[k] - sample->position[k], 2);
      if (square < g->cell * g->cell)
        return true;
    }
  }
  return false;
}

static bool grid_init(grid *g, double cell, size_t count)
{
  *g = (grid){.cell = cell, .size = 1024};
  while (g->size < count)
    g->size *= 2;
  g->head = calloc(g->size, sizeof *g->head);
  g->next = calloc(count + 1, sizeof *g->next);
  return g->head && g->next;
}

static void grid_clear(grid *g)
{
  free(g->head);
  free(g->next);
}

static void grid_add(grid *g, const zs_rbf_sample *samples, size_t index)
{
  static const int here[3] = {0, 0, 0};
  const size_t at = hash(g, samples[index].position, here);
  g->next[index] = g->head[at];
  g->head[at] = (uint32_t)(index + 1);
}

/* Leave out samples beyond the vertices that are nearer than `close` to another one: narrow
 * triangles make many.  False when memory is out. */
static bool thin(const zs_surface *s, size_t vertices, double close)
{
  zs_rbf_sample *samples = s->list->samples + s->first;
  const size_t count = s->list->count - s->first;
  size_t kept = 0;
  grid g;
  const bool memory = grid_init(&g, close, count);
  for (size_t i = 0; memory && i < count; i++) {
    if (i >= vertices && is_crowded(&g, samples, &samples[i]))
      continue;
    samples[kept] = samples[i];
    grid_add(&g, samples, kept++);
  }
  if (memory)
    s->list->count = s->first + kept;
  grid_clear(&g);
  return memory;
}

/* Take away the normals of samples beyond the vertices that have others nearby.  False when
 * memory is out. */
static bool thin_normals(const zs_surface *s, size_t vertices, double close)
{
  zs_rbf_sample *samples = s->list->samples + s->first;
  const size_t count = s->list->count - s->first;
  grid g;
  const bool memory = grid_init(&g, close, count);
  for (size_t i = 0; memory && i < count; i++)
    if (zs_dot3(samples[i].normal, samples[i].normal) > 0) {
      if (i >= vertices && is_crowded(&g, samples, &samples[i]))
        memset(samples[i].normal, 0, sizeof samples[i].normal);
      else
        grid_add(&g, samples, i);
    }
  grid_clear(&g);
  return memory;
}

/* ---- Both ------------------------------------------------------------------------- */

bool zs_surface_hold_to_faces(zs_surface *s, double deviation, zs_diag *diag)
{
  const size_t vertices = s->list->count - s->first;
  const zs_rbf_samples own = {.samples = s->list->samples + s->first, .count = vertices};
  const double size = zs_rbf_samples_size(&own);
  const double most = isnan(deviation) ? AUTOMATIC * size : deviation;
  bool done = true, changed = size > 0;
  for (int round = 0; done && changed && round < ROUNDS && s->list->count < ZS_RBF_MAXIMUM_COUNT;
       round++)
    done = halve(s, most, &changed, diag);
  if (!done || s->list->count == s->first + vertices)
    return done;
  return (thin(s, vertices, (isnan(deviation) ? CLOSE_AUTOMATIC : CLOSE) * most) &&
          thin_normals(s, vertices, SAME_NORMAL * size)) ||
         zs_fail_memory(diag);
}
