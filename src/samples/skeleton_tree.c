/* Skeletons as the kernels have them: pieces in single precision, groups of parts, and what of
 * them a region keeps. */
#include "samples/skeleton_tree.h"

#include <math.h>
#include <stdlib.h>

/* A region keeps its own parts when they are no more than this share of all. */
static const double MOST_LOCAL = 0.75;

/* ---- Pieces ------------------------------------------------------------------------------ */

/* Length of a segment, area of a triangle, 1 of a point. */
static double measure_of(const zs_skeleton_piece *piece)
{
  double ab[3], ac[3], normal[3];
  if (piece->shape == ZS_SKELETON_POINT)
    return 1;
  zs_subtract3(piece->corner[1], piece->corner[0], ab);
  if (piece->shape == ZS_SKELETON_SEGMENT)
    return sqrt(zs_dot3(ab, ab));
  zs_subtract3(piece->corner[2], piece->corner[0], ac);
  zs_cross3(ab, ac, normal);
  return sqrt(zs_dot3(normal, normal)) / 2;
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
    zs_subtract3(piece->corner[(i + 1) % corners], piece->corner[i], side[i]);
  if (corners == 3)
    zs_cross3(side[0], side[1], normal);
  const double across = sqrt(zs_dot3(normal, normal));
  for (int i = 0; i < sides; i++) {
    const double length = sqrt(zs_dot3(side[i], side[i]));
    double outward[3];
    zs_cross3(side[i], normal, outward);
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
  const double unit = zs_skeleton_unit(piece, radius);
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
                                            .reference = zs_skeleton_reference,
                                            .restricted = restricted};
