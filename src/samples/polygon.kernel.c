/* Block, gradient and bounds kernels of the polygon's distance.  Compiled once
 * per instruction set. */
#include "samples/polygon.h"

#include <math.h>

/* Farther out than this the distance no longer changes: its square must fit
 * into single precision. */
static const float FAR = 1e17f;

enum {
  FEW = 16,  /* polygons of no more edges are looked at whole */
  MANY = 800 /* points that more edges could be nearest to are better looked at one by one */
};

typedef struct block {
  unsigned n;
  /* Points relative to the centre. */
  _Alignas(64) float x[ZS_BLOCK], y[ZS_BLOCK];
  /* Squared distance of the nearest edge so far, and the direction from it. */
  _Alignas(64) float distance2[ZS_BLOCK], dx[ZS_BLOCK], dy[ZS_BLOCK];
  /* Edges between the centre and the point, modulo 2. */
  _Alignas(64) int32_t odd[ZS_BLOCK];
} block;

static inline float clamped(float x)
{
  return x > FAR ? FAR : x < -FAR ? -FAR : x;
}

/* An edge, prepared for one centre.  Everything that cancels is worked out in
 * double precision, so that single precision loses nothing near the centre even
 * of long edges. */
typedef struct edge {
  float ax, ay, bx, by; /* relative to the centre */
  float ex, ey;         /* b - a, of length 1 */
  float line;           /* the centre's signed distance from the line */
  float start, length;  /* where the centre falls along the edge from a; its length */
} edge;

static edge prepared(const zs_polygon_edge *from, const double c[2])
{
  const double ax = from->a[0] - c[0], ay = from->a[1] - c[1];
  const double bx = from->b[0] - c[0], by = from->b[1] - c[1];
  const double ex = from->direction[0], ey = from->direction[1];
  return (edge){.ax = (float)ax,
                .ay = (float)ay,
                .bx = (float)bx,
                .by = (float)by,
                .ex = (float)ex,
                .ey = (float)ey,
                .line = (float)(ey * ax - ex * ay),
                .start = (float)-(ax * ex + ay * ey),
                .length = (float)from->length};
}

/* The signed distance of a point from an edge's line, and where it falls along
 * the edge. */
#define PLACE(e, x, y) \
  const float across = (e).line + ((e).ex * (y) - (e).ey * (x)); \
  const float along = (e).start + ((e).ex * (x) + (e).ey * (y)); \
  const int before = along <= 0, after = along >= (e).length; \
  /* From the nearer end. */ \
  const float ux = (x) - (before ? (e).ax : (e).bx), uy = (y) - (before ? (e).ay : (e).by); \
  const float end2 = ux * ux + uy * uy; \
  const float distance2 = before || after ? end2 : across * across; \
  /* Whether the edge lies between the centre and the point: its ends are on      \
   * different sides of the way, and these two on different sides of it. */ \
  const int a_left = (x) * (e).ay - (y) * (e).ax >= 0; \
  const int b_left = (x) * (e).by - (y) * (e).bx >= 0; \
  const int crossed = (a_left != b_left) & (((e).line >= 0) != (across >= 0));

static void add_edge(block *restrict b, edge e)
{
  const unsigned n = b->n;
#pragma omp simd
  for (unsigned i = 0; i < n; i++) {
    PLACE(e, b->x[i], b->y[i])
    b->distance2[i] = distance2 < b->distance2[i] ? distance2 : b->distance2[i];
    b->odd[i] ^= crossed;
  }
}

static void add_edge_with_direction(block *restrict b, edge e)
{
  const unsigned n = b->n;
#pragma omp simd
  for (unsigned i = 0; i < n; i++) {
    PLACE(e, b->x[i], b->y[i])
    b->odd[i] ^= crossed;
    /* On the line itself, or at an end, the side on which `across >= 0` holds
     * is what the sign is counted with. */
    const float side = across >= 0 ? 1.0f : -1.0f;
    const int end = (before || after) && end2 > 0;
    const float scale = 1 / sqrtf(end ? end2 : 1);
    const float gx = end ? ux * scale : -side * e.ey;
    const float gy = end ? uy * scale : side * e.ex;
    const int nearer = distance2 < b->distance2[i];
    b->distance2[i] = nearer ? distance2 : b->distance2[i];
    b->dx[i] = nearer ? gx : b->dx[i];
    b->dy[i] = nearer ? gy : b->dy[i];
  }
}

/* Take a block's points relative to a centre. */
static void place(block *b, const float *x, const float *y, const double centre[2])
{
  const float cx = (float)centre[0], cy = (float)centre[1];
  const unsigned n = b->n;
#pragma omp simd
  for (unsigned i = 0; i < n; i++) {
    b->x[i] = clamped(x[i]) - cx;
    b->y[i] = clamped(y[i]) - cy;
    b->distance2[i] = INFINITY;
    b->dx[i] = b->dy[i] = 0;
    b->odd[i] = 0;
  }
}

/* The box around a block's points, those that are not numbers left out. */
static void extent(const float *x, unsigned n, double *lo, double *hi)
{
  float least = FAR, greatest = -FAR;
  for (unsigned i = 0; i < n; i++) {
    const float v = clamped(x[i]);
    least = v < least ? v : least;
    greatest = v > greatest ? v : greatest;
  }
  *lo = least <= greatest ? (double)least : 0;
  *hi = least <= greatest ? (double)greatest : 0;
}

static double gap2_of(const zs_polygon_box *box, const double p[2])
{
  double gap2 = 0;
  for (int k = 0; k < 2; k++) {
    const double below = box->lo[k] - p[k], above = p[k] - box->hi[k];
    const double d = below > 0 ? below : above > 0 ? above : 0;
    gap2 += d * d;
  }
  return gap2;
}

/* Whether many edges lie in a rectangle, about, each of which may be nearest to a point there. */
static bool is_crowded(const zs_polygon *polygon, const double lo[2], const double hi[2])
{
  uint32_t count = 0;
  for (uint32_t at = 0; at < polygon->box_count && count <= MANY;) {
    const zs_polygon_box *box = &polygon->boxes[at];
    const bool meets = box->lo[0] <= hi[0] && box->hi[0] >= lo[0] && box->lo[1] <= hi[1] &&
                       box->hi[1] >= lo[1];
    count += meets ? box->count : 0;
    at = meets ? at + 1 : box->skip;
  }
  return count > MANY;
}

/* Where a block's points are looked at from; false when that should be done one by one. */
static bool find_view(const zs_polygon *polygon, const float *x, const float *y, unsigned n,
                      zs_polygon_view *view)
{
  if (polygon->edge_count <= FEW) {
    const zs_polygon_witness *reference = &polygon->reference;
    *view = (zs_polygon_view){{reference->at[0], reference->at[1]}, INFINITY, reference->inside};
    return true;
  }
  double lo[2], hi[2];
  extent(x, n, &lo[0], &hi[0]);
  extent(y, n, &lo[1], &hi[1]);
  if (polygon->edge_count > MANY && is_crowded(polygon, lo, hi))
    return false;
  *view = zs_polygon_look(polygon, lo, hi);
  return true;
}

static void work_out(block *b, const zs_polygon *polygon, const zs_polygon_view *view,
                     const float *x, const float *y, void (*add)(block *restrict, edge))
{
  place(b, x, y, view->centre);
  for (uint32_t at = 0; at < polygon->box_count;) {
    const zs_polygon_box *box = &polygon->boxes[at];
    if (gap2_of(box, view->centre) > view->reach * view->reach) {
      at = box->skip;
      continue;
    }
    for (uint32_t i = 0; i < box->count; i++)
      add(b, prepared(&polygon->edges[box->first + i], view->centre));
    at++;
  }
}

static void value(const zs_block_arguments *a)
{
  const zs_polygon *polygon = a->data;
  const float *x = a->in[0], *y = a->in[1];
  float *out = a->out;
  zs_polygon_view view;
  if (!find_view(polygon, x, y, a->n, &view)) {
    for (unsigned i = 0; i < a->n; i++)
      out[i] = (float)zs_polygon_distance(polygon, (double)clamped(x[i]), (double)clamped(y[i]),
                                          NULL);
    return;
  }
  block b;
  b.n = a->n;
  work_out(&b, polygon, &view, x, y, add_edge);
#pragma omp simd
  for (unsigned i = 0; i < b.n; i++) {
    const float distance = sqrtf(b.distance2[i]) + 0 * (b.x[i] + b.y[i]); /* keeps NaN */
    out[i] = b.odd[i] ^ view.inside ? distance : -distance;
  }
}

/* f and its derivatives by x and y, in the block's own arrays. */
static void find_slopes(block *b, const zs_polygon *polygon, const float *x, const float *y)
{
  zs_polygon_view view;
  if (!find_view(polygon, x, y, b->n, &view)) {
    for (unsigned i = 0; i < b->n; i++) {
      double slope[2];
      b->x[i] = (float)zs_polygon_distance(polygon, (double)clamped(x[i]), (double)clamped(y[i]),
                                           slope);
      b->dx[i] = (float)slope[0];
      b->dy[i] = (float)slope[1];
    }
    return;
  }
  work_out(b, polygon, &view, x, y, add_edge_with_direction);
  const unsigned n = b->n;
#pragma omp simd
  for (unsigned i = 0; i < n; i++) {
    const float sign = b->odd[i] ^ view.inside ? 1.0f : -1.0f;
    b->x[i] = sign * (sqrtf(b->distance2[i]) + 0 * (b->x[i] + b->y[i]));
    b->dx[i] *= sign;
    b->dy[i] *= sign;
  }
}

static void gradient(const zs_block_arguments *a)
{
  block b;
  b.n = a->n;
  const float *x = a->in[0], *y = a->in[1];
  find_slopes(&b, a->data, x, y);
  float *out = a->out;
#pragma omp simd
  for (unsigned i = 0; i < b.n; i++) {
    const float dx = b.dx[i], dy = b.dy[i];
    const float gx = dx * x[ZS_BLOCK + i] + dy * y[ZS_BLOCK + i];
    const float gy = dx * x[2 * ZS_BLOCK + i] + dy * y[2 * ZS_BLOCK + i];
    const float gz = dx * x[3 * ZS_BLOCK + i] + dy * y[3 * ZS_BLOCK + i];
    out[i] = b.x[i];
    out[ZS_BLOCK + i] = gx;
    out[2 * ZS_BLOCK + i] = gy;
    out[3 * ZS_BLOCK + i] = gz;
  }
}

/* The distance changes no faster than the point moves. */
static void bounds(const zs_bounds_arguments *a)
{
  const zs_polygon *polygon = a->data;
  for (unsigned l = 0; l < ZS_LANES; l++) {
    const double lo[2] = {a->in[0]->lo[l], a->in[1]->lo[l]};
    const double hi[2] = {a->in[0]->hi[l], a->in[1]->hi[l]};
    float f_lo = NAN, f_hi = NAN;
    if (isfinite(lo[0] + lo[1] + hi[0] + hi[1])) {
      const double x = (lo[0] + hi[0]) / 2, y = (lo[1] + hi[1]) / 2;
      const double radius = hypot(hi[0] - lo[0], hi[1] - lo[1]) / 2;
      const double f = zs_polygon_distance(polygon, x, y, NULL);
      /* Blocks are as exact as single precision is at the distance from the
       * point that they count from. */
      const double *from = polygon->reference.at, away = hypot(x - from[0], y - from[1]);
      const double slack = 1e-6 * (fabs(f) + radius + away);
      f_lo = (float)(f - radius - slack);
      f_hi = (float)(f + radius + slack);
    }
    a->out->lo[l] = f_lo;
    a->out->hi[l] = f_hi;
  }
}

const zs_kernels ZS_KERNELS(zs_polygon_kernels) = {value, gradient, bounds};
