/* Warp-guided interpolation of fields between shapes at times. */
#include "nodes/distance_morph.h"

#include "field/blend.h"
#include "nodes/common.h"
#include "nodes/extent.h"
#include "nodes/radial.h"

#include <math.h>

/* ---- shape, a part ------------------------------------------------------------------- */

struct shape {
  double at;
};

static const zs_attribute shape_attributes[] = {
  ZS_PLAIN(struct shape, at, "at", NULL, ZS_RANGE_ANY, "the time when the morph is this shape"),
};

static const zs_kind shape = {
  .name = "shape",
  .family = ZS_FAMILY_PART,
  .summary = "a solid, and when the morph is that solid",
  .attributes = shape_attributes,
  .attribute_count = ZS_COUNT_OF(shape_attributes),
  .parameters_size = sizeof(struct shape),
  .children = ZS_CHILDREN_ONE,
};

static double time_of(const zs_node *part)
{
  return ((const struct shape *)part->parameters)->at;
}

static const zs_kind *const parts[] = {&shape, &zs_distance_morph_pair, NULL};

/* ---- distance-morph --------------------------------------------------------------------- */

enum { CUBIC, THIN_PLATE, GAUSSIAN };
static const char *const radials[] = {"cubic", "thin-plate", "gaussian", NULL};

struct distance_morph {
  double time, sigma; /* NaN: as wide as is good */
  int radial;
  bool rigid;
};

static const zs_attribute attributes[] = {
  ZS_PLAIN(struct distance_morph, time, "time", NULL, ZS_RANGE_ANY,
           "when: before the first shape's time it is the first shape, after the last one's the "
           "last"),
  ZS_SELECT(struct distance_morph, radial, "radial", "cubic", radials,
            "the function of the distance from anchors by which space between them is carried "
            "along: `cubic`, r^3; `thin-plate`, what bends least, r in space and r^2 log r in the "
            "plane, which is calmer far from all anchors; `gaussian`, exp(-(r / sigma)^2), which "
            "fades"),
  ZS_LENGTH(struct distance_morph, sigma, "sigma", "", ZS_RANGE_POSITIVE,
            "how far a Gaussian reaches; left out, as far as predicts the anchors best from each "
            "other. The others have no use for it"),
  {.name = "rigid", .type = ZS_BOOLEAN, .offset = offsetof(struct distance_morph, rigid),
   .initial = "true", .unit = "",
   .doc = "whether anchors turn about each other as a body would, as far as they can; `false`: "
          "each goes straight"},
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const zs_node *before = NULL;
  size_t shapes = 0;
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    if (part->kind != &shape)
      continue;
    if (before && !(time_of(before) < time_of(part)))
      return zs_node_fail(part, diag, "at", "%g is not after the time of the shape before, %g",
                          time_of(part), time_of(before));
    before = part;
    shapes++;
  }
  if (shapes < 2)
    return zs_node_misuse(node, diag, NULL, "found %zu of at least 2 shapes", shapes);
  return zs_distance_morph_check_pairs(node, shapes, diag);
}

/* ---- The gap that the time is in ----------------------------------------------------------- */

/* Two shapes, and the part of the way from the one to the other. */
typedef struct gap {
  const zs_node *shapes[2];
  size_t first;  /* which shape the first of them is, */
  size_t count;  /* of how many */
  double t;      /* 0 .. 1 */
} gap;

static gap find_gap(const zs_node *node)
{
  const double time = ((const struct distance_morph *)node->parameters)->time;
  gap g = {.count = 0};
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    if (part->kind != &shape)
      continue;
    if (g.count < 2 || time > time_of(g.shapes[1])) {
      g.shapes[0] = g.shapes[1];
      g.shapes[1] = part;
      g.first = g.count ? g.count - 1 : 0;
    }
    g.count++;
  }
  const double from = time_of(g.shapes[0]), to = time_of(g.shapes[1]);
  g.t = time <= from ? 0 : time >= to ? 1 : fmin(time / (to - from) - from / (to - from), 1);
  return g;
}

/* ---- f ------------------------------------------------------------------------------------------ */

static bool find_anchors(const zs_node *node, const gap *g, zs_arena *arena, zs_anchors *a,
                         zs_diag *diag)
{
  const struct distance_morph *settings = node->parameters;
  return zs_anchors_find(node, g->count, g->first, g->t, settings->rigid, arena, a, diag);
}

/* The way of space about the anchors, at coordinates in the first shape's frame. */
static zs_value way_of(zs_compiler *compiler, const zs_node *node, const zs_anchors *a, unsigned k,
                       const zs_coordinates *at)
{
  const struct distance_morph *settings = node->parameters;
  const zs_rbf_kernel thin = a->dimension == 2 ? ZS_RBF_TPS2 : ZS_RBF_R;
  const zs_rbf_problem problem = {
    .dimension = a->dimension,
    .kernel = settings->radial == CUBIC        ? ZS_RBF_R3
              : settings->radial == THIN_PLATE ? thin
                                               : ZS_RBF_GAUSSIAN,
    .sigma = isnan(settings->sigma) ? 0 : settings->sigma,
    .count = a->count,
    .positions = a->positions,
    .values = a->ways + k * a->count,
  };
  return zs_radial_emit(compiler, node, &problem, at);
}

/* Coordinates moved by the part `part` of the ways. */
static zs_coordinates moved(zs_compiler *compiler, const zs_coordinates *at,
                            const zs_value ways[3], unsigned dimension, double part)
{
  zs_value x[3];
  for (unsigned k = 0; k < 3; k++) {
    x[k] = zs_emit_coordinate(compiler, at, (int)k);
    if (k < dimension)
      x[k] = zs_emit(compiler, ZS_FUNCTION_ADD, x[k], zs_emit_scaled(compiler, ways[k], part), 0);
  }
  return zs_coordinates_from(x[0], x[1], x[2]);
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const gap g = find_gap(node);
  zs_anchors a;
  if (g.t == 0 || g.t == 1)
    return zs_children_emit(compiler, g.shapes[g.t == 1], at);
  if (!find_anchors(node, &g, zs_compiler_arena(compiler), &a, zs_compiler_diag(compiler)))
    return zs_emit_constant(compiler, 0);
  double to_first[12], to_second[12];
  zs_rigid_at(&a.rigid, g.t, NULL, to_first);
  zs_rigid_at(&a.rigid, 1, to_second, NULL);
  const zs_coordinates frame = a.count ? zs_coordinates_affine(at, to_first) : *at;
  zs_coordinates first = frame, second = frame;
  if (a.straying) {
    zs_value ways[3] = {0};
    for (unsigned k = 0; k < a.dimension; k++)
      ways[k] = way_of(compiler, node, &a, k, &frame);
    first = moved(compiler, &frame, ways, a.dimension, -g.t);
    second = moved(compiler, &frame, ways, a.dimension, 1 - g.t);
  }
  if (a.count)
    second = zs_coordinates_affine(&second, to_second);
  return zs_emit_operation(compiler, &zs_interpolation, NULL,
                           zs_children_emit(compiler, g.shapes[0], &first),
                           zs_children_emit(compiler, g.shapes[1], &second),
                           zs_emit_constant(compiler, g.t));
}

/* ---- Where it is -------------------------------------------------------------------------------- */

static zs_box shape_box(const zs_node *part)
{
  zs_box all = zs_node_extent(part->children[0], NULL, NULL);
  for (size_t i = 1; i < part->child_count; i++)
    all = zs_box_of_union(
      part, (const zs_box[2]){all, zs_node_extent(part->children[i], NULL, NULL)}, 2);
  return all;
}

/* Where both shapes come to by the rigid motion: beyond, neither is, and f is not positive.  What
 * strays from it gets room. */
static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)children, (void)count;
  static const double MARGIN = 0.25; /* of the whole, beyond the longest way */
  const gap g = find_gap(node);
  if (g.t == 0 || g.t == 1)
    return shape_box(g.shapes[g.t == 1]);
  zs_arena arena = {0};
  zs_anchors a;
  if (!find_anchors(node, &g, &arena, &a, NULL)) {
    zs_arena_free(&arena);
    return zs_box_everything();
  }
  double to_first[12], ahead[12], to_second[12];
  zs_rigid_at(&a.rigid, g.t, NULL, to_first);
  zs_rigid_at(&a.rigid, 1, ahead, NULL);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 4; j++) {
      to_second[4 * i + j] = j == 3 ? ahead[4 * i + 3] : 0;
      for (int k = 0; k < 3; k++)
        to_second[4 * i + j] += ahead[4 * i + k] * to_first[4 * k + j];
    }
  const zs_box first = shape_box(g.shapes[0]), second = shape_box(g.shapes[1]);
  const zs_box at[2] = {zs_box_image(&first, to_first), zs_box_image(&second, to_second)};
  const zs_box all = zs_box_of_union(node, at, 2);
  double longest = 0, size = 0;
  for (size_t i = 0; i < a.dimension * a.count; i++)
    longest = fmax(longest, fabs(a.ways[i]));
  for (int k = 0; k < 3; k++)
    if (all.hi[k] - all.lo[k] < INFINITY)
      size = fmax(size, all.hi[k] - all.lo[k]);
  zs_arena_free(&arena);
  return a.straying ? zs_box_grown(all, longest + MARGIN * size) : all;
}

const zs_kind zs_kind_distance_morph = {
  .name = "distance-morph",
  .family = ZS_FAMILY_INTERPOLATION,
  .summary = "a solid that becomes another one, with its anchors carried along",
  .doc = "At the part t of the way from a shape with f0 to the next, with f1, f = (1 - t) f0(B0(x)) "
         "+ t f1(B1(x)). Without pairs B0 and B1 change nothing. With them, each anchor goes from p "
         "to q: on the way it is at m = L_t((1 - t) p + t L_1^-1(q)), where L_1 is the rigid motion "
         "that brings all p nearest to their q, and L_t the part t of it: a rotation about the "
         "anchors' middle, which goes straight. B0 and B1 carry every m back to its p and its q, "
         "rigidly, and as smoothly as `radial` can. In print the elastic part follows the rigid "
         "one, by which the way depends on where the origin is and on which shape is the first; "
         "here it does not. Pairs whose rest after the rigid motion is nothing keep all distances: "
         "a shape that becomes itself elsewhere stays congruent. One pair moves everything along; "
         "two, or pairs on one line, turn it no further than they must; mirror images are turned, "
         "not mirrored. If z is 0 in all pairs they are of the x-y plane, and every plane above is "
         "moved the same. Shapes are to have fields of like steepness, such as distances; see "
         "`normalize`. Solving takes time with the cube of the number of pairs, evaluating the "
         "time of both shapes and of three sums over the pairs.",
  .source = "D. Cohen-Or, D. Levin, A. Solomovici, Three-dimensional distance field metamorphosis, "
            "1998; K. Arun, T. Huang, S. Blostein, Least-squares fitting of two 3-D point sets, "
            "1987",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct distance_morph),
  .children = ZS_CHILDREN_NONE,
  .parts = parts,
  .check = check,
  .emit = emit,
  .box = box,
};
