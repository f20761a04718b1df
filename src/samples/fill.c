#include "samples/fill.h"

#include "base/array.h"
#include "samples/polygon.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  FINENESS = 40, /* bits of the lattice */
  NEAR = 4,      /* points so many steps of it apart, or fewer, are one */
  TOUCHING = 2,  /* and so far from an edge they lie on it */
  MOST_PASSES = 12
};

void zs_fill_clear(zs_fill *fill)
{
  free(fill->edges);
  *fill = (zs_fill){0};
}

static bool reserve(zs_fill *fill, size_t more)
{
  double(*edges)[4] =
    zs_array_grown(fill->edges, fill->count + more, &fill->capacity, sizeof *edges);
  if (edges)
    fill->edges = edges;
  return edges || !more;
}

bool zs_fill_add_edge(zs_fill *fill, const double a[2], const double b[2])
{
  if (a[0] == b[0] && a[1] == b[1])
    return true;
  if (!reserve(fill, 1))
    return false;
  const double edge[4] = {a[0], a[1], b[0], b[1]};
  memcpy(fill->edges[fill->count++], edge, sizeof edge);
  return true;
}

bool zs_fill_add_rings(zs_fill *fill, const double *points, const size_t *ends, size_t rings)
{
  size_t first = 0;
  for (size_t r = 0; r < rings; first = ends[r++])
    for (size_t i = first; i < ends[r]; i++)
      if (!zs_fill_add_edge(fill, points + 2 * i, points + 2 * (i + 1 < ends[r] ? i + 1 : first)))
        return false;
  return true;
}

bool zs_fill_add(zs_fill *fill, const zs_fill *other)
{
  if (!reserve(fill, other->count))
    return false;
  if (other->count)
    memcpy(fill->edges + fill->count, other->edges, other->count * sizeof *other->edges);
  fill->count += other->count;
  return true;
}

/* ---- The lattice ------------------------------------------------------------------- */

static double step_of(const zs_fill *fill)
{
  double size = 0;
  int exponent;
  for (size_t i = 0; i < fill->count; i++)
    for (int k = 0; k < 4; k++)
      size = fmax(size, fabs(fill->edges[i][k]));
  frexp(size, &exponent);
  return ldexp(1, exponent - FINENESS);
}

static double snapped(double x, double step)
{
  return rint(x / step) * step;
}

/* Points that are kept, by the square of the lattice that they lie in: open addressing. */
typedef struct spots {
  double (*points)[2];
  int64_t (*squares)[2];
  bool *taken;
  size_t mask;
  double side; /* of a square: points closer than that become one */
} spots;

static size_t place_of(const spots *s, int64_t x, int64_t y)
{
  uint64_t h =
    (uint64_t)x * UINT64_C(0x9e3779b97f4a7c15) ^ (uint64_t)y * UINT64_C(0xbf58476d1ce4e5b9);
  h ^= h >> 29;
  size_t at = h & s->mask;
  while (s->taken[at] && (s->squares[at][0] != x || s->squares[at][1] != y))
    at = (at + 1) & s->mask;
  return at;
}

/* Move a point to one that is kept and near, or keep it. */
static void settle(spots *s, double p[2])
{
  const int64_t x = (int64_t)floor(p[0] / s->side), y = (int64_t)floor(p[1] / s->side);
  for (int64_t i = x - 1; i <= x + 1; i++)
    for (int64_t j = y - 1; j <= y + 1; j++) {
      const size_t at = place_of(s, i, j);
      if (!s->taken[at] || fabs(s->points[at][0] - p[0]) > s->side ||
          fabs(s->points[at][1] - p[1]) > s->side)
        continue;
      memcpy(p, s->points[at], sizeof *s->points);
      return;
    }
  const size_t at = place_of(s, x, y);
  s->taken[at] = true;
  s->squares[at][0] = x;
  s->squares[at][1] = y;
  memcpy(s->points[at], p, sizeof *s->points);
}

/* Move all points to the lattice, and to each other where they nearly meet.  False when
 * memory is out. */
static bool snap(zs_fill *fill, double step)
{
  size_t size = 16, kept = 0;
  while (size < 4 * fill->count)
    size *= 2;
  spots s = {.points = malloc(size * sizeof *s.points),
             .squares = malloc(size * sizeof *s.squares),
             .taken = calloc(size, sizeof *s.taken),
             .mask = size - 1,
             .side = NEAR * step};
  const bool memory = s.points && s.squares && s.taken;
  for (size_t i = 0; memory && i < fill->count; i++) {
    double e[4];
    for (int k = 0; k < 4; k++)
      e[k] = snapped(fill->edges[i][k], step);
    settle(&s, e);
    settle(&s, e + 2);
    if (e[0] != e[2] || e[1] != e[3])
      memcpy(fill->edges[kept++], e, sizeof e);
  }
  fill->count = kept;
  free(s.points);
  free(s.squares);
  free(s.taken);
  return memory;
}

/* ---- Cuts ------------------------------------------------------------------------------ */

/* Where an edge is to be cut. */
typedef struct cut {
  size_t edge;
  double along, point[2];
} cut;

typedef struct cutter {
  const zs_polygon *polygon;
  double step;
  cut *cuts;
  size_t count, capacity;
  bool failed; /* memory is out */
} cutter;

static void add_cut(cutter *c, uint32_t edge, double along, double x, double y)
{
  const zs_polygon_edge *e = &c->polygon->edges[edge];
  const double near = NEAR * c->step;
  const bool at_end = (fabs(x - e->a[0]) <= near && fabs(y - e->a[1]) <= near) ||
                      (fabs(x - e->b[0]) <= near && fabs(y - e->b[1]) <= near);
  if (at_end || c->failed)
    return;
  cut *cuts = zs_array_grown(c->cuts, c->count + 1, &c->capacity, sizeof *cuts);
  if (!cuts) {
    c->failed = true;
    return;
  }
  c->cuts = cuts;
  cuts[c->count++] = (cut){edge, along, {x, y}};
}

/* The signed distance of a point from an edge's line, and how far along it falls. */
static double across(const zs_polygon_edge *e, const double p[2], double *along)
{
  const double x = p[0] - e->a[0], y = p[1] - e->a[1];
  *along = x * e->direction[0] + y * e->direction[1];
  return e->direction[0] * y - e->direction[1] * x;
}

/* Whether a point lies on an edge; cuts the edge there, unless it is at one of its ends. */
static bool touch(cutter *c, uint32_t edge, const double p[2])
{
  const zs_polygon_edge *e = &c->polygon->edges[edge];
  double along;
  const double near = TOUCHING * c->step;
  if (fabs(across(e, p, &along)) > near || along < -near || along > e->length + near)
    return false;
  add_cut(c, edge, along, p[0], p[1]);
  return true;
}

static void meet(cutter *c, uint32_t i, uint32_t j)
{
  const zs_polygon_edge *e = &c->polygon->edges[i], *f = &c->polygon->edges[j];
  const bool touched = (int)touch(c, i, f->a) | (int)touch(c, i, f->b) | (int)touch(c, j, e->a) |
                       (int)touch(c, j, e->b);
  if (touched)
    return;
  double from, to, along;
  const double fa = across(e, f->a, &from), fb = across(e, f->b, &to);
  const double ea = across(f, e->a, &along), eb = across(f, e->b, &along);
  if ((fa > 0) == (fb > 0) || (ea > 0) == (eb > 0))
    return;
  const double t = fa / (fa - fb), s = ea / (ea - eb);
  const double x = snapped(f->a[0] + t * (f->b[0] - f->a[0]), c->step);
  const double y = snapped(f->a[1] + t * (f->b[1] - f->a[1]), c->step);
  add_cut(c, i, s * e->length, x, y);
  add_cut(c, j, t * f->length, x, y);
}

/* Look for edges that meet edge i, of those behind it. */
static void cut_edge(cutter *c, uint32_t i)
{
  const zs_polygon *p = c->polygon;
  const zs_polygon_edge *e = &p->edges[i];
  double lo[2], hi[2];
  for (int k = 0; k < 2; k++) {
    lo[k] = fmin(e->a[k], e->b[k]) - TOUCHING * c->step;
    hi[k] = fmax(e->a[k], e->b[k]) + TOUCHING * c->step;
  }
  for (uint32_t at = 0; at < p->box_count;) {
    const zs_polygon_box *box = &p->boxes[at];
    if (box->hi[0] < lo[0] || box->lo[0] > hi[0] || box->hi[1] < lo[1] || box->lo[1] > hi[1]) {
      at = box->skip;
      continue;
    }
    for (uint32_t j = box->first; j < box->first + box->count; j++)
      if (j > i)
        meet(c, i, j);
    at++;
  }
}

static int compare_cuts(const void *a, const void *b)
{
  const cut *p = a, *q = b;
  if (p->edge != q->edge)
    return p->edge < q->edge ? -1 : 1;
  return p->along < q->along ? -1 : p->along > q->along;
}

/* The edges of a polygon, cut. */
static bool apply_cuts(zs_fill *fill, const cutter *c)
{
  size_t next = 0;
  fill->count = 0;
  for (uint32_t i = 0; i < c->polygon->edge_count; i++) {
    const zs_polygon_edge *e = &c->polygon->edges[i];
    const double *from = e->a;
    for (; next < c->count && c->cuts[next].edge == i; next++) {
      if (!zs_fill_add_edge(fill, from, c->cuts[next].point))
        return false;
      from = c->cuts[next].point;
    }
    if (!zs_fill_add_edge(fill, from, e->b))
      return false;
  }
  return true;
}

/* Cut edges where they meet, once; *more: there were any. */
static bool cut_all(zs_fill *fill, double step, bool *more)
{
  zs_arena arena = {0};
  cutter c = {.polygon = zs_polygon_of_edges(&arena, fill->edges, fill->count), .step = step};
  bool done = c.polygon != NULL;
  for (uint32_t i = 0; done && i < c.polygon->edge_count; i++)
    cut_edge(&c, i);
  done = done && !c.failed;
  *more = c.count > 0;
  if (done && c.count) {
    qsort(c.cuts, c.count, sizeof *c.cuts, compare_cuts);
    done = apply_cuts(fill, &c);
  }
  free(c.cuts);
  zs_arena_free(&arena);
  return done;
}

/* ---- What is filled ----------------------------------------------------------------------- */

/* An edge with how often it is run along: `net` more from a to b than back. */
typedef struct bundle {
  double a[2], b[2]; /* a before b, by x, then y */
  int net, total;
} bundle;

static int compare_bundles(const void *a, const void *b)
{
  const bundle *p = a, *q = b;
  const double *const x[4] = {&p->a[0], &p->a[1], &p->b[0], &p->b[1]};
  const double *const y[4] = {&q->a[0], &q->a[1], &q->b[0], &q->b[1]};
  for (int k = 0; k < 4; k++)
    if (*x[k] != *y[k])
      return *x[k] < *y[k] ? -1 : 1;
  return 0;
}

/* Gather edges between the same points; how many there are. */
static size_t gather(const zs_fill *fill, bundle *bundles)
{
  size_t count = 0;
  for (size_t i = 0; i < fill->count; i++) {
    const double *e = fill->edges[i];
    const bool forward = e[0] < e[2] || (e[0] == e[2] && e[1] < e[3]);
    bundles[i] = forward ? (bundle){{e[0], e[1]}, {e[2], e[3]}, 1, 1}
                         : (bundle){{e[2], e[3]}, {e[0], e[1]}, -1, 1};
  }
  qsort(bundles, fill->count, sizeof *bundles, compare_bundles);
  for (size_t i = 0; i < fill->count; i++)
    if (count && compare_bundles(&bundles[count - 1], &bundles[i]) == 0) {
      bundles[count - 1].net += bundles[i].net;
      bundles[count - 1].total++;
    } else {
      bundles[count++] = bundles[i];
    }
  return count;
}

static bool is_between(const zs_polygon_edge *e, const double a[2], const double b[2])
{
  return e->a[0] == a[0] && e->a[1] == a[1] && e->b[0] == b[0] && e->b[1] == b[1];
}

/* How often the edges wind around the point above p that is next to it, and how many pass
 * it, by those to its right; `own` is the edge whose middle p is. */
static void count_right(const zs_polygon *polygon, const double p[2], const bundle *own, int *net,
                        int *total)
{
  *net = *total = 0;
  for (uint32_t at = 0; at < polygon->box_count;) {
    const zs_polygon_box *box = &polygon->boxes[at];
    if (box->hi[0] < p[0] || box->hi[1] < p[1] || box->lo[1] > p[1]) {
      at = box->skip;
      continue;
    }
    for (uint32_t i = box->first; i < box->first + box->count; i++) {
      const zs_polygon_edge *e = &polygon->edges[i];
      const double *a = e->a, *b = e->b;
      const bool up = a[1] <= p[1] && b[1] > p[1], down = a[1] > p[1] && b[1] <= p[1];
      if (!up && !down)
        continue;
      if (is_between(e, own->a, own->b) || is_between(e, own->b, own->a) ||
          a[0] + (p[1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1]) <= p[0])
        continue;
      *net += up ? 1 : -1;
      ++*total;
    }
    at++;
  }
}

static bool is_filled(int net, int total, bool even_odd)
{
  return even_odd ? total % 2 != 0 : net != 0;
}

/* Keep an edge that has the inside on one side alone, along which it then runs with that on
 * its left. */
static bool keep_edge(zs_fill *fill, const zs_polygon *polygon, const bundle *e, bool even_odd)
{
  const double middle[2] = {(e->a[0] + e->b[0]) / 2, (e->a[1] + e->b[1]) / 2};
  int net, total;
  count_right(polygon, middle, e, &net, &total);
  /* To the right of an edge, or above a level one, it does not count; on the other side it
   * does.  From a to b, x grows: the right side is the lower one unless the edge is
   * upright, when b is above a; then it is that of greater x. */
  const bool rising = e->b[1] > e->a[1];
  const bool uncounted = is_filled(net, total, even_odd);
  const bool counted =
    is_filled(rising ? net + e->net : net - e->net, total + e->total, even_odd);
  const bool left = rising ? counted : uncounted, right = rising ? uncounted : counted;
  if (left == right)
    return true;
  return left ? zs_fill_add_edge(fill, e->a, e->b) : zs_fill_add_edge(fill, e->b, e->a);
}

static bool classify(zs_fill *fill, bool even_odd)
{
  zs_arena arena = {0};
  bundle *bundles = malloc(fill->count * sizeof *bundles);
  const zs_polygon *polygon = zs_polygon_of_edges(&arena, fill->edges, fill->count);
  bool done = bundles && polygon;
  if (done) {
    const size_t count = gather(fill, bundles);
    fill->count = 0;
    for (size_t i = 0; done && i < count; i++)
      done = keep_edge(fill, polygon, &bundles[i], even_odd);
  }
  free(bundles);
  zs_arena_free(&arena);
  return done;
}

static int compare_starts(const void *a, const void *b)
{
  const double *p = a, *q = b;
  for (int k = 0; k < 2; k++)
    if (p[k] != q[k])
      return p[k] < q[k] ? -1 : 1;
  return 0;
}

/* Whether as many edges begin at every point as end there; *memory: whether there was
 * enough to find out. */
static bool is_closed(const zs_fill *fill, bool *memory)
{
  double(*starts)[2] = malloc(2 * fill->count * sizeof *starts), (*ends)[2] = starts + fill->count;
  *memory = starts != NULL;
  if (!*memory)
    return false;
  for (size_t i = 0; i < fill->count; i++) {
    memcpy(starts[i], fill->edges[i], sizeof *starts);
    memcpy(ends[i], fill->edges[i] + 2, sizeof *ends);
  }
  qsort(starts, fill->count, sizeof *starts, compare_starts);
  qsort(ends, fill->count, sizeof *ends, compare_starts);
  bool closed = true;
  for (size_t i = 0; closed && i < fill->count; i++)
    closed = compare_starts(starts[i], ends[i]) == 0;
  free(starts);
  return closed;
}

zs_fill_result zs_fill_resolve(zs_fill *fill, bool even_odd)
{
  const double step = step_of(fill);
  bool more = true;
  for (int pass = 0; pass < MOST_PASSES && more; pass++)
    if (!snap(fill, step) || (fill->count && !cut_all(fill, step, &more)))
      return ZS_FILL_MEMORY;
  if (fill->count && !classify(fill, even_odd))
    return ZS_FILL_MEMORY;
  bool memory = true;
  if (fill->count && !is_closed(fill, &memory))
    return memory ? ZS_FILL_UNCLEAR : ZS_FILL_MEMORY;
  return fill->count ? ZS_FILL_DONE : ZS_FILL_EMPTY;
}

/* ---- Rings --------------------------------------------------------------------------------- */

/* The first edge at or behind `from` that begins at a point and has not been used. */
static size_t find_edge(double (*edges)[4], size_t count, const bool *used, const double at[2])
{
  size_t lo = 0, hi = count;
  while (lo < hi) {
    const size_t middle = lo + (hi - lo) / 2;
    if (compare_starts(edges[middle], at) < 0)
      lo = middle + 1;
    else
      hi = middle;
  }
  while (lo < count && used[lo] && compare_starts(edges[lo], at) == 0)
    lo++;
  return lo < count && compare_starts(edges[lo], at) == 0 ? lo : count;
}

bool zs_fill_rings(const zs_fill *fill, double **points, size_t **ends, size_t *rings)
{
  const size_t count = fill->count;
  double(*edges)[4] = malloc((count + 1) * sizeof *edges);
  bool *used = calloc(count + 1, sizeof *used);
  *points = malloc(2 * (count + 1) * sizeof **points);
  *ends = malloc((count + 1) * sizeof **ends);
  *rings = 0;
  const bool memory = edges && used && *points && *ends;
  size_t written = 0;
  if (memory && count) {
    memcpy(edges, fill->edges, count * sizeof *edges);
    qsort(edges, count, sizeof *edges, compare_starts);
  }
  for (size_t first = 0; memory && first < count; first++) {
    const size_t before = written;
    for (size_t at = first; at < count && !used[at];
         at = find_edge(edges, count, used, edges[at] + 2)) {
      used[at] = true;
      memcpy(*points + 2 * written++, edges[at], 2 * sizeof **points);
    }
    if (written > before)
      (*ends)[(*rings)++] = written;
  }
  free(edges);
  free(used);
  if (!memory) {
    free(*points);
    free(*ends);
  }
  return memory;
}
