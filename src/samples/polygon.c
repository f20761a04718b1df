#include "samples/polygon.h"

#include <math.h>
#include <string.h>

enum {
  LEAF = 8,
  /* A region keeps its own edges when they are no more than this: finding among
   * all costs little more than finding among many. */
  MOST_LOCAL = 64
};

/* fmin and fmax are calls, for the sake of NaN that is not met here. */
static double least(double a, double b)
{
  return a < b ? a : b;
}

static double greatest(double a, double b)
{
  return a > b ? a : b;
}

/* ---- The tree of boxes ------------------------------------------------------- */

typedef struct builder {
  zs_polygon_edge *edges;
  zs_polygon_box *boxes;
  uint32_t box_count;
} builder;

static double middle(const zs_polygon_edge *edge, int axis)
{
  return edge->a[axis] + edge->b[axis];
}

static void swap(zs_polygon_edge *a, zs_polygon_edge *b)
{
  zs_polygon_edge c = *a;
  *a = *b;
  *b = c;
}

/* Reorder so that no edge before `k` lies beyond one from `k` on (quickselect). */
static void select_middle(zs_polygon_edge *edges, size_t count, size_t k, int axis)
{
  size_t lo = 0, hi = count - 1;
  while (lo < hi) {
    const double pivot = middle(&edges[lo + (hi - lo) / 2], axis);
    size_t i = lo, j = hi;
    for (;;) {
      while (middle(&edges[i], axis) < pivot)
        i++;
      while (middle(&edges[j], axis) > pivot)
        j--;
      if (i >= j)
        break;
      swap(&edges[i++], &edges[j--]);
    }
    /* Now everything up to j is not beyond the pivot, everything after is not
     * before it. */
    if (k <= j)
      hi = j;
    else
      lo = j + 1;
  }
}

static zs_polygon_box box_of(const zs_polygon_edge *edges, uint32_t count)
{
  zs_polygon_box box = {.lo = {INFINITY, INFINITY}, .hi = {-INFINITY, -INFINITY}};
  for (uint32_t i = 0; i < count; i++)
    for (int k = 0; k < 2; k++) {
      box.lo[k] = least(box.lo[k], least(edges[i].a[k], edges[i].b[k]));
      box.hi[k] = greatest(box.hi[k], greatest(edges[i].a[k], edges[i].b[k]));
    }
  return box;
}

/* Depth is logarithmic: every split is in the middle. */
static void build(builder *b, uint32_t first, uint32_t count)
{
  zs_polygon_box *box = &b->boxes[b->box_count++];
  *box = box_of(b->edges + first, count);
  if (count <= LEAF) {
    box->first = first;
    box->count = count;
  } else {
    int axis = box->hi[1] - box->lo[1] > box->hi[0] - box->lo[0];
    select_middle(b->edges + first, count, count / 2, axis);
    build(b, first, count / 2);
    build(b, first + count / 2, count - count / 2);
  }
  box->skip = b->box_count;
}

/* A polygon without a reference, of edges that it takes over. */
static zs_polygon *with_tree(zs_arena *arena, zs_polygon_edge *edges, uint32_t count)
{
  zs_polygon *polygon = ZS_ARENA_NEW(arena, zs_polygon, 1);
  zs_polygon_box *boxes = ZS_ARENA_NEW(arena, zs_polygon_box, 2 * (size_t)count);
  if (!polygon || !boxes)
    return NULL;
  builder b = {.edges = edges, .boxes = boxes};
  build(&b, 0, count);
  *polygon = (zs_polygon){
    .edges = edges, .boxes = boxes, .edge_count = count, .box_count = b.box_count};
  return polygon;
}

/* Add an edge unless it has no length. */
static void add_edge(zs_polygon_edge *edges, uint32_t *used, const double a[2], const double b[2])
{
  const double x = b[0] - a[0], y = b[1] - a[1], length = hypot(x, y);
  if (length > 0)
    edges[(*used)++] =
      (zs_polygon_edge){{a[0], a[1]}, {b[0], b[1]}, {x / length, y / length}, length};
}

/* ---- Questions ------------------------------------------------------------------ */

static double square(double x)
{
  return x * x;
}

static double cross(double ax, double ay, double bx, double by)
{
  return ax * by - ay * bx;
}

/* Squared distance of a point from a box, 0 inside. */
static double box_distance2(const zs_polygon_box *box, const double p[2])
{
  double dx = greatest(greatest(box->lo[0] - p[0], p[0] - box->hi[0]), 0);
  double dy = greatest(greatest(box->lo[1] - p[1], p[1] - box->hi[1]), 0);
  return dx * dx + dy * dy;
}

static double edge_distance2(const zs_polygon_edge *edge, const double p[2])
{
  const double *e = edge->direction;
  const double x = p[0] - edge->a[0], y = p[1] - edge->a[1];
  const double along = x * e[0] + y * e[1];
  if (along <= 0)
    return x * x + y * y;
  if (along >= edge->length)
    return square(p[0] - edge->b[0]) + square(p[1] - edge->b[1]);
  return square(cross(e[0], e[1], x, y));
}

/* The nearest edge, as far as that is known, its leaf and its squared distance. */
typedef struct nearest {
  uint32_t leaf, edge;
  double distance2;
} nearest;

/* Of the edges of a box, which are none of inner nodes. */
static void look_at_leaf(const zs_polygon *polygon, uint32_t leaf, const double p[2],
                         nearest *best)
{
  const zs_polygon_box *box = &polygon->boxes[leaf];
  for (uint32_t i = box->first; i < box->first + box->count; i++) {
    const double distance2 = edge_distance2(&polygon->edges[i], p);
    if (distance2 < best->distance2)
      *best = (nearest){leaf, i, distance2};
  }
}

/* The leaf that the nearer box leads to, level by level: its distance is a
 * first guess that lets most of the tree be skipped. */
static nearest first_guess(const zs_polygon *polygon, const double p[2])
{
  uint32_t at = 0;
  while (!polygon->boxes[at].count) {
    const uint32_t left = at + 1, right = polygon->boxes[left].skip;
    at = box_distance2(&polygon->boxes[left], p) <= box_distance2(&polygon->boxes[right], p)
           ? left
           : right;
  }
  nearest best = {.distance2 = INFINITY};
  look_at_leaf(polygon, at, p, &best);
  return best;
}

static nearest find_nearest(const zs_polygon *polygon, const double p[2])
{
  nearest best = first_guess(polygon, p);
  for (uint32_t at = 0; at < polygon->box_count;) {
    const zs_polygon_box *box = &polygon->boxes[at];
    if (box_distance2(box, p) >= best.distance2) {
      at = box->skip;
      continue;
    }
    look_at_leaf(polygon, at++, p, &best);
  }
  return best;
}

/* Whether the segment from r to r + d may meet a box. */
static bool segment_meets(const zs_polygon_box *box, const double r[2], const double d[2])
{
  for (int k = 0; k < 2; k++) {
    const double end = r[k] + d[k];
    if (greatest(r[k], end) < box->lo[k] || least(r[k], end) > box->hi[k])
      return false;
  }
  /* All corners strictly on one side of the line? */
  const double c[2] = {(box->lo[0] + box->hi[0]) / 2 - r[0], (box->lo[1] + box->hi[1]) / 2 - r[1]};
  const double h[2] = {(box->hi[0] - box->lo[0]) / 2, (box->hi[1] - box->lo[1]) / 2};
  const double reach = fabs(d[0]) * h[1] + fabs(d[1]) * h[0];
  const double slack = 1e-12 * (fabs(d[0] * c[1]) + fabs(d[1] * c[0]) + reach);
  return fabs(cross(d[0], d[1], c[0], c[1])) <= reach + slack;
}

/* Whether an edge lies between r and r + d.  A vertex on the line counts to its
 * left, and its two edges find the same, so that no crossing is lost or counted
 * twice. */
static bool crosses(const zs_polygon_edge *edge, const double r[2], const double d[2])
{
  const double ax = edge->a[0] - r[0], ay = edge->a[1] - r[1];
  const double bx = edge->b[0] - r[0], by = edge->b[1] - r[1];
  const bool a_left = cross(d[0], d[1], ax, ay) >= 0, b_left = cross(d[0], d[1], bx, by) >= 0;
  if (a_left == b_left)
    return false;
  /* Of the reference, and of the end, relative to the edge. */
  const double from = cross(ax, ay, bx, by);
  const double to = from + cross(bx - ax, by - ay, d[0], d[1]);
  return (from >= 0) != (to >= 0);
}

/* Whether a point is inside, by the edges between a witness and it. */
static bool is_inside_by(const zs_polygon *polygon, const zs_polygon_witness *witness,
                         const double p[2])
{
  const double *r = witness->at, d[2] = {p[0] - r[0], p[1] - r[1]};
  bool inside = witness->inside;
  for (uint32_t at = 0; at < polygon->box_count;) {
    const zs_polygon_box *box = &polygon->boxes[at];
    if (!segment_meets(box, r, d)) {
      at = box->skip;
      continue;
    }
    for (uint32_t i = 0; i < box->count; i++)
      inside ^= crosses(&polygon->edges[box->first + i], r, d);
    at++;
  }
  return inside;
}

/* Between a point and a witness beside the leaf of the nearest edge hardly any edge lies: none is
 * nearer to the point, and the rest of the way is about as short as the leaf is small. */
static bool is_inside(const zs_polygon *polygon, const double p[2], uint32_t leaf)
{
  return is_inside_by(
    polygon, polygon->witnesses ? &polygon->witnesses[leaf] : &polygon->reference, p);
}

/* The direction from an edge to a point; of one that is on it, that to the edge's left, where
 * `crosses` has it. */
static void away_from(const zs_polygon_edge *edge, const double p[2], double distance,
                      double direction[2])
{
  const double *e = edge->direction;
  const double along = (p[0] - edge->a[0]) * e[0] + (p[1] - edge->a[1]) * e[1];
  const double *end = along <= 0 ? edge->a : along >= edge->length ? edge->b : NULL;
  const bool left = cross(e[0], e[1], p[0] - edge->a[0], p[1] - edge->a[1]) >= 0;
  for (int k = 0; k < 2; k++) {
    const double normal = k == 0 ? -e[1] : e[0];
    direction[k] = end && distance > 0 ? (p[k] - end[k]) / distance : left ? normal : -normal;
  }
}

double zs_polygon_distance(const zs_polygon *polygon, double x, double y, double slope[2])
{
  if (slope)
    slope[0] = slope[1] = 0;
  if (isnan(x) || isnan(y))
    return NAN;
  if (isinf(x) || isinf(y))
    return -INFINITY;
  const double p[2] = {x, y};
  const nearest found = find_nearest(polygon, p);
  const double distance = sqrt(found.distance2);
  const bool inside = is_inside(polygon, p, found.leaf);
  if (slope) {
    away_from(&polygon->edges[found.edge], p, distance, slope);
    for (int k = 0; k < 2; k++)
      slope[k] = inside ? slope[k] : -slope[k];
  }
  return inside ? distance : -distance;
}

/* The part of [lo, hi] that is near the polygon, or its nearest end: in blocks
 * that reach far away, single precision must be best where the edges are. */
static void near_part(const zs_polygon *polygon, int axis, double *lo, double *hi)
{
  const zs_polygon_box *all = &polygon->boxes[0];
  const double size = greatest(all->hi[0] - all->lo[0], all->hi[1] - all->lo[1]);
  const double first = all->lo[axis] - size, last = all->hi[axis] + size;
  if (*hi < first) {
    *lo = *hi;
  } else if (*lo > last) {
    *hi = *lo;
  } else {
    *lo = greatest(*lo, first);
    *hi = least(*hi, last);
  }
}

/* Of a few points of a rectangle the first that is well clear of all edges, or the clearest:
 * the side of one that lies on an edge would be a matter of rounding.  In single precision. */
static nearest find_clear_point(const zs_polygon *polygon, const double lo[2], const double hi[2],
                                double clear[2])
{
  static const double spots[][2] = {
    {0.5, 0.5}, {0.31, 0.36}, {0.69, 0.64}, {0.34, 0.72}, {0.7, 0.27}};
  const double enough = 0.01 * hypot(hi[0] - lo[0], hi[1] - lo[1]);
  nearest clearest = {.distance2 = -1};
  for (size_t i = 0; i < sizeof spots / sizeof spots[0] && clearest.distance2 < enough * enough;
       i++) {
    double p[2];
    for (int k = 0; k < 2; k++)
      p[k] = (float)(lo[k] + spots[i][k] * (hi[k] - lo[k]));
    const nearest found = find_nearest(polygon, p);
    if (found.distance2 > clearest.distance2) {
      clearest = found;
      memcpy(clear, p, sizeof p);
    }
  }
  return clearest;
}

zs_polygon_view zs_polygon_look(const zs_polygon *polygon, const double lo[2], const double hi[2])
{
  double from[2] = {lo[0], lo[1]}, to[2] = {hi[0], hi[1]};
  for (int k = 0; k < 2; k++)
    near_part(polygon, k, &from[k], &to[k]);
  zs_polygon_view view;
  const nearest clearest = find_clear_point(polygon, from, to, view.centre);
  /* A point of the box is at most `across` from the centre: its nearest edge is
   * no farther than that of the centre + across from the point. */
  const double *c = view.centre;
  const double across =
    hypot(greatest(hi[0] - c[0], c[0] - lo[0]), greatest(hi[1] - c[1], c[1] - lo[1]));
  view.reach = (sqrt(clearest.distance2) + 2 * across) * (1 + 1e-6);
  view.inside = is_inside(polygon, view.centre, clearest.leaf);
  return view;
}

/* ---- Polygons ------------------------------------------------------------------- */

/* A witness beside the edges of a leaf, by the one of the leaf before. */
static zs_polygon_witness find_witness(const zs_polygon *polygon, const zs_polygon_box *leaf,
                                       const zs_polygon_witness *before)
{
  double lo[2], hi[2];
  const double side = greatest(leaf->hi[0] - leaf->lo[0], leaf->hi[1] - leaf->lo[1]);
  for (int k = 0; k < 2; k++) { /* edges along an axis have boxes without a width */
    lo[k] = (leaf->lo[k] + leaf->hi[k] - side) / 2;
    hi[k] = lo[k] + side;
  }
  zs_polygon_witness witness;
  const nearest clearest = find_clear_point(polygon, lo, hi, witness.at);
  if (clearest.distance2 < square(1e-6 * side))
    return *before;
  witness.inside = is_inside_by(polygon, before, witness.at);
  return witness;
}

/* Find the witnesses of all leaves, of which each is near the one before; false when memory is
 * out. */
static bool add_witnesses(zs_polygon *polygon, zs_arena *arena)
{
  zs_polygon_witness *witnesses = ZS_ARENA_NEW(arena, zs_polygon_witness, polygon->box_count);
  const zs_polygon_witness *before = &polygon->reference;
  for (uint32_t i = 0; witnesses && i < polygon->box_count; i++)
    if (polygon->boxes[i].count) {
      witnesses[i] = find_witness(polygon, &polygon->boxes[i], before);
      before = &witnesses[i];
    }
  polygon->witnesses = witnesses;
  return witnesses;
}

static const zs_polygon *finished(zs_arena *arena, zs_polygon_edge *edges, uint32_t count)
{
  zs_polygon *polygon = count ? with_tree(arena, edges, count) : NULL;
  if (!polygon)
    return NULL;
  /* Well outside, and on no line that an author's polygon is likely to have. */
  const zs_polygon_box *all = &polygon->boxes[0];
  const double size = greatest(all->hi[0] - all->lo[0], all->hi[1] - all->lo[1]);
  polygon->reference.at[0] = (float)(all->lo[0] - 0.618 * size);
  polygon->reference.at[1] = (float)(all->lo[1] - 0.271 * size);
  return count <= MOST_LOCAL || add_witnesses(polygon, arena) ? polygon : NULL;
}

const zs_polygon *zs_polygon_new(zs_arena *arena, const double *points, size_t count)
{
  zs_polygon_edge *edges =
    count <= UINT32_MAX / 4 ? ZS_ARENA_NEW(arena, zs_polygon_edge, count) : NULL;
  uint32_t used = 0;
  for (size_t i = 0; edges && i < count; i++)
    add_edge(edges, &used, points + 2 * i, points + 2 * ((i + 1) % count));
  return finished(arena, edges, used);
}

const zs_polygon *zs_polygon_of_edges(zs_arena *arena, double (*list)[4], size_t count)
{
  zs_polygon_edge *edges =
    count <= UINT32_MAX / 4 ? ZS_ARENA_NEW(arena, zs_polygon_edge, count) : NULL;
  uint32_t used = 0;
  for (size_t i = 0; edges && i < count; i++)
    add_edge(edges, &used, list[i], list[i] + 2);
  return finished(arena, edges, used);
}

/* ---- The operation ------------------------------------------------------------- */

static double reference(const void *data, const double in[])
{
  return zs_polygon_distance(data, in[0], in[1], NULL);
}

/* The edges that matter in a box, from where they are counted. */
static const void *restricted(const void *data, const float lo[], const float hi[],
                              zs_arena *arena)
{
  const zs_polygon *polygon = data;
  const double from[2] = {lo[0], lo[1]}, to[2] = {hi[0], hi[1]};
  if (!isfinite(from[0] + from[1] + to[0] + to[1]))
    return polygon;
  const zs_polygon_view view = zs_polygon_look(polygon, from, to);
  const double reach2 = view.reach * view.reach;
  const uint32_t fewer = polygon->edge_count - polygon->edge_count / 4;
  const uint32_t limit = fewer < MOST_LOCAL ? fewer : MOST_LOCAL;
  const zs_arena_mark mark = zs_arena_mark_here(arena);
  zs_polygon_edge *edges = ZS_ARENA_NEW(arena, zs_polygon_edge, limit);
  uint32_t used = 0;
  for (uint32_t at = 0; edges && at < polygon->box_count;) {
    const zs_polygon_box *box = &polygon->boxes[at];
    if (box_distance2(box, view.centre) > reach2) {
      at = box->skip;
      continue;
    }
    for (uint32_t i = 0; i < box->count; i++) {
      const zs_polygon_edge *edge = &polygon->edges[box->first + i];
      if (edge_distance2(edge, view.centre) > reach2)
        continue;
      if (used == limit) {
        zs_arena_rewind(arena, mark);
        return polygon;
      }
      edges[used++] = *edge;
    }
    at++;
  }
  zs_polygon *part = edges && used ? with_tree(arena, edges, used) : NULL;
  if (!part) {
    zs_arena_rewind(arena, mark);
    return polygon;
  }
  part->reference =
    (zs_polygon_witness){{view.centre[0], view.centre[1]}, view.inside};
  return part;
}

ZS_DEFINE_KERNEL_TABLE(zs_polygon_kernels)

const zs_operation zs_polygon_operation = {.name = "polygon",
                                           .arity = 2,
                                           .kernels = zs_polygon_kernels_table,
                                           .reference = reference,
                                           .restricted = restricted};
