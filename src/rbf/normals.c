#include "rbf/normals.h"

#include "base/vector3.h"
#include "field/program.h"
#include "rbf/nearest.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Neighbours that make a plane in space, or a line in the plane; and by how many
 * fewer are tried. */
enum { IN_SPACE = 12, IN_PLANE = 4, MOST = ZS_NEAREST_MOST, FEWER = 3 };
/* Neighbours whose spread across a line is below this part of that along it,
 * squared, lie on the line. */
static const double LINE = 1e-12;
/* The variation across a plane, by the smaller one along it, with which all is well,
 * and with which there is no plane. */
static const double EVEN = 0.1, UNEVEN = 0.15;

/* The points whose normals are wanted, and what is known of them. */
typedef struct cloud {
  size_t count;
  unsigned dimension, neighbours;
  double *positions;    /* 3 each */
  double *normals;      /* 3 each; 0 0 0: not to be told */
  uint32_t *neighbour;  /* `neighbours` each */
  zs_rbf_clusters *clusters;
} cloud;

/* ---- Planes -------------------------------------------------------------------- */

/* Turn rows and columns p and q of a symmetric matrix so that m[p][q] becomes 0;
 * the columns of v are turned along. */
static void turn(double m[3][3], double v[3][3], int p, int q)
{
  if (m[p][q] == 0)
    return;
  const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
  const double t = copysign(1, theta) / (fabs(theta) + sqrt(theta * theta + 1));
  const double c = 1 / sqrt(t * t + 1), s = t * c;
  for (int k = 0; k < 3; k++) {
    const double a = m[k][p], b = m[k][q];
    m[k][p] = c * a - s * b;
    m[k][q] = s * a + c * b;
  }
  for (int k = 0; k < 3; k++) {
    const double a = m[p][k], b = m[q][k], d = v[k][p], e = v[k][q];
    m[p][k] = c * a - s * b;
    m[q][k] = s * a + c * b;
    v[k][p] = c * d - s * e;
    v[k][q] = s * d + c * e;
  }
}

/* Eigenvectors of a symmetric matrix, as columns, by Jacobi's rotations; the
 * eigenvalues are left on its diagonal. */
static void diagonalise(double m[3][3], double v[3][3])
{
  enum { SWEEPS = 12 };
  memset(v, 0, 9 * sizeof v[0][0]);
  for (int k = 0; k < 3; k++)
    v[k][k] = 1;
  for (int sweep = 0; sweep < SWEEPS; sweep++)
    for (int p = 0; p < 2; p++)
      for (int q = p + 1; q < 3; q++)
        turn(m, v, p, q);
}

/* The direction in which a point and its nearest `neighbours` vary least, and how
 * little they do, by the next larger variation; INFINITY: they lie on a line. */
static double fit_plane(const cloud *c, size_t i, unsigned neighbours, double normal[3])
{
  double middle[3] = {0, 0, 0}, m[3][3] = {{0}}, v[3][3];
  const unsigned n = neighbours + 1;
  const double *member[MOST + 1];
  for (unsigned j = 0; j < n; j++) {
    const size_t index = j ? c->neighbour[i * c->neighbours + j - 1] : i;
    member[j] = c->positions + 3 * index;
    for (int k = 0; k < 3; k++)
      middle[k] += member[j][k] / n;
  }
  for (unsigned j = 0; j < n; j++)
    for (int a = 0; a < 3; a++)
      for (int b = 0; b < 3; b++)
        m[a][b] += (member[j][a] - middle[a]) * (member[j][b] - middle[b]);
  diagonalise(m, v);
  int least = 0, largest = 0;
  const int last = (int)c->dimension; /* in the plane, z is no direction */
  for (int k = 1; k < 3; k++) {
    if (k < last && m[k][k] < m[least][least])
      least = k;
    if (m[k][k] > m[largest][largest])
      largest = k;
  }
  if (least == largest)
    return INFINITY;
  const int other = c->dimension == 3 ? 3 - least - largest : largest;
  if (!(m[other][other] > LINE * m[largest][largest]))
    return INFINITY;
  for (int k = 0; k < 3; k++)
    normal[k] = v[k][least];
  return fmax(m[least][least], 0) / m[other][other];
}

/* The normal of a point: by fewer neighbours where more do not lie along a plane,
 * as on thin parts; none where none do. */
static void find_normal(const cloud *c, size_t i)
{
  double best = UNEVEN;
  for (unsigned n = c->neighbours; n >= 2 * c->dimension - 1 && best > EVEN; n -= FEWER) {
    double normal[3];
    const double uneven = fit_plane(c, i, n, normal);
    if (uneven < best) {
      best = uneven;
      memcpy(c->normals + 3 * i, normal, sizeof normal);
    }
  }
}

/* ---- Turning out of the solid ----------------------------------------------------- */

typedef struct edge {
  float weight;
  uint32_t a, b;
} edge;

double zs_rbf_normals_agreement(const double *positions, const double *normals, size_t i, size_t j)
{
  const double *n = normals + 3 * i, *m = normals + 3 * j;
  double e[3];
  zs_subtract3(positions + 3 * j, positions + 3 * i, e);
  const double square = zs_dot3(e, e);
  return zs_dot3(n, m) - (square > 0 ? 2 * zs_dot3(n, e) * zs_dot3(m, e) / square : 0);
}

static double agreement(const cloud *c, size_t i, size_t j)
{
  return zs_rbf_normals_agreement(c->positions, c->normals, i, j);
}

static int by_weight(const void *a, const void *b)
{
  const edge *p = a, *q = b;
  if (p->weight != q->weight)
    return p->weight < q->weight ? -1 : 1;
  if (p->a != q->a)
    return p->a < q->a ? -1 : 1;
  return p->b < q->b ? -1 : p->b > q->b;
}

static bool has_normal(const cloud *c, size_t i)
{
  const double *n = c->normals + 3 * i;
  return n[0] != 0 || n[1] != 0 || n[2] != 0;
}

static size_t list_edges(const cloud *c, edge *edges)
{
  size_t count = 0;
  for (size_t i = 0; i < c->count; i++)
    for (unsigned j = 0; j < c->neighbours; j++) {
      const uint32_t other = c->neighbour[i * c->neighbours + j];
      if (has_normal(c, i) && has_normal(c, other))
        edges[count++] =
          (edge){(float)(1 - fabs(agreement(c, i, other))), (uint32_t)i, other};
    }
  return count;
}

static uint32_t root_of(uint32_t *parent, uint32_t i)
{
  while (parent[i] != i) {
    parent[i] = parent[parent[i]];
    i = parent[i];
  }
  return i;
}

/* Keep the edges of a minimum spanning forest (Kruskal), in front. */
static size_t span(edge *edges, size_t count, uint32_t *parent)
{
  size_t kept = 0;
  qsort(edges, count, sizeof *edges, by_weight);
  for (size_t i = 0; i < count; i++) {
    const uint32_t a = root_of(parent, edges[i].a), b = root_of(parent, edges[i].b);
    if (a == b)
      continue;
    parent[b] = a;
    edges[kept++] = edges[i];
  }
  return kept;
}

static void flip(const cloud *c, size_t i)
{
  for (size_t k = 0; k < 3; k++)
    c->normals[3 * i + k] = -c->normals[3 * i + k];
}

/* Walk a tree from one of its points, and turn each normal after the one it is
 * reached from.  Lists the points in `queue`; returns how many there are. */
static size_t walk(const cloud *c, uint32_t start, const uint32_t *first, const uint32_t *next,
                   bool *seen, uint32_t *queue)
{
  size_t count = 1;
  queue[0] = start;
  seen[start] = true;
  for (size_t at = 0; at < count; at++) {
    const uint32_t i = queue[at];
    for (uint32_t e = first[i]; e < first[i + 1]; e++) {
      const uint32_t j = next[e];
      if (seen[j])
        continue;
      seen[j] = true;
      if (agreement(c, i, j) < 0)
        flip(c, j);
      queue[count++] = j;
    }
  }
  return count;
}

/* Turn all normals of a part when its farthest point looks inwards. */
static void face_outwards(const cloud *c, const uint32_t *part, size_t count)
{
  double middle[3] = {0, 0, 0}, farthest = -1, outward = 0;
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < 3; k++)
      middle[k] += c->positions[3 * part[i] + k] / (double)count;
  for (size_t i = 0; i < count; i++) {
    double d[3];
    for (size_t k = 0; k < 3; k++)
      d[k] = c->positions[3 * part[i] + k] - middle[k];
    if (zs_dot3(d, d) > farthest) {
      farthest = zs_dot3(d, d);
      outward = zs_dot3(d, c->normals + 3 * part[i]);
    }
  }
  for (size_t i = 0; outward < 0 && i < count; i++)
    flip(c, part[i]);
}

/* The forest's edges of each point: those of i are next[first[i]] ... */
static void link_edges(const edge *edges, size_t count, size_t points, uint32_t *first,
                       uint32_t *next)
{
  memset(first, 0, (points + 2) * sizeof *first);
  for (size_t e = 0; e < count; e++) {
    first[edges[e].a + 2]++;
    first[edges[e].b + 2]++;
  }
  for (size_t i = 2; i < points + 2; i++)
    first[i] += first[i - 1];
  for (size_t e = 0; e < count; e++) {
    next[first[edges[e].a + 1]++] = edges[e].b;
    next[first[edges[e].b + 1]++] = edges[e].a;
  }
}

static bool orient(const cloud *c)
{
  const size_t n = c->count;
  edge *edges = malloc(n * c->neighbours * sizeof *edges);
  uint32_t *parent = malloc(n * sizeof *parent), *queue = malloc(n * sizeof *queue);
  uint32_t *first = malloc((n + 2) * sizeof *first), *next = malloc(2 * n * sizeof *next);
  bool *seen = calloc(n, sizeof *seen);
  const bool memory = edges && parent && queue && first && next && seen;
  if (memory) {
    for (size_t i = 0; i < n; i++)
      parent[i] = (uint32_t)i;
    const size_t count = span(edges, list_edges(c, edges), parent);
    link_edges(edges, count, n, first, next);
    for (size_t i = 0; i < n; i++)
      if (!seen[i])
        face_outwards(c, queue, walk(c, (uint32_t)i, first, next, seen, queue));
  }
  free(edges);
  free(parent);
  free(queue);
  free(first);
  free(next);
  free(seen);
  return memory;
}

/* ---- All together -------------------------------------------------------------- */

static bool prepare(cloud *c, const zs_rbf_samples *samples)
{
  enum { SMALLEST = 12 }; /* cluster */
  const size_t n = c->count;
  c->positions = malloc(3 * n * sizeof *c->positions);
  c->normals = calloc(3 * n, sizeof *c->normals);
  c->neighbour = malloc(n * c->neighbours * sizeof *c->neighbour);
  if (!c->positions || !c->normals || !c->neighbour)
    return false;
  size_t at = 0;
  for (size_t i = 0; i < samples->count; i++)
    if (samples->samples[i].estimate)
      memcpy(c->positions + 3 * at++, samples->samples[i].position, 3 * sizeof *c->positions);
  c->clusters = zs_rbf_clusters_new(c->positions, n, 3, SMALLEST);
  return c->clusters != NULL;
}

static void fit_planes(const cloud *c, const zs_control *control)
{
  (void)control; /* without OpenMP */
#pragma omp parallel for schedule(dynamic, 64) num_threads(zs_control_threads(control))
  for (size_t i = 0; i < c->count; i++) {
    zs_nearest n = {.from = c->positions + 3 * i, .except = (uint32_t)i, .most = c->neighbours};
    zs_nearest_find(&n, c->clusters);
    memcpy(c->neighbour + i * c->neighbours, n.point, c->neighbours * sizeof *n.point);
    find_normal(c, i);
  }
}

/* Hand the normals out; returns how many there are. */
static size_t deliver(const cloud *c, zs_rbf_samples *samples)
{
  size_t at = 0, told = 0;
  for (size_t i = 0; i < samples->count; i++) {
    zs_rbf_sample *sample = &samples->samples[i];
    if (!sample->estimate)
      continue;
    told += has_normal(c, at);
    memcpy(sample->normal, c->normals + 3 * at++, sizeof sample->normal);
    sample->estimate = false;
  }
  return told;
}

bool zs_rbf_normals_estimate(zs_rbf_samples *samples, unsigned dimension,
                             const zs_control *control, const zs_place *place, zs_diag *diag)
{
  cloud c = {.dimension = dimension, .neighbours = dimension == 3 ? IN_SPACE : IN_PLANE};
  for (size_t i = 0; i < samples->count; i++)
    c.count += samples->samples[i].estimate;
  if (c.count == 0)
    return true;
  if (c.count < 2 * dimension)
    return zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, place,
                     "give the points normals, or add points with positive values inside",
                     "nothing says where the inside is, and %zu points are too few to tell "
                     "normals from; expected at least %u", c.count, 2 * dimension);
  if (c.neighbours > c.count - 1)
    c.neighbours = (unsigned)c.count - 1;
  bool memory = prepare(&c, samples);
  if (memory) {
    fit_planes(&c, control);
    memory = orient(&c);
  }
  const size_t told = memory ? deliver(&c, samples) : 0;
  zs_rbf_clusters_free(c.clusters);
  free(c.positions);
  free(c.normals);
  free(c.neighbour);
  if (!memory)
    return zs_fail_memory(diag);
  return told || zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, place,
                           "give the points normals, or add points with positive values inside",
                           "nothing says where the inside is: the points have no normals, and lie "
                           "so that none can be told (all in one place, or on one line)");
}
