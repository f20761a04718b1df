#include "rbf/witnesses.h"

#include "base/vector3.h"
#include "field/program.h"
#include "rbf/nearest.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Cells along the longest side to begin with, and how far they go beyond the samples' box, by
 * it. */
enum { SPACE_FIRST = 8, PLANE_FIRST = 16 };
static const double BEYOND = 0.25;
/* A cell is no longer than so many times the distance from its middle to the samples: what a
 * radial sum does wrong between its constraints is about as large as they are far. */
static const double FINE = 1;
/* Cells become no smaller where there would be more than so many: each is summed up directly. */
enum { MOST = 65536 };
/* A place is outside when the samples wind around it less than this, inside when more. */
static const double OUTSIDE = 0.3, INSIDE = 0.7;
/* Normals by their pieces add up to nothing over a closed surface; one that is open by more
 * than this part of it has no inside. */
static const double OPEN = 0.2;
/* What neighbours along a line are told by, and which part of the samples may have such:
 * curves on a surface do not tell how much of it belongs to them. */
static const double LINE = 0.02, CURVES = 0.1;
/* A place nearer than so many times the distance between samples is not told apart. */
static const double CLEAR = 2;
/* Clusters nearer than so many times their radius are not taken as one. */
static const double FAR = 2;
/* Marked witnesses are so many of their distances from the surface apart. */
static const double APART = 0.5;
enum { MARKED_AT_MOST = 128 };

/* Oriented pieces of surface, and the clusters of them. */
typedef struct pieces {
  unsigned dimension;
  size_t count;
  double *positions, *vectors;   /* 3 each: normals as long as pieces are large */
  double *across;                /* about the distance to neighbours */
  zs_rbf_clusters *clusters;
  double *middles, *sums, *radii; /* of clusters: 3, 3 and 1 each */
} pieces;

static void clear(pieces *p)
{
  free(p->positions);
  free(p->vectors);
  free(p->across);
  zs_rbf_clusters_free(p->clusters);
  free(p->middles);
  free(p->sums);
  free(p->radii);
}

/* The samples on the surface with normals. */
static bool select_samples(pieces *p, const zs_rbf_samples *samples)
{
  p->positions = malloc((3 * samples->count + 1) * sizeof *p->positions);
  p->vectors = malloc((3 * samples->count + 1) * sizeof *p->vectors);
  p->across = malloc((samples->count + 1) * sizeof *p->across);
  if (!p->positions || !p->vectors || !p->across)
    return false;
  p->count = zs_rbf_samples_oriented(samples, 0, p->positions, p->vectors);
  return true;
}

/* Neighbours that lie along one line on the surface are those of a curve on it, as contours
 * are: by the smaller spread across their normal, times the larger one, by their sum squared. */
static bool is_on_curve(const pieces *p, const zs_nearest *near, const double normal[3])
{
  double u[3], v[3], uu = 0, vv = 0, uv = 0;
  const int axis = fabs(normal[0]) < 0.6 ? 0 : 1;
  const double other[3] = {axis == 0, axis == 1, 0};
  zs_cross3(normal, other, u);
  zs_normalise3(u);
  zs_cross3(normal, u, v);
  for (unsigned j = 0; j < near->count; j++) {
    double way[3];
    zs_subtract3(p->positions + 3 * (size_t)near->point[j], near->from, way);
    const double x = zs_dot3(way, u), y = zs_dot3(way, v);
    uu += x * x;
    vv += y * y;
    uv += x * y;
  }
  return uu * vv - uv * uv < LINE * (uu + vv) * (uu + vv);
}

/* How large the piece of a sample is, and how far it is to others: exactly so much on even
 * grids.  0 for a sample on a curve. */
static double size_of(const pieces *p, size_t i, double *across)
{
  zs_nearest near = {.from = p->positions + 3 * i,
                     .except = (uint32_t)i,
                     .most = p->dimension == 3 ? 8 : 2};
  zs_nearest_find(&near, p->clusters);
  double mean = 0;
  if (p->dimension == 2) {
    for (unsigned j = 0; j < near.count; j++)
      mean += sqrt(near.square[j]) / near.count;
    *across = mean;
    return mean;
  }
  for (unsigned j = 0; j < near.count; j++)
    mean += near.square[j] / near.count;
  /* The eight nearest of a square grid are 1 or sqrt 2 away, 1.5 in the mean of squares. */
  *across = sqrt(mean / 1.5);
  return is_on_curve(p, &near, p->vectors + 3 * i) ? 0 : mean / 1.5;
}

static void measure(const pieces *p, const zs_control *control)
{
  (void)control; /* without OpenMP */
#pragma omp parallel for schedule(dynamic, 64) num_threads(zs_control_threads(control))
  for (size_t i = 0; i < p->count; i++) {
    const double size = size_of(p, i, &p->across[i]);
    for (size_t k = 0; k < 3; k++)
      p->vectors[3 * i + k] *= size;
  }
}

/* Sum up the pieces of every cluster. */
static bool sum_clusters(pieces *p)
{
  const size_t count = p->clusters->cluster_count;
  p->middles = calloc(3 * count, sizeof *p->middles);
  p->sums = calloc(3 * count, sizeof *p->sums);
  p->radii = calloc(count, sizeof *p->radii);
  if (!p->middles || !p->sums || !p->radii)
    return false;
  for (size_t c = 0; c < count; c++) {
    const zs_rbf_cluster *cluster = &p->clusters->clusters[c];
    double square = 0;
    for (size_t k = 0; k < 3; k++) {
      p->middles[3 * c + k] = 0.5 * (cluster->lo[k] + cluster->hi[k]);
      square += pow(0.5 * (cluster->hi[k] - cluster->lo[k]), 2);
    }
    p->radii[c] = sqrt(square);
    for (size_t i = cluster->first; i < cluster->first + cluster->count; i++)
      for (size_t k = 0; k < 3; k++)
        p->sums[3 * c + k] += p->vectors[3 * (size_t)p->clusters->order[i] + k];
  }
  return true;
}

/* Whether the pieces close, but for a part; those of no size do not. */
static bool is_closed(const pieces *p)
{
  double all = 0;
  size_t without = 0;
  const double *sum = p->sums; /* of the first cluster, which is everything */
  for (size_t i = 0; i < p->count; i++) {
    const double size = sqrt(zs_dot3(p->vectors + 3 * i, p->vectors + 3 * i));
    all += size;
    without += size == 0;
  }
  return (double)without <= CURVES * (double)p->count && sqrt(zs_dot3(sum, sum)) < OPEN * all;
}

/* How much a piece winds around a place: its solid angle by that of everything. */
static double wind(unsigned dimension, const double from[3], const double at[3],
                   const double vector[3])
{
  double along = 0, square = 0;
  for (int k = 0; k < 3; k++) {
    const double d = at[k] - from[k];
    along += d * vector[k];
    square += d * d;
  }
  const double turn = 2 * acos(-1.0);
  return along / (dimension == 3 ? 2 * turn * square * sqrt(square) : turn * square);
}

static double winding(const pieces *p, size_t index, const double from[3])
{
  const zs_rbf_cluster *cluster = &p->clusters->clusters[index];
  double square = 0, sum = 0;
  for (size_t k = 0; k < 3; k++)
    square += pow(p->middles[3 * index + k] - from[k], 2);
  if (square > pow(FAR * p->radii[index], 2))
    return wind(p->dimension, from, p->middles + 3 * index, p->sums + 3 * index);
  if (cluster->children)
    return winding(p, cluster->children, from) + winding(p, cluster->children + 1, from);
  for (size_t i = cluster->first; i < cluster->first + cluster->count; i++) {
    const size_t piece = p->clusters->order[i];
    sum += wind(p->dimension, from, p->positions + 3 * piece, p->vectors + 3 * piece);
  }
  return sum;
}

/* A place, the middle of a cell. */
typedef struct place {
  double at[3];
  double distance; /* from the samples, negative outside; 0: not clear */
  bool coarse;     /* smaller cells would tell more */
} place;

static void judge(const pieces *p, double side, place *place)
{
  zs_nearest nearest = {.from = place->at, .except = UINT32_MAX, .most = 1};
  zs_nearest_find(&nearest, p->clusters);
  const double distance = sqrt(nearest.square[0]);
  const double clear = CLEAR * p->across[nearest.point[0]];
  place->coarse = side > FINE * distance && side > clear;
  place->distance = 0;
  if (!(distance > clear))
    return;
  const double turns = winding(p, 0, place->at);
  place->distance = turns < OUTSIDE ? -distance : turns > INSIDE ? distance : 0;
}

/* Cells of the same size. */
typedef struct level {
  double side;
  size_t count;
  place *places;
} level;

/* Those that fill the box of the pieces and what is somewhat beyond it.  False when memory is
 * out. */
static bool begin(level *l, const pieces *p)
{
  const zs_rbf_cluster *all = &p->clusters->clusters[0];
  double longest = 0, lo[3];
  size_t count[3];
  for (unsigned k = 0; k < p->dimension; k++)
    longest = fmax(longest, all->hi[k] - all->lo[k]);
  l->side = (1 + 2 * BEYOND) * longest / (p->dimension == 3 ? SPACE_FIRST : PLANE_FIRST);
  l->count = 1;
  for (unsigned k = 0; k < 3; k++) {
    const double side = all->hi[k] - all->lo[k] + 2 * BEYOND * longest;
    const bool used = k < p->dimension;
    count[k] = used ? (size_t)ceil(side / l->side) : 1;
    lo[k] = used ? 0.5 * (all->lo[k] + all->hi[k] - l->side * (double)(count[k] - 1)) : 0;
    l->count *= count[k];
  }
  l->places = malloc(l->count * sizeof *l->places);
  for (size_t i = 0; l->places && i < l->count; i++) {
    const size_t index[3] = {i % count[0], i / count[0] % count[1], i / count[0] / count[1]};
    for (int k = 0; k < 3; k++)
      l->places[i].at[k] = lo[k] + l->side * (double)index[k];
  }
  return l->places;
}

/* Replace a level by the parts of its coarse cells, which are `coarse`.  False when memory is
 * out. */
static bool divide(level *l, size_t coarse, unsigned dimension)
{
  const unsigned parts = 1U << dimension;
  level next = {.side = l->side / 2, .places = malloc((parts * coarse + 1) * sizeof *next.places)};
  for (size_t i = 0; next.places && i < l->count; i++)
    for (unsigned part = 0; l->places[i].coarse && part < parts; part++) {
      place *to = &next.places[next.count++];
      for (unsigned k = 0; k < 3; k++)
        to->at[k] = l->places[i].at[k] + (k >= dimension      ? 0
                                          : part >> k & 1 ? next.side / 2
                                                          : -next.side / 2);
    }
  free(l->places);
  *l = next;
  return l->places;
}

/* Append the places of a level that are clear, of its finest cells only unless it is the
 * `last`.  False when memory is out. */
static bool append(zs_rbf_constraints *witnesses, const level *l, unsigned dimension, bool last)
{
  const size_t most = witnesses->count + l->count + 1;
  double *positions = realloc(witnesses->positions, most * dimension * sizeof *positions);
  witnesses->positions = positions ? positions : witnesses->positions;
  double *values = realloc(witnesses->values, most * sizeof *values);
  witnesses->values = values ? values : witnesses->values;
  if (!positions || !values)
    return false;
  for (size_t i = 0; i < l->count; i++) {
    const place *place = &l->places[i];
    if (place->distance == 0 || (place->coarse && !last))
      continue;
    memcpy(positions + dimension * witnesses->count, place->at, dimension * sizeof *positions);
    values[witnesses->count++] = place->distance;
  }
  return true;
}

/* Judge places that are the closer together the nearer the samples are. */
static bool judge_places(const pieces *p, zs_rbf_constraints *witnesses,
                         const zs_control *control)
{
  level l;
  bool memory = begin(&l, p), last = false;
  (void)control; /* without OpenMP */
  while (memory && l.count && !last) {
#pragma omp parallel for schedule(dynamic, 64) num_threads(zs_control_threads(control))
    for (size_t i = 0; i < l.count; i++)
      judge(p, l.side, &l.places[i]);
    size_t coarse = 0;
    for (size_t i = 0; i < l.count; i++)
      coarse += l.places[i].coarse;
    last = witnesses->count + (coarse << p->dimension) > MOST;
    memory = append(witnesses, &l, p->dimension, last) &&
             (last || divide(&l, coarse, p->dimension));
  }
  free(l.places);
  return memory;
}

bool zs_rbf_witnesses_make(zs_rbf_constraints *witnesses, const zs_rbf_samples *samples,
                           unsigned dimension, const zs_control *control)
{
  enum { SMALLEST = 12 }; /* cluster */
  pieces p = {.dimension = dimension};
  *witnesses = (zs_rbf_constraints){0};
  bool memory = select_samples(&p, samples);
  if (memory && p.count > dimension) {
    p.clusters = zs_rbf_clusters_new(p.positions, p.count, 3, SMALLEST);
    memory = p.clusters;
    if (memory) {
      measure(&p, control);
      memory = sum_clusters(&p);
    }
    if (memory && is_closed(&p))
      memory = judge_places(&p, witnesses, control);
  }
  clear(&p);
  if (!memory)
    zs_rbf_constraints_clear(witnesses);
  return memory;
}

/* ---- Against a fit -------------------------------------------------------------------- */

/* A witness that a fit is against. */
typedef struct objection {
  double distance;
  size_t witness;
} objection;

static int by_distance(const void *a, const void *b)
{
  const objection *p = a, *q = b;
  if (p->distance != q->distance)
    return p->distance > q->distance ? -1 : 1;
  return p->witness < q->witness ? -1 : 1;
}

bool zs_rbf_witnesses_against(const zs_rbf *rbf, const double *positions, const double *values,
                              size_t count, const zs_control *control, bool *against,
                              size_t *marked_count, zs_diag *diag)
{
  const unsigned dimension = rbf->dimension;
  double *found = malloc((count + 1) * sizeof *found);
  objection *list = malloc((count + 1) * sizeof *list);
  size_t objections = 0, marked[MARKED_AT_MOST], so_far = 0;
  memset(against, 0, count * sizeof *against);
  if (!((found && list) || zs_fail_memory(diag)) ||
      !zs_rbf_values(rbf, positions, count, found, control, diag)) {
    free(found);
    free(list);
    return false;
  }
  for (size_t i = 0; i < count; i++)
    if ((found[i] >= 0) != (values[i] >= 0))
      list[objections++] = (objection){fabs(values[i]), i};
  free(found);
  qsort(list, objections, sizeof *list, by_distance);
  for (size_t i = 0; i < objections && so_far < MARKED_AT_MOST; i++) {
    const double *at = positions + dimension * list[i].witness;
    bool crowded = false;
    for (size_t j = 0; j < so_far && !crowded; j++) {
      double square = 0;
      for (unsigned k = 0; k < dimension; k++)
        square += pow(positions[dimension * marked[j] + k] - at[k], 2);
      crowded = square < pow(APART * list[i].distance, 2);
    }
    if (crowded)
      continue;
    against[list[i].witness] = true;
    marked[so_far++] = list[i].witness;
  }
  free(list);
  *marked_count = so_far;
  return true;
}
