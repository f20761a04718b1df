#include "samples/triangles.h"

#include "base/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  LEAF = 4,
  /* A region keeps its own triangles when they are no more than this. */
  MOST_LOCAL = 512,
  /* Regional boxes look at no more than these to find that out. */
  MOST_LOOKED_AT = 4 * MOST_LOCAL
};

static double least(double a, double b)
{
  return a < b ? a : b;
}

static double greatest(double a, double b)
{
  return a > b ? a : b;
}

/* ---- The tree of boxes ------------------------------------------------------------- */

typedef struct builder {
  zs_triangle *triangles;
  zs_triangle_box *boxes;
  uint32_t box_count;
} builder;

/* Three times the middle, along an axis. */
static double middle(const zs_triangle *t, int axis)
{
  return 3 * t->a[axis] + t->ab[axis] + t->ac[axis];
}

static void swap(zs_triangle *a, zs_triangle *b)
{
  zs_triangle c = *a;
  *a = *b;
  *b = c;
}

/* Reorder so that no triangle before `k` lies beyond one from `k` on (quickselect). */
static void select_middle(zs_triangle *t, size_t count, size_t k, int axis)
{
  size_t lo = 0, hi = count - 1;
  while (lo < hi) {
    const double pivot = middle(&t[lo + (hi - lo) / 2], axis);
    size_t i = lo, j = hi;
    for (;;) {
      while (middle(&t[i], axis) < pivot)
        i++;
      while (middle(&t[j], axis) > pivot)
        j--;
      if (i >= j)
        break;
      swap(&t[i++], &t[j--]);
    }
    if (k <= j)
      hi = j;
    else
      lo = j + 1;
  }
}

static zs_triangle_box box_of(const zs_triangle *triangles, uint32_t count)
{
  zs_triangle_box box = {.lo = {INFINITY, INFINITY, INFINITY},
                         .hi = {-INFINITY, -INFINITY, -INFINITY}};
  for (uint32_t i = 0; i < count; i++)
    for (int k = 0; k < 3; k++) {
      const zs_triangle *t = &triangles[i];
      const double a = t->a[k], b = a + t->ab[k], c = a + t->ac[k];
      box.lo[k] = least(box.lo[k], least(a, least(b, c)));
      box.hi[k] = greatest(box.hi[k], greatest(a, greatest(b, c)));
    }
  return box;
}

/* Depth is logarithmic: every split is in the middle.  There are fewer boxes than triangles,
 * or one. */
static void build(builder *b, uint32_t first, uint32_t count)
{
  zs_triangle_box *box = &b->boxes[b->box_count++];
  *box = box_of(b->triangles + first, count);
  if (count <= LEAF) {
    box->first = first;
    box->count = count;
  } else {
    int axis = 0;
    for (int k = 1; k < 3; k++)
      if (box->hi[k] - box->lo[k] > box->hi[axis] - box->lo[axis])
        axis = k;
    select_middle(b->triangles + first, count, count / 2, axis);
    build(b, first, count / 2);
    build(b, first + count / 2, count - count / 2);
  }
  box->skip = b->box_count;
}

/* ---- The surface ------------------------------------------------------------------------ */

static zs_triangle triangle_of(const double *positions, const uint32_t corner[3])
{
  zs_triangle t = {.corner = {corner[0], corner[1], corner[2]}};
  const double *a = positions + 3 * (size_t)corner[0];
  memcpy(t.a, a, sizeof t.a);
  zs_subtract3(positions + 3 * (size_t)corner[1], a, t.ab);
  zs_subtract3(positions + 3 * (size_t)corner[2], a, t.ac);
  zs_cross3(t.ab, t.ac, t.normal);
  const double length = sqrt(zs_dot3(t.normal, t.normal));
  /* Of a sliver that is nothing but rounding, the normal would be too. */
  const bool flat = !(length > 1e-13 * (zs_dot3(t.ab, t.ab) + zs_dot3(t.ac, t.ac)));
  for (int k = 0; k < 3; k++)
    t.normal[k] = flat ? 0 : t.normal[k] / length;
  return t;
}

/* The side of a right-angled triangle of the mean area. */
static double typical_side(const zs_triangle *triangles, uint32_t count)
{
  double area2 = 0;
  for (uint32_t i = 0; i < count; i++) {
    double normal[3];
    zs_cross3(triangles[i].ab, triangles[i].ac, normal);
    area2 += sqrt(zs_dot3(normal, normal));
  }
  return sqrt(area2 / count);
}

zs_triangles *zs_triangles_new(double *positions, const uint32_t *corners, size_t count)
{
  zs_triangles *s = calloc(1, sizeof *s);
  zs_triangle *triangles = malloc((count + 1) * sizeof *triangles);
  zs_triangle_box *boxes = malloc((count + 1) * sizeof *boxes);
  uint32_t used = 0;
  for (size_t i = 0; triangles && count <= UINT32_MAX / 4 && i < count; i++) {
    const uint32_t *c = corners + 3 * i;
    if (c[0] != c[1] && c[1] != c[2] && c[2] != c[0])
      triangles[used++] = triangle_of(positions, c);
  }
  if (!s || !triangles || !boxes || !used) {
    free(s);
    free(triangles);
    free(boxes);
    free(positions);
    return NULL;
  }
  builder b = {.triangles = triangles, .boxes = boxes};
  build(&b, 0, used);
  *s = (zs_triangles){.triangles = triangles,
                      .boxes = boxes,
                      .count = used,
                      .box_count = b.box_count,
                      .positions = positions,
                      .side = typical_side(triangles, used),
                      .whole = s};
  return s;
}

void zs_triangles_free(void *triangles)
{
  zs_triangles *s = triangles;
  if (!s)
    return;
  free((void *)s->triangles);
  free((void *)s->boxes);
  free((void *)s->positions);
  free(s);
}

/* ---- Questions ------------------------------------------------------------------------------ */

/* Squared distance of a point from a box, 0 inside. */
static double box_distance2(const zs_triangle_box *box, const double p[3])
{
  double sum = 0;
  for (int k = 0; k < 3; k++) {
    const double below = box->lo[k] - p[k], above = p[k] - box->hi[k];
    const double d = greatest(greatest(below, above), 0);
    sum += d * d;
  }
  return sum;
}

/* The weights of b and c in the nearest point of a triangle's border, or -1 when it is within
 * (Ericson, "Real-time collision detection", 2005, 5.1.5). */
static void nearest_weights(const zs_triangle *t, const double ap[3], double *v, double *w)
{
  const double d1 = zs_dot3(t->ab, ap), d2 = zs_dot3(t->ac, ap);
  *v = *w = 0;
  if (d1 <= 0 && d2 <= 0)
    return;
  const double bb = zs_dot3(t->ab, t->ab), bc = zs_dot3(t->ab, t->ac), cc = zs_dot3(t->ac, t->ac);
  const double d3 = d1 - bb, d4 = d2 - bc, d5 = d1 - bc, d6 = d2 - cc;
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (d3 >= 0 && d4 <= d3) {
    *v = 1;
  } else if (d6 >= 0 && d5 <= d6) {
    *w = 1;
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    *v = d1 / (d1 - d3);
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    *w = d2 / (d2 - d6);
  } else if (va <= 0 && d4 >= d3 && d5 >= d6) {
    *w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    *v = 1 - *w;
  } else {
    *v = -1;
  }
}

/* The way to a point from the nearest point of an edge that begins at the origin. */
static double edge_distance2(const double p[3], const double edge[3], double from[3])
{
  const double square = zs_dot3(edge, edge), along = zs_dot3(p, edge);
  const double t = along <= 0 || square == 0 ? 0 : along >= square ? 1 : along / square;
  for (int k = 0; k < 3; k++)
    from[k] = p[k] - t * edge[k];
  return zs_dot3(from, from);
}

/* Of a triangle without an area, which is no more than its edges. */
static double line_distance2(const zs_triangle *t, const double ap[3], double from[3])
{
  double bp[3], bc[3], other[3];
  zs_subtract3(ap, t->ab, bp);
  zs_subtract3(t->ac, t->ab, bc);
  double best = edge_distance2(ap, t->ab, from);
  for (int i = 0; i < 2; i++) {
    const double d = i ? edge_distance2(bp, bc, other) : edge_distance2(ap, t->ac, other);
    if (d < best) {
      best = d;
      memcpy(from, other, sizeof other);
    }
  }
  return best;
}

double zs_triangle_distance2(const zs_triangle *t, const double p[3], double from[3])
{
  double ap[3], v, w;
  zs_subtract3(p, t->a, ap);
  if (zs_dot3(t->normal, t->normal) == 0)
    return line_distance2(t, ap, from);
  nearest_weights(t, ap, &v, &w);
  const double height = v < 0 ? zs_dot3(t->normal, ap) : 0;
  for (int k = 0; k < 3; k++)
    from[k] = v < 0 ? height * t->normal[k] : ap[k] - v * t->ab[k] - w * t->ac[k];
  return zs_dot3(from, from);
}

uint32_t zs_triangles_guess(const zs_triangles *s, const double p[3])
{
  uint32_t at = 0;
  while (!s->boxes[at].count) {
    const uint32_t left = at + 1, right = s->boxes[left].skip;
    at = box_distance2(&s->boxes[left], p) <= box_distance2(&s->boxes[right], p) ? left : right;
  }
  return s->boxes[at].first;
}

/* A box that is still to be looked into. */
typedef struct entry {
  uint32_t box;
  double distance2;
} entry;

uint32_t zs_triangles_nearest(const zs_triangles *s, const double p[3], uint32_t guess)
{
  enum { DEEPEST = 64 }; /* more than the depth of the tree: every split is in the middle */
  entry stack[DEEPEST] = {{0, box_distance2(&s->boxes[0], p)}};
  double from[3], best = zs_triangle_distance2(&s->triangles[guess], p, from);
  uint32_t nearest = guess;
  for (unsigned depth = 1; depth > 0;) {
    const entry top = stack[--depth];
    const zs_triangle_box *box = &s->boxes[top.box];
    if (top.distance2 >= best)
      continue;
    for (uint32_t i = box->first; i < box->first + box->count; i++) {
      const double distance2 = zs_triangle_distance2(&s->triangles[i], p, from);
      if (distance2 < best) {
        best = distance2;
        nearest = i;
      }
    }
    if (box->count)
      continue;
    const uint32_t left = top.box + 1, right = s->boxes[left].skip;
    const entry a = {left, box_distance2(&s->boxes[left], p)};
    const entry b = {right, box_distance2(&s->boxes[right], p)};
    const bool first = a.distance2 < b.distance2; /* look into the nearer one first */
    stack[depth++] = first ? b : a;
    stack[depth++] = first ? a : b;
  }
  return nearest;
}

static double unsigned_distance(const zs_triangles *s, const double p[3])
{
  double from[3];
  const uint32_t nearest = zs_triangles_nearest(s, p, zs_triangles_guess(s, p));
  return sqrt(zs_triangle_distance2(&s->triangles[nearest], p, from));
}

/* ---- Sides ----------------------------------------------------------------------------- */

/* A corner, seen along z from a point. */
typedef struct seen {
  double x, y, z;
  uint32_t vertex;
} seen;

/* Where an edge that reaches from one side of y = 0 to the other passes it.  Found from its
 * lower vertex by number, so that all triangles at an edge find the same. */
static void pass(const seen *a, const seen *b, double *x, double *z)
{
  const seen *p = a->vertex < b->vertex ? a : b, *q = p == a ? b : a;
  const double t = p->y / (p->y - q->y);
  *x = p->x + t * (q->x - p->x);
  *z = p->z + t * (q->z - p->z);
}

/* How often a triangle winds around the ray from a point along z.  Summed over a closed
 * surface without regard to z that is 0 to the bit: what counts is where edges pass, and
 * each is met as often one way as the other. */
static int winding(const double *positions, const zs_triangle *t, const double p[3])
{
  seen corner[3];
  for (int i = 0; i < 3; i++) {
    const double *at = positions + 3 * (size_t)t->corner[i];
    corner[i] = (seen){at[0] - p[0], at[1] - p[1], at[2] - p[2], t->corner[i]};
  }
  int turns = 0;
  double x[2] = {0, 0}, z[2] = {0, 0};
  for (int i = 0; i < 3; i++) {
    const seen *a = &corner[i], *b = &corner[(i + 1) % 3];
    const bool up = a->y < 0 && b->y >= 0, down = a->y >= 0 && b->y < 0;
    if (!up && !down)
      continue;
    pass(a, b, &x[down], &z[down]);
    turns += x[down] > 0 ? (up ? 1 : -1) : 0;
  }
  if (turns == 0)
    return 0;
  /* Between the two edges, where x is 0. */
  const double s = x[0] / (x[0] - x[1]);
  return z[0] + s * (z[1] - z[0]) > 0 ? turns : 0;
}

bool zs_triangles_inside(const zs_triangles *part, const double p[3])
{
  const zs_triangles *s = part->whole;
  int turns = 0;
  for (uint32_t at = 0; at < s->box_count;) {
    const zs_triangle_box *box = &s->boxes[at];
    if (p[0] < box->lo[0] || p[0] > box->hi[0] || p[1] < box->lo[1] || p[1] > box->hi[1] ||
        p[2] > box->hi[2]) {
      at = box->skip;
      continue;
    }
    for (uint32_t i = 0; i < box->count; i++)
      turns += winding(s->positions, &s->triangles[box->first + i], p);
    at++;
  }
  return turns > 0;
}

double zs_triangles_distance(const zs_triangles *s, const double p[3])
{
  for (int k = 0; k < 3; k++)
    if (isnan(p[k]))
      return NAN;
  if (isinf(p[0]) || isinf(p[1]) || isinf(p[2]))
    return -INFINITY;
  const double distance = unsigned_distance(s, p);
  return zs_triangles_inside(s, p) ? distance : -distance;
}

/* ---- The operation ----------------------------------------------------------------------- */

static double reference(const void *data, const double in[])
{
  return zs_triangles_distance(data, in);
}

/* Copy the triangles that are no farther from a point than `reach`; how many there are, or
 * more than `limit` when that is too little. */
static uint32_t collect(const zs_triangles *s, const double centre[3], double reach,
                        zs_triangle *out, uint32_t limit)
{
  const double reach2 = reach * reach;
  uint32_t used = 0, looked_at = 0;
  for (uint32_t at = 0; at < s->box_count;) {
    const zs_triangle_box *box = &s->boxes[at];
    if (box_distance2(box, centre) > reach2) {
      at = box->skip;
      continue;
    }
    if ((looked_at += box->count) > MOST_LOOKED_AT)
      return limit + 1;
    for (uint32_t i = 0; i < box->count; i++) {
      double from[3];
      if (zs_triangle_distance2(&s->triangles[box->first + i], centre, from) > reach2)
        continue;
      if (used == limit)
        return limit + 1;
      out[used++] = s->triangles[box->first + i];
    }
    at++;
  }
  return used;
}

/* The triangles that can be nearest to a point of a box.  A point of it is at most `half`,
 * half the diagonal, from its centre, and so is no farther from the surface than the centre
 * and `half`. */
static const void *restricted(const void *data, const float lo[], const float hi[],
                              zs_arena *arena)
{
  const zs_triangles *s = data;
  double centre[3], half = 0;
  for (int k = 0; k < 3; k++) {
    const double side = (double)hi[k] - (double)lo[k];
    centre[k] = (double)lo[k] + side / 2;
    half += side * side / 4;
  }
  half = sqrt(half);
  if (!isfinite(half + centre[0] + centre[1] + centre[2]))
    return s;
  const uint32_t fewer = s->count - s->count / 4;
  const uint32_t limit = fewer < MOST_LOCAL ? fewer : MOST_LOCAL;
  const zs_arena_mark mark = zs_arena_mark_here(arena);
  zs_triangles *part = ZS_ARENA_NEW(arena, zs_triangles, 1);
  zs_triangle *triangles = zs_arena_reserve(arena, limit + 1, sizeof *triangles);
  zs_triangle_box *boxes = zs_arena_reserve(arena, limit + 1, sizeof *boxes);
  const double reach = (unsigned_distance(s, centre) + 2 * half) * (1 + 1e-9);
  const uint32_t used =
    part && triangles && boxes ? collect(s, centre, reach, triangles, limit) : limit + 1;
  if (used > limit || used == 0) {
    zs_arena_rewind(arena, mark);
    return s;
  }
  builder b = {.triangles = triangles, .boxes = boxes};
  build(&b, 0, used);
  *part = *s;
  part->triangles = triangles;
  part->boxes = boxes;
  part->count = used;
  part->box_count = b.box_count;
  return part;
}

ZS_DEFINE_KERNEL_TABLE(zs_triangles_kernels)

const zs_operation zs_triangles_operation = {.name = "triangles",
                                             .arity = 3,
                                             .kernels = zs_triangles_kernels_table,
                                             .reference = reference,
                                             .restricted = restricted};
