/* Surfaces through points, and shapes that become each other: the fits are made
 * in src/rbf. */
#include "nodes/variational.h"

#include "field/program.h"
#include "nodes/radial.h"

#include <math.h>
#include <string.h>

static const char *const kernels[] = {"auto", "r", "r3", "r5", "tps2", "tps4", "gaussian",
                                      NULL};
static const char *const sides[] = {"both", "in", NULL};
static const char *const dimensions[] = {"auto", "2", "3", NULL};
static const char *const words[] = {"auto", NULL};

/* The box around the constraints grows by this part of its longest side; between
 * shapes there may be more than they hold themselves. */
static const double MARGIN = 0.05, MARGIN_BETWEEN = 0.25;

static const zs_attribute attributes[] = {
  ZS_SELECT(struct variational, kernel, "kernel", "auto", kernels,
            "the radial function: r, r3 (r^3), r5 (r^5), tps2 (r^2 log r), tps4 (r^4 log r) or "
            "gaussian (exp(-r^2 / sigma^2)); auto is tps2 in 2 and 4 dimensions, r3 in 3 and 5"),
  {.name = "sigma", .type = ZS_NUMBER, .offset = offsetof(struct variational, sigma),
   .initial = "auto", .unit = "length", .range = ZS_RANGE_POSITIVE, .choices = words,
   .doc = "width of the gaussian kernel: a few of it away from all points f is but a linear "
          "function, and may be positive; many times as wide as points are apart, it makes "
          "singular equations; auto is the widest that is far from that"},
  {.name = "degree", .type = ZS_INTEGER, .offset = offsetof(struct variational, degree),
   .initial = "1", .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 1, .maximum = 2,
   .doc = "of the polynomial: shapes of that degree are met exactly; r5 and tps4 have 2 always"},
  ZS_SELECT(struct variational, dimension, "dimension", "auto", dimensions,
            "2: a 2D shape, and z of its parts is left out; 3: a solid; auto is 2 when all parts "
            "are contours and images without `z`, `u` and `v`"),
  {.name = "normal-offset", .type = ZS_NUMBER,
   .offset = offsetof(struct variational, normal_offset), .initial = "auto", .unit = "length",
   .range = ZS_RANGE_POSITIVE, .choices = words,
   .doc = "how far from a point with a normal the constraints lie that say which side is inside, "
          "or less where the surface bends or comes near itself; auto is a hundredth of "
          "twice the points' largest distance from their middle"},
  ZS_SELECT(struct variational, sides, "sides", "both", sides,
            "whether normals make constraints on both sides of the surface or inside only"),
  ZS_PLAIN(struct variational, smoothing, "smoothing", "0", ZS_RANGE_NOT_NEGATIVE,
           "0 passes through every point; more lets the surface miss them to be smoother "
           "(1e-6 is a light touch), in units of twice the points' largest distance from their "
           "middle"),
  {.name = "budget", .type = ZS_INTEGER, .offset = offsetof(struct variational, budget),
   .initial = "", .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 4, .maximum = INFINITY,
   .doc = "how many constraints to use at most: those that the others would miss most"},
  ZS_LENGTH(struct variational, tolerance, "tolerance", "", ZS_RANGE_POSITIVE,
            "how far f may miss a constraint: no more are used than that takes"),
  {.name = "accuracy", .type = ZS_NUMBER, .offset = offsetof(struct variational, accuracy),
   .initial = "1e-6", .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 1e-12, .maximum = 0.01,
   .doc = "how far values near the surface may be off, as a part of what f varies over the "
          "constraints: what is far away is added up approximately"},
  {.name = "slice", .type = ZS_NUMBERS, .offset = offsetof(struct variational, slice),
   .initial = "", .unit = "1",
   .doc = "with `shape` parts: where f is between them, in the coordinates of their `at`; no more "
          "than 5 dimensions in all. One fit serves all values of it"},
  {.name = "separation", .type = ZS_NUMBER, .offset = offsetof(struct variational, separation),
   .initial = "auto", .unit = "length", .range = ZS_RANGE_POSITIVE, .choices = words,
   .doc = "length of one unit of `slice` and `at`: when it is short, shapes become each other "
          "point by point; when it is long, they grow and flow together; auto is a quarter of "
          "twice the largest distance from the middle of a shape"},
};

/* ---- Checks ---------------------------------------------------------------------- */

static const zs_node *nth_shape(const zs_node *node, size_t n)
{
  for (size_t i = 0; i < node->child_count; i++)
    if (node->children[i]->kind == &zs_variational_shape && n-- == 0)
      return node->children[i];
  return NULL;
}

static size_t count_parts(const zs_node *node, const zs_kind *kind)
{
  size_t count = 0;
  for (size_t i = 0; i < node->child_count; i++)
    count += node->children[i]->kind == kind;
  return count;
}

unsigned zs_variational_space(const zs_node *node)
{
  const int chosen = ((const struct variational *)node->parameters)->dimension;
  return chosen == ZS_VARIATIONAL_PLANE   ? 2
         : chosen == ZS_VARIATIONAL_SPACE ? 3
                                          : zs_variational_dimension(node);
}

/* Parts that lie somewhere else in space cannot be a 2D shape. */
static bool check_flat(const zs_node *node, zs_diag *diag)
{
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    const bool plane =
      part->kind == &zs_variational_contour || part->kind == &zs_variational_image;
    if (plane && !zs_variational_is_flat(part))
      return zs_node_misuse(part, diag, zs_node_has(part, "z") ? "z" : NULL,
                            "the part lies in space, but the fit has dimension=\"2\"");
    if (part->kind == &zs_variational_shape && !check_flat(part, diag))
      return false;
  }
  return true;
}

static bool check_shape(const zs_node *node, const zs_node *shape, zs_diag *diag)
{
  const size_t extra = ((const struct variational *)node->parameters)->slice.count;
  const size_t count = zs_variational_shape_at(shape)->count;
  return count == extra || zs_node_misuse(shape, diag, "at", "%zu number%s, but 'slice' has %zu",
                                          count, count == 1 ? "" : "s", extra);
}

static bool check_pairs(const zs_node *node, size_t shapes, zs_diag *diag)
{
  for (size_t i = 0; i < node->child_count; i++)
    if (node->children[i]->kind == &zs_variational_pair && shapes != 2)
      return zs_node_misuse(node->children[i], diag, NULL,
                            "pairs need two shapes; there %s %zu", shapes == 1 ? "is" : "are",
                            shapes);
  if (shapes != 2 || count_parts(node, &zs_variational_pair) == 0)
    return true;
  const zs_numbers *a = zs_variational_shape_at(nth_shape(node, 0));
  const zs_node *second = nth_shape(node, 1);
  const zs_numbers *b = zs_variational_shape_at(second);
  return memcmp(a->values, b->values, a->count * sizeof *a->values) != 0 ||
         zs_node_fail(second, diag, "at", "both shapes are in the same place");
}

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct variational *p = node->parameters;
  const size_t shapes = count_parts(node, &zs_variational_shape);
  const size_t pairs = count_parts(node, &zs_variational_pair);
  const unsigned space = zs_variational_space(node);
  if (space == 2 && p->dimension == ZS_VARIATIONAL_PLANE && !check_flat(node, diag))
    return false;
  if (p->sigma > 0 && p->kernel != ZS_RBF_GAUSSIAN + 1)
    return zs_node_misuse(node, diag, "sigma", "only kernel=\"gaussian\" has a width");
  if (!check_pairs(node, shapes, diag))
    return false;
  if (shapes == 0)
    return p->slice.count == 0 ||
           zs_node_misuse(node, diag, "slice", "there are no shapes to be between; expected "
                          "<shape at=\"...\"> parts");
  if (p->slice.count == 0)
    return zs_node_misuse(node, diag, NULL,
                          "'slice' is missing; expected where between the shapes f is");
  if (shapes + pairs < node->child_count)
    return zs_node_misuse(node, diag, NULL, "parts stand beside the shapes; expected them inside");
  if (space + p->slice.count > ZS_RBF_MAXIMUM_DIMENSION)
    return zs_node_misuse(node, diag, "slice", "%zu numbers and %u dimensions are more than %d",
                          p->slice.count, space, ZS_RBF_MAXIMUM_DIMENSION);
  for (size_t i = 0; i < shapes; i++)
    if (!check_shape(node, nth_shape(node, i), diag))
      return false;
  return true;
}

/* ---- f --------------------------------------------------------------------------- */

zs_value zs_variational_sum_emit(zs_compiler *compiler, const zs_rbf_sum *sum, const zs_rbf *rbf,
                                 const zs_coordinates *at)
{
  const double *c = rbf->centre, s = 1 / rbf->size;
  const double to_unit_box[12] = {s, 0, 0, -c[0] * s, 0, s, 0, -c[1] * s, 0, 0, s, -c[2] * s};
  zs_coordinates unit = zs_coordinates_affine(at, to_unit_box);
  zs_value u[3];
  for (int k = 0; k < 3; k++)
    u[k] = k < 2 || !sum->terms.flat ? zs_emit_coordinate(compiler, &unit, k)
                                     : zs_emit_constant(compiler, 0);
  return zs_emit_operation(compiler, zs_rbf_sum_operation(sum->kernel), sum, u[0], u[1], u[2]);
}

static void describe(zs_compiler *compiler, const zs_node *node, const zs_variational_fit *fit,
                     const zs_coordinates *at)
{
  zs_fit_info info = zs_radial_info(node, fit->rbf);
  if (fit->point_count)
    info.points = zs_coordinates_to_scene(compiler, at, fit->points, fit->point_count);
  info.point_count = info.points ? fit->point_count : 0;
  zs_compiler_add_fit(compiler, &info);
}

/* How far the slice is on the way from the first shape to the second. */
static double time_of(const zs_node *node)
{
  const zs_numbers *slice = &((const struct variational *)node->parameters)->slice;
  const double *a = zs_variational_shape_at(nth_shape(node, 0))->values;
  const double *b = zs_variational_shape_at(nth_shape(node, 1))->values;
  double along = 0, square = 0;
  for (size_t k = 0; k < slice->count; k++) {
    along += (slice->values[k] - a[k]) * (b[k] - a[k]);
    square += (b[k] - a[k]) * (b[k] - a[k]);
  }
  return fmin(fmax(along / square, 0), 1);
}

static zs_value emit_fit(zs_compiler *compiler, const zs_node *node, const zs_variational_fit *fit,
                         const zs_coordinates *at)
{
  const struct variational *p = node->parameters;
  const zs_rbf *rbf = fit->rbf;
  double beyond[3] = {0, 0, 0}; /* space */
  for (size_t k = 0; k < p->slice.count; k++)
    beyond[k] = fit->separation * p->slice.values[k];
  zs_variational_sum *sum =
    zs_variational_sum_find(fit, zs_variational_space(node), beyond, p->accuracy,
                            zs_compiler_cache(compiler), zs_compiler_control(compiler),
                            zs_compiler_diag(compiler));
  if (!sum)
    return zs_emit_constant(compiler, 0);
  if (!zs_compiler_keep(compiler, sum, zs_variational_sum_unref))
    return zs_emit_constant(compiler, 0);
  describe(compiler, node, fit, at);
  return zs_variational_sum_emit(compiler, zs_variational_sum_data(sum), rbf, at);
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  zs_diag *diag = zs_compiler_diag(compiler);
  const zs_control *control = zs_compiler_control(compiler);
  zs_variational_warp warp;
  zs_variational_fit *fit = NULL;
  zs_value f = zs_emit_constant(compiler, 0);
  if (zs_variational_warp_make(&warp, node, zs_variational_space(node), control, diag))
    fit = zs_variational_fit_find(node, &warp, zs_compiler_cache(compiler), control, diag);
  if (fit) {
    const double time = warp.dimension ? time_of(node) : 0;
    const zs_coordinates half = zs_variational_warp_emit(compiler, &warp, time, at);
    f = emit_fit(compiler, node, fit, &half);
    zs_variational_fit_unref(fit);
  }
  zs_variational_warp_clear(&warp);
  return f;
}

/* ---- Where it is ------------------------------------------------------------------ */

static void enclose(zs_box *box, const zs_node *node, unsigned space)
{
  zs_rbf_samples samples = {0};
  if (!zs_variational_gather(node, space, &samples, NULL))
    samples.count = 0;
  for (size_t i = 0; i < samples.count; i++)
    for (int k = 0; k < 3; k++) {
      box->lo[k] = fmin(box->lo[k], samples.samples[i].position[k]);
      box->hi[k] = fmax(box->hi[k], samples.samples[i].position[k]);
    }
  zs_rbf_samples_clear(&samples);
}

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)children, (void)count;
  const struct variational *p = node->parameters;
  const unsigned space = zs_variational_space(node);
  const size_t shapes = count_parts(node, &zs_variational_shape);
  zs_box result = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
  for (size_t i = 0; i < shapes; i++)
    enclose(&result, nth_shape(node, i), space);
  if (shapes == 0)
    enclose(&result, node, space);
  double longest = 0;
  for (int k = 0; k < 3; k++)
    longest = fmax(longest, result.hi[k] - result.lo[k]);
  const double margin = (shapes ? MARGIN_BETWEEN : MARGIN) * longest +
                        (p->normal_offset > 0 ? p->normal_offset : 0);
  for (unsigned k = 0; k < 3; k++) {
    result.lo[k] = k < space ? result.lo[k] - margin : -INFINITY;
    result.hi[k] = k < space ? result.hi[k] + margin : INFINITY;
  }
  return result;
}

static const zs_kind *const parts[] = {
  &zs_variational_mesh, &zs_variational_points, &zs_variational_point, &zs_variational_contour,
  &zs_variational_image, &zs_variational_shape, &zs_variational_pair, NULL};

const zs_kind zs_kind_variational = {
  .name = "variational",
  .family = ZS_FAMILY_INTERPOLATION,
  .summary = "the smoothest surface through points, and between shapes",
  .doc = "A sum of radial functions about the points and a polynomial, with the weights that give "
         "f its value at every point and bend it least. Points of the parts lie on the surface "
         "unless they have a value; those with normals also get constraints beside the surface. "
         "Either normals or values inside are needed. f is about the distance near the surface; "
         "far from the points it is not. Where points with normals enclose a solid, f is held to "
         "the side of places inside it and around it that they tell, also where there are no "
         "points. With `shape` parts the points also lie in dimensions beyond space, where `slice` "
         "says at which place f is: at a shape's `at` it is that shape, and between them what "
         "bends least. Two shapes 0 and 1 make a metamorphosis, `slice=\"{t}\"`; a third one "
         "beside their line draws it towards itself.",
  .source = "Turk, O'Brien, \"Shape transformation using variational implicit functions\" (1999)",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct variational),
  .children = ZS_CHILDREN_NONE,
  .parts = parts,
  .check = check,
  .emit = emit,
  .box = box,
};
