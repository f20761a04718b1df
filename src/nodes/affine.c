/* Affine coordinate maps.  They compose into the matrix of the coordinates, so
 * that nesting them costs nothing. */
#include "nodes/common.h"
#include "nodes/extent.h"

#include <math.h>

/* The child where the inverse map leads, its f times `factor`. */
static zs_value mapped(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at,
                       const double inverse[12], double factor)
{
  zs_coordinates child = zs_coordinates_affine(at, inverse);
  return zs_emit_scaled(compiler, zs_children_emit(compiler, node, &child), factor);
}

/* The linear map `m` (3 x 3) about a fixed point, as a 3 x 4 matrix. */
static void about_point(const double m[9], const double point[3], double affine[12])
{
  for (int i = 0; i < 3; i++) {
    affine[4 * i + 3] = point[i];
    for (int j = 0; j < 3; j++) {
      affine[4 * i + j] = m[3 * i + j];
      affine[4 * i + 3] -= m[3 * i + j] * point[j];
    }
  }
}

/* ---- translate ------------------------------------------------------------- */

struct translate {
  double by[3];
};

static const zs_attribute translate_attributes[] = {
  ZS_POINT(struct translate, by, "by", NULL, "how far the child moves"),
};

static zs_box translate_box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct translate *p = node->parameters;
  zs_box box = children[0];
  for (int k = 0; k < 3; k++) {
    box.lo[k] += p->by[k];
    box.hi[k] += p->by[k];
  }
  return box;
}

static zs_value translate_emit(zs_compiler *compiler, const zs_node *node,
                               const zs_coordinates *at)
{
  const struct translate *p = node->parameters;
  zs_coordinates moved = zs_coordinates_moved(at, p->by);
  return zs_children_emit(compiler, node, &moved);
}

const zs_kind zs_kind_translate = {
  .name = "translate",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the child moved",
  .trait = "keeps distances",
  .attributes = translate_attributes,
  .attribute_count = ZS_COUNT_OF(translate_attributes),
  .parameters_size = sizeof(struct translate),
  .children = ZS_CHILDREN_ONE,
  .map = {"x - by.x", "y - by.y", "z - by.z"},
  .emit = translate_emit,
  .box = translate_box,
};

/* ---- rotate ---------------------------------------------------------------- */

struct rotate {
  double angle, about[3];
  int axis;
};

static const zs_attribute rotate_attributes[] = {
  ZS_AXIS(struct rotate, axis, "direction of the axis of rotation"),
  ZS_ANGLE(struct rotate, angle, "angle", NULL,
           "counter-clockwise, seen from the axis' positive end"),
  ZS_POINT(struct rotate, about, "about", "0 0 0", "a point of the axis"),
};

/* Cosine and sine of an angle in degrees, exact for quarter turns. */
static void turn(double degrees, double *cosine, double *sine)
{
  double r = remainder(degrees, 360);
  double quarters = nearbyint(r / 90), radians = (r - 90 * quarters) * 3.14159265358979323846 / 180;
  double c = cos(radians), s = sin(radians);
  int q = ((int)quarters % 4 + 4) % 4;
  *cosine = q == 0 ? c : q == 1 ? -s : q == 2 ? -c : s;
  *sine = q == 0 ? s : q == 1 ? c : q == 2 ? -s : -c;
}

static void rotate_inverse(const zs_node *node, double inverse[12])
{
  const struct rotate *p = node->parameters;
  double m[9] = {0}, c, s;
  turn(p->angle, &c, &s);
  const int z = p->axis, x = (z + 1) % 3, y = (z + 2) % 3;
  m[4 * z] = 1;
  m[4 * x] = m[4 * y] = c;
  m[3 * x + y] = s;
  m[3 * y + x] = -s;
  about_point(m, p->about, inverse);
}

static zs_value rotate_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  double inverse[12];
  rotate_inverse(node, inverse);
  return mapped(compiler, node, at, inverse, 1);
}

static zs_box rotate_box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  double inverse[12];
  rotate_inverse(node, inverse);
  return zs_box_image(&children[0], inverse);
}

const zs_kind zs_kind_rotate = {
  .name = "rotate",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the child turned about an axis",
  .doc = "The formulas are for the axis z through the origin. For other axes, nest, or use the "
         "attribute `rotate` that every node has.",
  .trait = "keeps distances",
  .attributes = rotate_attributes,
  .attribute_count = ZS_COUNT_OF(rotate_attributes),
  .parameters_size = sizeof(struct rotate),
  .children = ZS_CHILDREN_ONE,
  .map = {"x * cos(rad(angle)) + y * sin(rad(angle))", "y * cos(rad(angle)) - x * sin(rad(angle))",
          "z"},
  .emit = rotate_emit,
  .box = rotate_box,
};

/* ---- scale ----------------------------------------------------------------- */

struct scale {
  double by[3], about[3];
};

static const zs_attribute scale_attributes[] = {
  {.name = "by",
   .type = ZS_SCALE,
   .offset = offsetof(struct scale, by),
   .initial = NULL,
   .unit = "1",
   .range = ZS_RANGE_NOT_ZERO,
   .doc = "factors along x, y and z, or one for all; negative ones mirror"},
  ZS_POINT(struct scale, about, "about", "0 0 0", "the point that stays where it is"),
};

static void scale_inverse(const zs_node *node, double inverse[12])
{
  const struct scale *p = node->parameters;
  const double m[9] = {1 / p->by[0], 0, 0, 0, 1 / p->by[1], 0, 0, 0, 1 / p->by[2]};
  about_point(m, p->about, inverse);
}

static zs_box scale_box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  double inverse[12];
  scale_inverse(node, inverse);
  return zs_box_image(&children[0], inverse);
}

static zs_value scale_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct scale *p = node->parameters;
  double inverse[12];
  scale_inverse(node, inverse);
  double factor = fmin(fabs(p->by[0]), fmin(fabs(p->by[1]), fabs(p->by[2])));
  return mapped(compiler, node, at, inverse, factor);
}

#define SCALED(X) "about." X " + (" X " - about." X ") / by." X

const zs_kind zs_kind_scale = {
  .name = "scale",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the child made larger or smaller",
  .doc = "f is multiplied by the least factor, so that a distance bound stays one.",
  .trait = "keeps distance bounds; exact distances when the factors are equal",
  .attributes = scale_attributes,
  .attribute_count = ZS_COUNT_OF(scale_attributes),
  .parameters_size = sizeof(struct scale),
  .children = ZS_CHILDREN_ONE,
  .map = {SCALED("x"), SCALED("y"), SCALED("z")},
  .formula = "f * min(abs(by.x), min(abs(by.y), abs(by.z)))",
  .emit = scale_emit,
  .box = scale_box,
};

/* ---- stretch --------------------------------------------------------------- */

static zs_value stretch_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  double inverse[12];
  scale_inverse(node, inverse);
  return mapped(compiler, node, at, inverse, 1);
}

const zs_kind zs_kind_stretch = {
  .name = "stretch",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the child drawn out along the axes, its values with it",
  .doc = "The solid is that of `scale`. f is not multiplied but keeps the values it had, so that "
         "offsets and blends outside of it are drawn out as well.",
  .source = "V. Adzhiev et al., HyperFun project (hfStretch3D), 1999",
  .attributes = scale_attributes,
  .attribute_count = ZS_COUNT_OF(scale_attributes),
  .parameters_size = sizeof(struct scale),
  .children = ZS_CHILDREN_ONE,
  .map = {SCALED("x"), SCALED("y"), SCALED("z")},
  .emit = stretch_emit,
  .box = scale_box,
};

/* ---- mirror ---------------------------------------------------------------- */

struct mirror {
  double normal[3], point[3];
};

static const zs_attribute mirror_attributes[] = {
  {.name = "normal",
   .type = ZS_VECTOR3,
   .offset = offsetof(struct mirror, normal),
   .initial = NULL,
   .unit = "1",
   .doc = "direction across the mirror's plane, of any length"},
  ZS_POINT(struct mirror, point, "point", "0 0 0", "a point of the plane"),
};

static bool mirror_check(const zs_node *node, zs_diag *diag)
{
  const struct mirror *p = node->parameters;
  return zs_node_check_direction(node, diag, "normal", p->normal);
}

static void mirror_inverse(const zs_node *node, double inverse[12])
{
  const struct mirror *p = node->parameters;
  const double length = hypot(hypot(p->normal[0], p->normal[1]), p->normal[2]);
  double m[9];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      m[3 * i + j] = (i == j) - 2 * (p->normal[i] / length) * (p->normal[j] / length);
  about_point(m, p->point, inverse);
}

static zs_value mirror_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  double inverse[12];
  mirror_inverse(node, inverse);
  return mapped(compiler, node, at, inverse, 1);
}

static zs_box mirror_box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  double inverse[12];
  mirror_inverse(node, inverse);
  return zs_box_image(&children[0], inverse);
}

/* How far the point is along the normal, twice, by the normal's square. */
#define ACROSS \
  "let k = 2 * ((x - point.x) * normal.x + (y - point.y) * normal.y + (z - point.z) * normal.z) " \
  "/ (normal.x^2 + normal.y^2 + normal.z^2); "

const zs_kind zs_kind_mirror = {
  .name = "mirror",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the child seen in a mirror",
  .doc = "Only the image is left; unite it with the child for a symmetric solid.",
  .trait = "keeps distances",
  .attributes = mirror_attributes,
  .attribute_count = ZS_COUNT_OF(mirror_attributes),
  .parameters_size = sizeof(struct mirror),
  .children = ZS_CHILDREN_ONE,
  .map = {ACROSS "x - k * normal.x", ACROSS "y - k * normal.y", ACROSS "z - k * normal.z"},
  .check = mirror_check,
  .emit = mirror_emit,
  .box = mirror_box,
};

/* ---- matrix ---------------------------------------------------------------- */

struct matrix {
  zs_numbers values;
};

static const zs_attribute matrix_attributes[] = {
  {.name = "values",
   .type = ZS_NUMBERS,
   .offset = offsetof(struct matrix, values),
   .initial = NULL,
   .unit = "1",
   .doc = "12 or 16 numbers, row by row: the matrix that takes the child's coordinates to the "
          "scene's; the last row of 16 is 0 0 0 1"},
};

bool zs_affine_invert(const double a[12], double inverse[12])
{
  double cofactor[9], largest = 0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      cofactor[3 * i + j] = a[4 * i1 + j1] * a[4 * i2 + j2] - a[4 * i1 + j2] * a[4 * i2 + j1];
      largest = fmax(largest, fabs(a[4 * i + j]));
    }
  const double determinant = a[0] * cofactor[0] + a[1] * cofactor[1] + a[2] * cofactor[2];
  if (!(fabs(determinant) > 1e-14 * largest * largest * largest))
    return false;
  for (int i = 0; i < 3; i++) {
    inverse[4 * i + 3] = 0;
    for (int j = 0; j < 3; j++) {
      inverse[4 * i + j] = cofactor[3 * j + i] / determinant;
      inverse[4 * i + 3] -= inverse[4 * i + j] * a[4 * j + 3];
    }
  }
  return true;
}

/* The least factor by which the matrix stretches a vector: its smallest
 * singular value, by one-sided Jacobi rotations of its columns. */
static double least_stretch(const double a[12])
{
  double column[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      column[j][i] = a[4 * i + j];
  for (int sweep = 0; sweep < 30; sweep++) {
    bool rotated = false;
    for (int p = 0; p < 2; p++)
      for (int q = p + 1; q < 3; q++) {
        double pp = 0, qq = 0, pq = 0;
        for (int i = 0; i < 3; i++) {
          pp += column[p][i] * column[p][i];
          qq += column[q][i] * column[q][i];
          pq += column[p][i] * column[q][i];
        }
        if (fabs(pq) <= 1e-15 * sqrt(pp * qq))
          continue;
        rotated = true;
        double zeta = (qq - pp) / (2 * pq);
        double t = (zeta < 0 ? -1 : 1) / (fabs(zeta) + hypot(1, zeta));
        double c = 1 / hypot(1, t), s = c * t;
        for (int i = 0; i < 3; i++) {
          double u = column[p][i], v = column[q][i];
          column[p][i] = c * u - s * v;
          column[q][i] = s * u + c * v;
        }
      }
    if (!rotated)
      break;
  }
  double least = INFINITY;
  for (int j = 0; j < 3; j++)
    least = fmin(least, hypot(hypot(column[j][0], column[j][1]), column[j][2]));
  /* A rotation typed with a dozen digits does not scale. */
  return fabs(least - 1) < 1e-9 ? 1 : least;
}

static bool matrix_check(const zs_node *node, zs_diag *diag)
{
  const struct matrix *p = node->parameters;
  const double *v = p->values.values;
  double inverse[12];
  if (p->values.count != 12 && p->values.count != 16)
    return zs_node_fail(node, diag, "values", "there are %zu numbers; expected 12 or 16",
                        p->values.count);
  if (p->values.count == 16 && !(v[12] == 0 && v[13] == 0 && v[14] == 0 && v[15] == 1))
    return zs_node_fail(node, diag, "values",
                        "the last row is %g %g %g %g; expected 0 0 0 1: the map must be affine",
                        v[12], v[13], v[14], v[15]);
  if (!zs_affine_invert(v, inverse))
    return zs_node_fail(node, diag, "values",
                        "the matrix is singular: it flattens space; expected one with an inverse");
  return true;
}

static zs_value matrix_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct matrix *p = node->parameters;
  double inverse[12];
  zs_affine_invert(p->values.values, inverse);
  return mapped(compiler, node, at, inverse, least_stretch(p->values.values));
}

static zs_box matrix_box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct matrix *p = node->parameters;
  double inverse[12];
  zs_affine_invert(p->values.values, inverse);
  return zs_box_image(&children[0], inverse);
}

const zs_kind zs_kind_matrix = {
  .name = "matrix",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the child under any affine map",
  .doc = "f is multiplied by the least factor by which the map stretches, so that a distance bound "
         "stays one.",
  .trait = "keeps distance bounds; exact distances when the map is rigid",
  .attributes = matrix_attributes,
  .attribute_count = ZS_COUNT_OF(matrix_attributes),
  .parameters_size = sizeof(struct matrix),
  .children = ZS_CHILDREN_ONE,
  .check = matrix_check,
  .emit = matrix_emit,
  .box = matrix_box,
};
