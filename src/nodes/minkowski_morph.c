/* The way from one shape to another by weighted Minkowski sums. */
#include "nodes/common.h"
#include "nodes/minkowski_morph.h"
#include "nodes/outlined.h"

#include "samples/minkowski.h"

#include <math.h>

static const zs_attribute attributes[] = {
  ZS_PLAIN(struct minkowski_morph, time, "time", NULL, ZS_RANGE_ANY,
           "0: the first child, 1: the second, and so on; before and after them it is the first and the "
           "last"),
  {.name = "resolution", .type = ZS_INTEGER,
   .offset = offsetof(struct minkowski_morph, resolution), .initial = "", .unit = "1",
   .range = ZS_RANGE_BETWEEN, .minimum = 8, .maximum = 2048,
   .doc = "where sums are sampled: cells along the longest side; left out, 48, or in the plane 400"},
};

/* The two nodes that the time lies between, and the part of the way; `index`: which node of all
 * the first of them is. */
static double find_ends(const zs_node *node, const zs_node *ends[2], size_t *index)
{
  size_t count = 0, n = 0;
  for (size_t i = 0; i < node->child_count; i++)
    count += !zs_node_is_part(node->children[i]);
  const double time = fmax(((const struct minkowski_morph *)node->parameters)->time, 0);
  const double first = fmin(floor(time), (double)count - 2);
  for (size_t i = 0; i < node->child_count; i++) {
    if (zs_node_is_part(node->children[i]))
      continue;
    if ((double)n == first || (double)n == first + 1)
      ends[(double)n != first] = node->children[i];
    n++;
  }
  *index = (size_t)first;
  return fmin(time - first, 1);
}

/* ---- Exactly --------------------------------------------------------------------------- */

/* The edges of a shape, placed, times `scale`; none where it has no straight outline in the x-y
 * plane.  False after reporting. */
static bool outline_of(const zs_node *node, double scale, zs_fill *fill, zs_diag *diag)
{
  double placement[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  if (!node->kind->outline)
    return true;
  const double *inverse = node->placement;
  if (inverse && (inverse[2] != 0 || inverse[6] != 0))
    return true; /* it leans */
  if (inverse) {
    const double flat[12] = {inverse[0], inverse[1], 0, inverse[3], inverse[4], inverse[5],
                             0,          inverse[7], 0, 0,          1,          0};
    if (!zs_affine_invert(flat, placement))
      return true;
  }
  if (!node->kind->outline(node, fill, diag))
    return false;
  const double *m = placement;
  const bool mirrored = m[0] * m[5] - m[1] * m[4] < 0;
  for (size_t i = 0; i < fill->count; i++) {
    double *e = fill->edges[i], moved[4];
    for (int k = 0; k < 2; k++) {
      const double *end = e + 2 * (mirrored ? !k : k);
      moved[2 * k] = scale * (m[0] * end[0] + m[1] * end[1] + m[3]);
      moved[2 * k + 1] = scale * (m[4] * end[0] + m[5] * end[1] + m[7]);
    }
    for (int k = 0; k < 4; k++)
      e[k] = moved[k];
  }
  return true;
}

static bool sum_of(const zs_node *node, const zs_fill ends[2], zs_fill *sum, zs_diag *diag)
{
  const size_t a = ends[0].count, b = ends[1].count;
  if (b > ZS_MINKOWSKI_PAIRS / a)
    return zs_node_fail(node, diag, NULL,
                        "outlines of %zu and %zu edges; expected no more than %d pairs of them", a, b,
                        ZS_MINKOWSKI_PAIRS);
  const zs_fill_result result = zs_minkowski_sum(&ends[0], &ends[1], sum);
  if (result == ZS_FILL_MEMORY)
    return zs_fail_memory(diag);
  return result == ZS_FILL_DONE ||
         zs_node_fail(node, diag, NULL, "edges of the sum lie too close to each other to tell what "
                      "they enclose");
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  zs_diag *diag = zs_compiler_diag(compiler);
  const zs_node *ends[2] = {NULL, NULL};
  size_t index;
  const double t = find_ends(node, ends, &index);
  if (t == 0 || t == 1)
    return zs_node_emit(compiler, ends[t == 1], at);
  zs_fill fills[2] = {{0}, {0}}, sum = {0};
  bool good = true;
  for (int i = 0; i < 2; i++)
    good = good && outline_of(ends[i], i ? t : 1 - t, &fills[i], diag);
  zs_value f = zs_emit_constant(compiler, 0);
  if (good && fills[0].count && fills[1].count) {
    if (sum_of(node, fills, &sum, diag))
      f = zs_outlined_emit(compiler, &sum, at);
  } else if (good) {
    f = zs_minkowski_sampled_emit(compiler, node, ends, t, at);
  }
  zs_fill_clear(&fills[0]);
  zs_fill_clear(&fills[1]);
  zs_fill_clear(&sum);
  return f;
}

/* The same sum of the boxes. */
static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  const zs_node *ends[2];
  size_t index;
  const double t = find_ends(node, ends, &index);
  (void)count;
  if (t == 0 || t == 1)
    return children[index + (t == 1)];
  const zs_box *a = &children[index], *b = a + 1;
  zs_box sum;
  for (int k = 0; k < 3; k++) {
    sum.lo[k] = (1 - t) * a->lo[k] + t * b->lo[k];
    sum.hi[k] = (1 - t) * a->hi[k] + t * b->hi[k];
  }
  return sum;
}

const zs_kind zs_kind_minkowski_morph = {
  .name = "minkowski-morph",
  .family = ZS_FAMILY_INTERPOLATION,
  .summary = "one shape that becomes another by sums of their points",
  .doc = "At t, between 0 and 1, of the way from one child to the next the solid is the set of all "
         "(1 - t) a + t b, for points a of the one and b of the other: the Minkowski sum of both, made smaller. It is convex where they "
         "are, and where a child is not convex its hollows are filled on the way. Of two polygons "
         "(`polygon`, `regular-polygon`, `rectangle` without round corners, `path`), placed in the x-y "
         "plane, it is exact: f is the distance to its edges, which are at most as many as both have "
         "where they are convex. Else it is sampled on a lattice, 2D children in the plane, from the "
         "children's values: the surface is off by a fraction of a cell where a child is thinner than a "
         "few of them, and by its square where surfaces are smooth; f is about the distance near to it. "
         "Samples take time with the fifth power of `resolution` in space, the third in the plane.",
  .source = "A. Pasko, O. Okunev, V. Savchenko, Minkowski sums of point sets defined by inequalities, "
            "2003",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct minkowski_morph),
  .children = ZS_CHILDREN_TWO,
  .emit = emit,
  .box = box,
};
