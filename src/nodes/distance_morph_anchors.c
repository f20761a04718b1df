/* Anchors of <distance-morph>: pairs of points, and where they are on their ways. */
#include "nodes/distance_morph.h"

#include "nodes/common.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- pair, a part --------------------------------------------------------------------- */

struct pair {
  double from[3];
  zs_numbers to;
};

static const zs_attribute pair_attributes[] = {
  ZS_POINT(struct pair, from, "from", NULL, "a point of the first shape"),
  {.name = "to", .type = ZS_NUMBERS, .offset = offsetof(struct pair, to), .unit = "length",
   .doc = "the point of the second shape that it becomes; of more than two shapes x, y and z in "
          "each of those that follow the first"},
};

const zs_kind zs_distance_morph_pair = {
  .name = "pair",
  .family = ZS_FAMILY_PART,
  .summary = "an anchor: a point of the first shape, and the points that it becomes",
  .attributes = pair_attributes,
  .attribute_count = ZS_COUNT_OF(pair_attributes),
  .parameters_size = sizeof(struct pair),
  .children = ZS_CHILDREN_NONE,
};

/* Where an anchor is in a shape, the first being 0. */
static const double *anchor(const zs_node *part, size_t shape_index)
{
  const struct pair *p = part->parameters;
  return shape_index == 0 ? p->from : p->to.values + 3 * (shape_index - 1);
}

static size_t count_pairs(const zs_node *node)
{
  size_t count = 0;
  for (size_t i = 0; i < node->child_count; i++)
    count += node->children[i]->kind == &zs_distance_morph_pair;
  return count;
}

/* ---- Anchors that are one ------------------------------------------------------------------- */

/* An anchor at a place, to be sorted along a direction that hardly any two anchors share a
 * plane across. */
typedef struct placed {
  const double *at; /* 3 numbers */
  double key;
  size_t index;
  const zs_node *part;
} placed;

static int by_key(const void *a, const void *b)
{
  const placed *p = a, *q = b;
  if (p->key != q->key)
    return p->key < q->key ? -1 : 1;
  return p->part->place.line < q->part->place.line ? -1 : p->part->place.line > q->part->place.line;
}

/* Whether `meet` holds for all pairs of anchors whose places are no farther apart than
 * `tolerance`. */
typedef bool meeting(const void *context, const placed *a, const placed *b);
static bool for_meetings(placed *all, size_t count, double tolerance, meeting *meet,
                         const void *context)
{
  for (size_t i = 0; i < count; i++)
    all[i].key = 0.5257 * all[i].at[0] + 0.6180 * all[i].at[1] + 0.5843 * all[i].at[2];
  qsort(all, count, sizeof *all, by_key);
  for (size_t i = 0; i < count; i++)
    for (size_t j = i + 1; j < count && all[j].key - all[i].key <= tolerance; j++) {
      double apart = 0;
      for (int k = 0; k < 3; k++)
        apart = fmax(apart, fabs(all[i].at[k] - all[j].at[k]));
      if (apart <= tolerance && !meet(context, &all[i], &all[j]))
        return false;
    }
  return true;
}

/* ---- Checks ------------------------------------------------------------------------------ */

typedef struct checking {
  size_t shapes, shape; /* of which one */
  zs_diag *diag;
} checking;

/* Two anchors that are one point in a shape are to be one in its neighbours. */
static bool stay_together(const void *context, const placed *a, const placed *b)
{
  const checking *c = context;
  for (size_t s = c->shape ? c->shape - 1 : 0; s < c->shapes && s <= c->shape + 1; s++) {
    const double *p = anchor(a->part, s), *q = anchor(b->part, s);
    if (p[0] != q[0] || p[1] != q[1] || p[2] != q[2])
      return zs_node_fail(b->part, c->diag, c->shape ? "to" : "from",
                          "(%g %g %g) is where the pair in line %u is in shape %zu, but the two are "
                          "apart in shape %zu; expected points that stay together or apart",
                          b->at[0], b->at[1], b->at[2], a->part->place.line, c->shape + 1, s + 1);
  }
  return true;
}

static bool check_count(const zs_node *part, size_t shapes, zs_diag *diag)
{
  const size_t given = ((const struct pair *)part->parameters)->to.count;
  return given == 3 * (shapes - 1) ||
         zs_node_fail(part, diag, "to", "there are %zu numbers; expected %zu, x, y and z in %s",
                      given, 3 * (shapes - 1),
                      shapes == 2 ? "the second shape" : "each of the shapes after the first");
}

bool zs_distance_morph_check_pairs(const zs_node *node, size_t shapes, zs_diag *diag)
{
  const size_t count = count_pairs(node);
  size_t n = 0;
  placed *all = malloc((count + 1) * sizeof *all);
  if (!all)
    return zs_fail_memory(diag);
  bool good = true;
  for (size_t i = 0; good && i < node->child_count; i++) {
    if (node->children[i]->kind != &zs_distance_morph_pair)
      continue;
    good = check_count(node->children[i], shapes, diag);
    all[n++].part = node->children[i];
  }
  for (size_t s = 0; good && s < shapes; s++) {
    const checking c = {shapes, s, diag};
    for (size_t i = 0; i < count; i++)
      all[i].at = anchor(all[i].part, s);
    good = for_meetings(all, count, 0, stay_together, &c);
  }
  free(all);
  return good;
}

/* ---- Ways ---------------------------------------------------------------------------------- */

/* Anchors nearer than this part of their box are at one place: zs_rbf_fit holds the same. */
static const double SAME = 1e-9;

static unsigned dimension_of(const zs_node *node, size_t shapes)
{
  for (size_t i = 0; i < node->child_count; i++)
    for (size_t s = 0; node->children[i]->kind == &zs_distance_morph_pair && s < shapes; s++)
      if (anchor(node->children[i], s)[2] != 0)
        return 3;
  return 2;
}

static void apply(const double m[12], const double x[3], double y[3])
{
  for (int i = 0; i < 3; i++)
    y[i] = m[4 * i] * x[0] + m[4 * i + 1] * x[1] + m[4 * i + 2] * x[2] + m[4 * i + 3];
}

/* The ends of the ways in the frame, p and q, 3 numbers each. */
typedef struct keeping {
  const double *p, *q;
  double t, tolerance;
  zs_diag *diag;
} keeping;

/* Anchors that meet on the way are to have the same ways. */
static bool keep_together(const void *context, const placed *a, const placed *b)
{
  const keeping *all = context;
  for (size_t k = 0; k < 3; k++) {
    const size_t i = 3 * a->index + k, j = 3 * b->index + k;
    if (fabs(all->q[i] - all->p[i] - (all->q[j] - all->p[j])) > all->tolerance)
      return zs_node_fail(b->part, all->diag, NULL,
                          "the anchor meets that of the pair in line %u at %.6g of the way, but does "
                          "not keep with it; expected ways that do not meet", a->part->place.line,
                          all->t);
  }
  return true;
}

/* From the ends p and q of the ways, q brought into the first shape's frame, to what is fitted. */
static bool set_ways(zs_anchors *anchors, placed *all, double *at, const keeping *ends)
{
  const double *p = ends->p, *q = ends->q;
  double longest = 0, size = 0;
  for (size_t i = 0; i < anchors->count; i++)
    for (size_t k = 0; k < 3; k++) {
      const double way = q[3 * i + k] - p[3 * i + k];
      at[3 * i + k] = p[3 * i + k] + ends->t * way;
      size = fmax(size, fmax(fabs(p[3 * i + k]), fabs(q[3 * i + k])));
      longest = fmax(longest, fabs(way));
      if (k >= anchors->dimension)
        continue;
      anchors->positions[i * anchors->dimension + k] = at[3 * i + k];
      anchors->ways[k * anchors->count + i] = way;
    }
  anchors->straying = longest > 1e-12 * size; /* else it is what rounding leaves */
  for (size_t i = 0; i < anchors->count; i++)
    all[i] = (placed){.at = at + 3 * i, .index = i, .part = all[i].part};
  return !anchors->straying ||
         for_meetings(all, anchors->count, ends->tolerance, keep_together, ends);
}

/* The largest side of the box of points. */
static double extent_of(const double *points, size_t count)
{
  double largest = 0;
  for (size_t k = 0; k < 3; k++) {
    double lo = INFINITY, hi = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      lo = fmin(lo, points[3 * i + k]);
      hi = fmax(hi, points[3 * i + k]);
    }
    largest = fmax(largest, hi - lo);
  }
  return largest;
}

bool zs_anchors_find(const zs_node *node, size_t shapes, size_t first, double t, bool rigid,
                     zs_arena *arena, zs_anchors *anchors, zs_diag *diag)
{
  const size_t count = count_pairs(node);
  *anchors = (zs_anchors){.count = count, .rigid = zs_rigid_identity()};
  if (!count)
    return true;
  anchors->dimension = dimension_of(node, shapes);
  double *p = ZS_ARENA_NEW(arena, double, 3 * count), *q = ZS_ARENA_NEW(arena, double, 3 * count);
  double *at = ZS_ARENA_NEW(arena, double, 3 * count);
  placed *all = ZS_ARENA_NEW(arena, placed, count);
  anchors->positions = ZS_ARENA_NEW(arena, double, 3 * count);
  anchors->ways = ZS_ARENA_NEW(arena, double, 3 * count);
  if (!p || !q || !at || !all || !anchors->positions || !anchors->ways)
    return zs_fail_memory(diag);
  size_t n = 0;
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    if (part->kind != &zs_distance_morph_pair)
      continue;
    memcpy(p + 3 * n, anchor(part, first), 3 * sizeof *p);
    memcpy(q + 3 * n, anchor(part, first + 1), 3 * sizeof *q);
    all[n++].part = part;
  }
  if (rigid && !zs_rigid_fit(anchors->dimension, p, q, count, &anchors->rigid))
    return zs_fail_memory(diag);
  double back[12];
  zs_rigid_at(&anchors->rigid, 1, NULL, back);
  for (size_t i = 0; i < count; i++) {
    const double end[3] = {q[3 * i], q[3 * i + 1], q[3 * i + 2]};
    apply(back, end, q + 3 * i);
  }
  const keeping ends = {p, q, t, SAME * fmax(extent_of(p, count), extent_of(q, count)), diag};
  return set_ways(anchors, all, at, &ends);
}
