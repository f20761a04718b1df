#include "samples/skeleton.h"

#include <math.h>
#include <stdlib.h>

/* A region keeps its own parts when they are no more than this share of all. */
static const double MOST_LOCAL = 0.75;

/* ---- Vectors ------------------------------------------------------------------ */

static double dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void difference(const double a[3], const double b[3], double c[3])
{
  for (int k = 0; k < 3; k++)
    c[k] = a[k] - b[k];
}

static void cross(const double a[3], const double b[3], double c[3])
{
  for (int k = 0; k < 3; k++)
    c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* ---- Distances ------------------------------------------------------------------ */

/* From the nearest point of the segment ab to x; the square of its length. */
static double from_segment(const double a[3], const double b[3], const double x[3], double way[3])
{
  double ab[3], ax[3];
  difference(b, a, ab);
  difference(x, a, ax);
  const double length2 = dot(ab, ab);
  double t = length2 > 0 ? dot(ax, ab) / length2 : 0;
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  for (int k = 0; k < 3; k++)
    way[k] = ax[k] - t * ab[k];
  return dot(way, way);
}

/* The same for a triangle: its plane where the foot is inside, and else its sides. */
static double from_triangle(const zs_skeleton_piece *piece, const double x[3], double way[3])
{
  const double(*corner)[3] = piece->corner;
  double side[3][3], normal[3], ax[3], in_plane[3];
  for (int i = 0; i < 3; i++)
    difference(corner[(i + 1) % 3], corner[i], side[i]);
  cross(side[0], side[1], normal);
  const double area2 = dot(normal, normal);
  bool inside = area2 > 0;
  for (int i = 0; i < 3 && inside; i++) {
    difference(x, corner[i], ax);
    cross(side[i], ax, in_plane);
    inside = dot(in_plane, normal) >= 0;
  }
  if (inside) {
    difference(x, corner[0], ax);
    const double across = dot(ax, normal) / area2;
    for (int k = 0; k < 3; k++)
      way[k] = across * normal[k];
    return dot(way, way);
  }
  double least = INFINITY;
  for (int i = 0; i < 3; i++) {
    double other[3];
    const double d2 = from_segment(corner[i], corner[(i + 1) % 3], x, other);
    if (d2 < least) {
      least = d2;
      for (int k = 0; k < 3; k++)
        way[k] = other[k];
    }
  }
  return least;
}

static double from_piece(const zs_skeleton_piece *piece, const double x[3], double way[3])
{
  if (piece->shape == ZS_SKELETON_TRIANGLE)
    return from_triangle(piece, x, way);
  return from_segment(piece->corner[0], piece->corner[piece->shape - 1], x, way);
}

/* From the nearest piece of a part. */
static double from_part(const zs_skeleton *skeleton, const zs_skeleton_part *part,
                        const double x[3], double way[3])
{
  double least = INFINITY, other[3];
  for (uint32_t i = 0; i < part->count; i++) {
    const double d2 = from_piece(&skeleton->pieces[part->first + i], x, other);
    if (d2 < least) {
      least = d2;
      for (int k = 0; k < 3; k++)
        way[k] = other[k];
    }
  }
  return least;
}

/* ---- Fields that fall off with the distance ---------------------------------------- */

/* By q = u^2, and the derivative by q. */
static double falloff(zs_skeleton_field field, double q, double *slope)
{
  *slope = 0;
  if (q >= 1 && field != ZS_SKELETON_BLINN)
    return 0;
  const double rest = 1 - q, u = sqrt(q);
  switch (field) {
  case ZS_SKELETON_WYVILL:
    *slope = (-22 + 34 * q - 12 * q * q) / 9;
    return 1 + q * (-22 + q * (17 - 4 * q)) / 9;
  case ZS_SKELETON_BLOBTREE:
    *slope = -3 * rest * rest;
    return rest * rest * rest;
  case ZS_SKELETON_METABALL:
    *slope = q <= 1.0 / 9 ? -3 : -1.5 * (1 - u) / u;
    return q <= 1.0 / 9 ? 1 - 3 * q : 1.5 * (1 - u) * (1 - u);
  default:
    *slope = -4 * 0.69314718055994531 * exp2(-4 * q);
    return exp2(-4 * q);
  }
}

/* ---- The Cauchy kernel, integrated --------------------------------------------------
 *
 * In units of the radius.  With D^2 = 1 + distance^2 from a line, the integral along it of
 * 1 / (D^2 + t^2)^2 is G, of its derivative by D^2 -2 H:
 *   I = atan (t / D) / D,  G = t / (2 D^2 (D^2 + t^2)) + I / (2 D^2),
 *   H = t / (4 D^2 (D^2 + t^2)^2) + 3 G / (4 D^2).
 * Over a plane figure the divergence theorem makes of the integral one along its sides (the
 * closed form of McCormack and Sherstyuk, by side, and right for every width). */

typedef struct along {
  double i, g, h;
} along;

/* From t1 to t2. */
static along integrals(double d2, double t1, double t2)
{
  const double d = sqrt(d2), r1 = 1 / (d2 + t1 * t1), r2 = 1 / (d2 + t2 * t2);
  along a;
  a.i = (atan(t2 / d) - atan(t1 / d)) / d;
  a.g = (t2 * r2 - t1 * r1 + a.i) / (2 * d2);
  a.h = (t2 * r2 * r2 - t1 * r1 * r1 + 3 * a.g) / (4 * d2);
  return a;
}

static double cauchy_point(const double x[3], double slope[3])
{
  const double r = 1 / (1 + dot(x, x));
  for (int k = 0; k < 3; k++)
    slope[k] = -4 * r * r * r * x[k];
  return r * r;
}

/* x: from the segment's first point; ab: along it. */
static double cauchy_segment(const double x[3], const double ab[3], double slope[3])
{
  const double length = sqrt(dot(ab, ab));
  slope[0] = slope[1] = slope[2] = 0;
  if (!(length > 0))
    return 0;
  const double at = dot(x, ab) / length;
  double way[3];
  for (int k = 0; k < 3; k++)
    way[k] = x[k] - at / length * ab[k];
  const double d2 = 1 + dot(way, way), t1 = -at, t2 = length - at;
  const along a = integrals(d2, t1, t2);
  const double r1 = 1 / (d2 + t1 * t1), r2 = 1 / (d2 + t2 * t2);
  for (int k = 0; k < 3; k++)
    slope[k] = -4 * a.h * way[k] + (r1 * r1 - r2 * r2) * ab[k] / length;
  return a.g;
}

/* x: the corners, from the point. */
static double cauchy_triangle(const double x[3][3], double slope[3])
{
  double side[3][3], normal[3], flux = 0, flux_slope = 0;
  for (int i = 0; i < 3; i++)
    difference(x[(i + 1) % 3], x[i], side[i]);
  cross(side[0], side[1], normal);
  const double area = sqrt(dot(normal, normal));
  slope[0] = slope[1] = slope[2] = 0;
  if (!(area > 0))
    return 0;
  for (int k = 0; k < 3; k++)
    normal[k] /= area;
  const double height = -dot(x[0], normal), q = 1 + height * height;
  for (int i = 0; i < 3; i++) {
    const double length = sqrt(dot(side[i], side[i]));
    double outward[3];
    cross(side[i], normal, outward);
    const double t1 = dot(x[i], side[i]) / length, out = dot(x[i], outward) / length;
    const along a = integrals(q + out * out, t1, t1 + length);
    flux += out * a.i;
    flux_slope += out * (a.i / q + a.g);
    for (int k = 0; k < 3; k++)
      slope[k] -= a.g * outward[k] / length;
  }
  for (int k = 0; k < 3; k++)
    slope[k] -= height * flux_slope / q * normal[k];
  return flux / (2 * q);
}

/* The slope is in units of the radius too. */
static double cauchy(const zs_skeleton_piece *piece, double radius, const double at[3],
                     double slope[3])
{
  double x[3][3] = {{0}}, from[3], ab[3];
  for (int i = 0; i < (int)piece->shape; i++)
    for (int k = 0; k < 3; k++)
      x[i][k] = (piece->corner[i][k] - at[k]) / radius;
  for (int k = 0; k < 3; k++)
    from[k] = -x[0][k];
  if (piece->shape == ZS_SKELETON_POINT)
    return cauchy_point(from, slope);
  if (piece->shape == ZS_SKELETON_TRIANGLE)
    return cauchy_triangle((const double(*)[3])x, slope);
  difference(x[1], x[0], ab);
  return cauchy_segment(from, ab, slope);
}

/* Lengths and areas are in scene units: the integral over u is 1 / radius or 1 / radius^2 of
 * that over the skeleton. */
static double measure_unit(const zs_skeleton_piece *piece, double radius)
{
  return piece->shape == ZS_SKELETON_POINT     ? 1
         : piece->shape == ZS_SKELETON_SEGMENT ? radius
                                               : radius * radius;
}

/* ---- Parts ------------------------------------------------------------------------------ */

double zs_skeleton_value(const zs_skeleton *skeleton, const zs_skeleton_part *part,
                         const double at[3], double slope[3])
{
  double own[3] = {0}, value = 0;
  if (skeleton->field == ZS_SKELETON_CAUCHY) {
    for (uint32_t i = 0; i < part->count; i++) {
      const zs_skeleton_piece *piece = &skeleton->pieces[part->first + i];
      const double unit = part->weight * measure_unit(piece, part->radius);
      double by[3];
      value += unit * cauchy(piece, part->radius, at, by);
      for (int k = 0; k < 3; k++)
        own[k] += unit * by[k] / part->radius;
    }
  } else {
    double way[3] = {0}, by;
    const double u = sqrt(from_part(skeleton, part, at, way)) / part->radius;
    value = part->weight * falloff(skeleton->field, u * u, &by);
    for (int k = 0; k < 3 && by != 0; k++) /* beside the smallest radii ways are infinite */
      own[k] = part->weight * by * 2 * (way[k] / part->radius) / part->radius;
  }
  if (slope)
    for (int k = 0; k < 3; k++)
      slope[k] = own[k];
  return value;
}

/* Length of a segment, area of a triangle, 1 of a point. */
static double measure_of(const zs_skeleton_piece *piece)
{
  double ab[3], ac[3], normal[3];
  if (piece->shape == ZS_SKELETON_POINT)
    return 1;
  difference(piece->corner[1], piece->corner[0], ab);
  if (piece->shape == ZS_SKELETON_SEGMENT)
    return sqrt(dot(ab, ab));
  difference(piece->corner[2], piece->corner[0], ac);
  cross(ab, ac, normal);
  return sqrt(dot(normal, normal)) / 2;
}

/* A number for the kernels, whose powers are numbers too. */
static float limited(double x)
{
  static const double MOST = 1e8;
  return (float)(x > MOST ? MOST : x < -MOST ? -MOST : x);
}

static void make_form(zs_skeleton_piece *piece, double radius, double weight)
{
  static const double MOST_SCALE = 1e37;
  zs_skeleton_form form = {.scale = (float)fmin(1 / radius, MOST_SCALE)};
  const int corners = (int)piece->shape, sides = corners == 3 ? 3 : corners - 1;
  double side[3][3], normal[3] = {0, 0, 0}, largest = 0, total = 0;
  for (int i = 0; i < corners; i++)
    for (int k = 0; k < 3; k++) {
      form.corner[i][k] = limited((piece->corner[i][k] - piece->corner[0][k]) / radius);
      largest = fmax(largest, fabs(piece->corner[i][k]) / radius);
    }
  for (int i = 0; i < sides; i++)
    difference(piece->corner[(i + 1) % corners], piece->corner[i], side[i]);
  if (corners == 3)
    cross(side[0], side[1], normal);
  const double across = sqrt(dot(normal, normal));
  for (int i = 0; i < sides; i++) {
    const double length = sqrt(dot(side[i], side[i]));
    double outward[3];
    cross(side[i], normal, outward);
    for (int k = 0; k < 3 && length > 0; k++) {
      form.along[i][k] = (float)(side[i][k] / length);
      form.outward[i][k] = across > 0 ? (float)(outward[k] / length / across) : 0;
    }
    form.length[i] = limited(length / radius);
    total += length / radius;
  }
  for (int k = 0; k < 3; k++) {
    form.from[k] = (float)piece->corner[0][k];
    form.normal[k] = across > 0 ? (float)(normal[k] / across) : 0;
  }
  const double unit = measure_unit(piece, radius);
  form.largest = limited(largest);
  form.sides = limited(total);
  form.measure = limited(measure_of(piece) / unit);
  form.unit = (float)(weight * unit);
  piece->form = form;
}

/* Find the forms of a part's pieces, their box, their measure, and how far they reach. */
static void prepare(zs_skeleton_field field, zs_skeleton_piece *pieces, zs_skeleton_part *part)
{
  for (int k = 0; k < 3; k++) {
    part->lo[k] = INFINITY;
    part->hi[k] = -INFINITY;
  }
  part->measure = 0;
  for (uint32_t i = part->first; i < part->first + part->count; i++) {
    make_form(&pieces[i], part->radius, part->weight);
    part->measure += measure_of(&pieces[i]);
    for (int j = 0; j < (int)pieces[i].shape; j++)
      for (int k = 0; k < 3; k++) {
        const double x = pieces[i].corner[j][k];
        part->lo[k] = x < part->lo[k] ? x : part->lo[k];
        part->hi[k] = x > part->hi[k] ? x : part->hi[k];
      }
  }
  part->reach = zs_skeleton_reach(field, part, 0);
}

double zs_skeleton_reach(zs_skeleton_field field, const zs_skeleton_part *part, double least)
{
  if (!(least > 0))
    return field == ZS_SKELETON_BLINN || field == ZS_SKELETON_CAUCHY ? INFINITY : part->radius;
  const double share = least / fabs(part->weight);
  if (field == ZS_SKELETON_CAUCHY) /* as if all of it were nearest */
    return share < part->measure ? part->radius * sqrt(sqrt(part->measure / share) - 1) : 0;
  if (field == ZS_SKELETON_BLINN)
    return share < 1 ? part->radius * sqrt(-log2(share) / 4) : 0;
  return part->radius;
}

/* ---- Groups -------------------------------------------------------------------------------- */

enum { FEW_PARTS = 4 }; /* in a group that is not divided */

static double middle_of(const void *part, int axis)
{
  const zs_skeleton_part *p = part;
  return p->lo[axis] + p->hi[axis];
}

#define ORDER(AXIS) \
  static int by_##AXIS(const void *a, const void *b) \
  { \
    const double x = middle_of(a, AXIS), y = middle_of(b, AXIS); \
    return (x > y) - (x < y); \
  }
ORDER(0) ORDER(1) ORDER(2)

/* A number that is surely no larger, or no smaller. */
static float outward(double x, float toward)
{
  return nextafterf((float)x, toward);
}

/* Add the group of some parts and those that it is divided into, half and half across the
 * longest side of its box. */
static void add_group(zs_skeleton_group *groups, uint32_t *used, zs_skeleton_part *parts,
                      uint32_t first, uint32_t count)
{
  static int (*const order[3])(const void *, const void *) = {by_0, by_1, by_2};
  zs_skeleton_group *group = &groups[(*used)++];
  double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
  double below = 0, above = 0;
  *group = (zs_skeleton_group){.first = first, .count = count};
  for (uint32_t i = first; i < first + count; i++) {
    *(parts[i].weight < 0 ? &below : &above) += parts[i].weight;
    for (int k = 0; k < 3; k++) {
      lo[k] = fmin(lo[k], parts[i].lo[k] - parts[i].reach);
      hi[k] = fmax(hi[k], parts[i].hi[k] + parts[i].reach);
    }
  }
  group->below = outward(below, -INFINITY);
  group->above = outward(above, INFINITY);
  int axis = 0;
  for (int k = 0; k < 3; k++) {
    group->lo[k] = outward(lo[k], -INFINITY);
    group->hi[k] = outward(hi[k], INFINITY);
    axis = hi[k] - lo[k] > hi[axis] - lo[axis] ? k : axis;
  }
  if (count > FEW_PARTS) {
    qsort(parts + first, count, sizeof *parts, order[axis]);
    add_group(groups, used, parts, first, count / 2);
    add_group(groups, used, parts, first + count / 2, count - count / 2);
  }
  group->next = *used;
}

zs_skeleton *zs_skeleton_new(zs_arena *arena, zs_skeleton_field field, zs_skeleton_part *parts,
                             uint32_t count, zs_skeleton_piece *pieces)
{
  const bool endless = field == ZS_SKELETON_BLINN || field == ZS_SKELETON_CAUCHY;
  zs_skeleton *skeleton = ZS_ARENA_NEW(arena, zs_skeleton, 1);
  zs_skeleton_group *groups =
    endless ? NULL : ZS_ARENA_NEW(arena, zs_skeleton_group, 2 * (size_t)count);
  if (!skeleton || (!endless && !groups))
    return NULL;
  for (uint32_t i = 0; i < count; i++)
    prepare(field, pieces, &parts[i]);
  *skeleton = (zs_skeleton){field, count, 0, parts, pieces, groups};
  if (!endless && count > 0)
    add_group(groups, &skeleton->group_count, parts, 0, count);
  return skeleton;
}

/* ---- Regions ------------------------------------------------------------------------------ */

/* The distance between a box and a part's. */
static double gap_between(const zs_skeleton_part *part, const double lo[3], const double hi[3])
{
  double gap2 = 0;
  for (int k = 0; k < 3; k++) {
    const double below = part->lo[k] - hi[k], above = lo[k] - part->hi[k];
    const double d = below > 0 ? below : above > 0 ? above : 0;
    gap2 += d * d;
  }
  return sqrt(gap2);
}

/* ---- The operation ------------------------------------------------------------- */

static double reference(const void *data, const double in[])
{
  const zs_skeleton *skeleton = data;
  double sum = 0;
  for (uint32_t i = 0; i < skeleton->part_count; i++)
    sum += zs_skeleton_value(skeleton, &skeleton->parts[i], in, NULL);
  return sum;
}

/* The parts among some that reach a box: their number, and unless `out` is NULL they. */
static uint32_t reaching(const zs_skeleton *skeleton, uint32_t first, uint32_t count,
                         const double lo[3], const double hi[3], zs_skeleton_part *out)
{
  uint32_t found = 0;
  for (uint32_t i = first; i < first + count; i++) {
    const zs_skeleton_part *part = &skeleton->parts[i];
    if (gap_between(part, lo, hi) >= part->reach)
      continue;
    if (out)
      out[found] = *part;
    found++;
  }
  return found;
}

static bool meets(const zs_skeleton_group *group, const float lo[3], const float hi[3])
{
  for (int k = 0; k < 3; k++)
    if (hi[k] < group->lo[k] || lo[k] > group->hi[k])
      return false;
  return true;
}

/* The same of all parts. */
static uint32_t all_reaching(const zs_skeleton *skeleton, const float lo[3], const float hi[3],
                             zs_skeleton_part *out)
{
  const double low[3] = {lo[0], lo[1], lo[2]}, high[3] = {hi[0], hi[1], hi[2]};
  uint32_t found = 0;
  if (!skeleton->group_count)
    return reaching(skeleton, 0, skeleton->part_count, low, high, out);
  for (uint32_t g = 0; g < skeleton->group_count;) {
    const zs_skeleton_group *group = &skeleton->groups[g];
    if (!meets(group, lo, hi)) {
      g = group->next;
      continue;
    }
    g++;
    if (group->next == g)
      found += reaching(skeleton, group->first, group->count, low, high, out ? out + found : NULL);
  }
  return found;
}

static const void *restricted(const void *data, const float lo[], const float hi[],
                              zs_arena *arena)
{
  const zs_skeleton *skeleton = data;
  if (skeleton->field == ZS_SKELETON_BLINN || skeleton->field == ZS_SKELETON_CAUCHY)
    return skeleton;
  const uint32_t count = all_reaching(skeleton, lo, hi, NULL);
  if (count > MOST_LOCAL * skeleton->part_count)
    return skeleton;
  zs_skeleton *local = ZS_ARENA_NEW(arena, zs_skeleton, 1);
  zs_skeleton_part *parts = ZS_ARENA_NEW(arena, zs_skeleton_part, count + 1);
  if (!local || !parts)
    return skeleton;
  all_reaching(skeleton, lo, hi, parts);
  *local = (zs_skeleton){.field = skeleton->field,
                         .part_count = count,
                         .parts = parts,
                         .pieces = skeleton->pieces};
  return local;
}

ZS_DEFINE_KERNEL_TABLE(zs_skeleton_kernels)

const zs_operation zs_skeleton_operation = {.name = "skeleton",
                                            .arity = 3,
                                            .kernels = zs_skeleton_kernels_table,
                                            .reference = reference,
                                            .restricted = restricted};
