/* Parts of <variational> that lie in a plane: contours and pictures. */
#include "nodes/variational.h"

#include "base/names.h"
#include "files/svg.h"
#include "nodes/outlined.h"
#include "rbf/contour.h"

#include <math.h>
#include <string.h>

/* Where the plane lies. */
struct plane {
  double z, origin[3], u[3], v[3];
};

struct contour {
  struct plane plane;
  zs_numbers points;
  const char *src;
  double spacing;
};

struct picture {
  struct plane plane;
  const char *src;
  double pixel, level;
  int y;
};

static const char *const words[] = {"auto", NULL};
static const char *const directions[] = {"up", "down", NULL};
enum { Y_UP };

#define DIRECTION(struct_, member, name_, doc_) \
  {.name = name_, .type = ZS_VECTOR3, .offset = offsetof(struct_, member), .initial = "", \
   .unit = "1", .doc = doc_}
#define PLANE(struct_) \
  ZS_LENGTH(struct_, plane.z, "z", "", ZS_RANGE_ANY, \
            "height of the plane, across the z axis; left out of all parts: the fit is a 2D " \
            "shape, which does not depend on z"), \
  ZS_POINT(struct_, plane.origin, "origin", "0 0 0", "where the plane's own (0, 0) is"), \
  DIRECTION(struct_, plane.u, "u", \
            "with `v`, for a plane that leans: where the plane's first coordinate grows"), \
  DIRECTION(struct_, plane.v, "v", "where its second coordinate grows")

static const zs_attribute contour_attributes[] = {
  {.name = "points", .type = ZS_NUMBERS, .offset = offsetof(struct contour, points),
   .initial = "", .unit = "length",
   .doc = "x and y of every corner in order, either way round; the last is joined to the first"},
  {.name = "src", .type = ZS_FILE, .offset = offsetof(struct contour, src), .initial = "",
   .unit = "",
   .doc = "instead of `points`: a text file of one corner a line; blank lines end a ring, and "
          "rings inside others are holes; or an SVG file, as `path` reads it"},
  {.name = "spacing", .type = ZS_NUMBER, .offset = offsetof(struct contour, spacing),
   .initial = "auto", .unit = "length", .range = ZS_RANGE_POSITIVE,
   .choices = words,
   .doc = "the farthest that constraints on an edge are apart; auto is a 96th of twice the largest "
          "distance from the contour's middle. They are nearer together towards sharp corners"},
  PLANE(struct contour),
};

static const zs_attribute image_attributes[] = {
  {.name = "src", .type = ZS_FILE, .offset = offsetof(struct picture, src), .unit = "",
   .doc = "a PNG or PGM file, or the first page of a TIFF file; white is inside"},
  ZS_LENGTH(struct picture, pixel, "pixel", "1", ZS_RANGE_POSITIVE, "side of a pixel"),
  {.name = "level", .type = ZS_NUMBER, .offset = offsetof(struct picture, level),
   .initial = "0.5", .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 0.001, .maximum = 1,
   .doc = "brightness of the surface, where 0 is black and 1 is white"},
  ZS_SELECT(struct picture, y, "y", "up", directions,
            "`up`: the last row of pixels is at the plane's (0, 0); `down`: the first one is, and "
            "y grows from row to row"),
  PLANE(struct picture),
};

/* ---- Checks ------------------------------------------------------------------------- */

static bool check_plane(const zs_node *node, const struct plane *plane, zs_diag *diag)
{
  const bool has_u = zs_node_has(node, "u"), has_v = zs_node_has(node, "v");
  if (has_u != has_v)
    return zs_node_misuse(node, diag, has_u ? "u" : "v", "'u' and 'v' go together; '%s' is missing",
                          has_u ? "v" : "u");
  if (has_u && zs_node_has(node, "z"))
    return zs_node_misuse(node, diag, "z", "'z' cannot be combined with 'u' and 'v'; 'origin' says "
                          "where the plane is");
  if (zs_node_has(node, "z") && plane->origin[2] != 0)
    return zs_node_misuse(node, diag, "z", "both 'z' and 'origin' say how high the plane is");
  if (!has_u)
    return true;
  if (!zs_node_check_direction(node, diag, "u", plane->u) ||
      !zs_node_check_direction(node, diag, "v", plane->v))
    return false;
  double square = 0, uu = 0, vv = 0;
  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const double c = plane->u[i] * plane->v[j] - plane->u[j] * plane->v[i];
    square += c * c;
    uu += plane->u[k] * plane->u[k];
    vv += plane->v[k] * plane->v[k];
  }
  return square > 1e-18 * uu * vv ||
         zs_node_fail(node, diag, "v", "'u' and 'v' are parallel, and make no plane");
}

static bool check_contour(const zs_node *node, zs_diag *diag)
{
  const struct contour *p = node->parameters;
  const bool points = zs_node_has(node, "points"), src = zs_node_has(node, "src");
  if (points == src)
    return zs_node_misuse(node, diag, points ? "src" : NULL,
                          points ? "'src' cannot be combined with 'points'"
                                 : "neither 'points' nor 'src' is there; expected one of them");
  if (points && p->points.count % 2)
    return zs_node_fail(node, diag, "points", "there are %zu numbers; expected an even number, x "
                        "and y of every corner", p->points.count);
  return check_plane(node, &p->plane, diag);
}

static bool check_image(const zs_node *node, zs_diag *diag)
{
  return check_plane(node, &((const struct picture *)node->parameters)->plane, diag);
}

bool zs_variational_is_flat(const zs_node *part)
{
  const struct plane *plane = part->kind == &zs_variational_contour
                                ? &((const struct contour *)part->parameters)->plane
                                : &((const struct picture *)part->parameters)->plane;
  return !zs_node_has(part, "z") && !zs_node_has(part, "u") && plane->origin[2] == 0;
}

/* ---- Samples ------------------------------------------------------------------------ */

/* The plane in space; one unit along it is `unit`. */
static zs_rbf_plane plane_of(const struct plane *p, double unit)
{
  zs_rbf_plane plane = {.u = {unit, 0, 0}, .v = {0, unit, 0}};
  memcpy(plane.origin, p->origin, sizeof plane.origin);
  if (!isnan(p->z))
    plane.origin[2] = p->z;
  for (int k = 0; !isnan(p->u[0]) && k < 3; k++) {
    plane.u[k] = unit * p->u[k];
    plane.v[k] = unit * p->v[k];
  }
  return plane;
}

/* The boundary of what an SVG file fills. */
static bool read_svg(zs_rings *rings, const zs_node *part, const char *path, zs_diag *diag)
{
  static const double tolerance = 1e-3; /* by the size of the whole: constraints are no denser */
  zs_outline outline;
  zs_fill fill;
  *rings = (zs_rings){0};
  if (!zs_svg_read(&outline, path, NULL, false, diag))
    return false;
  const bool filled =
    zs_outlined_fill(&outline, tolerance, false, part, "src", NULL, &fill, diag);
  zs_outline_clear(&outline);
  if (!filled)
    return false;
  const bool memory = zs_fill_rings(&fill, &rings->points, &rings->ends, &rings->ring_count);
  rings->point_count = fill.count;
  zs_fill_clear(&fill);
  return memory || zs_fail_memory(diag);
}

static bool read_contour(zs_rings *rings, const zs_node *part, zs_diag *diag)
{
  const struct contour *p = part->parameters;
  if (!p->src)
    return zs_rings_make(rings, p->points.values, p->points.count / 2, diag);
  return zs_name_ends_in(p->src, ".svg") ? read_svg(rings, part, p->src, diag)
                                         : zs_rings_read(rings, p->src, diag);
}

bool zs_variational_add_contour(zs_rbf_samples *list, const zs_node *part, zs_diag *diag)
{
  const struct contour *p = part->parameters;
  const zs_rbf_plane plane = plane_of(&p->plane, 1);
  const zs_place place = zs_node_place(part, p->src ? "src" : "points");
  zs_rings rings;
  if (!read_contour(&rings, part, diag))
    return false;
  const bool done = zs_rbf_contour_add(list, &rings, &plane, p->spacing, &place, diag);
  zs_rings_clear(&rings);
  return done;
}

bool zs_variational_add_image(zs_rbf_samples *list, const zs_node *part, bool *empty,
                              zs_diag *diag)
{
  const struct picture *p = part->parameters;
  const zs_rbf_plane plane = plane_of(&p->plane, p->pixel);
  const size_t before = list->count;
  zs_gray gray;
  if (!zs_gray_read(&gray, p->src, 1, diag))
    return false;
  const bool done = zs_rbf_picture_add(list, &gray, p->level, p->y != Y_UP, &plane, diag);
  zs_gray_clear(&gray);
  *empty = done && list->count == before;
  return done;
}

static double distance_to_samples(const zs_rbf_samples *list, size_t count, const double at[3])
{
  double least = INFINITY;
  for (size_t i = 0; i < count; i++) {
    const double *p = list->samples[i].position;
    least = fmin(least, hypot(hypot(p[0] - at[0], p[1] - at[1]), p[2] - at[2]));
  }
  return least;
}

/* The solid ends somewhere between the nearest samples and here: at half way, as
 * far as one can tell. */
bool zs_variational_add_empty(zs_rbf_samples *list, const zs_node *part, zs_diag *diag)
{
  enum { ACROSS = 8 };
  const struct picture *p = part->parameters;
  const zs_rbf_plane plane = plane_of(&p->plane, p->pixel);
  const size_t count = list->count;
  zs_gray gray;
  if (!zs_gray_read(&gray, p->src, 1, diag))
    return false;
  const double width = gray.width, height = gray.height;
  zs_gray_clear(&gray);
  for (int i = 0; i < ACROSS * ACROSS; i++) {
    const double a = width * (i % ACROSS + 0.5) / ACROSS, b = height * (i / ACROSS + 0.5) / ACROSS;
    zs_rbf_sample sample = {.value = 0};
    for (int k = 0; k < 3; k++)
      sample.position[k] = plane.origin[k] + a * plane.u[k] + b * plane.v[k];
    sample.value = -distance_to_samples(list, count, sample.position) / 2;
    if (sample.value < 0 && !zs_rbf_samples_add(list, &sample, diag))
      return false;
  }
  return true;
}

const zs_kind zs_variational_contour = {
  .name = "contour",
  .family = ZS_FAMILY_PART,
  .summary = "closed polygons in a plane, with normals across their edges",
  .doc = "Without `z`, `u` and `v` the plane is z = 0.",
  .attributes = contour_attributes,
  .attribute_count = ZS_COUNT_OF(contour_attributes),
  .parameters_size = sizeof(struct contour),
  .children = ZS_CHILDREN_NONE,
  .check = check_contour,
};

const zs_kind zs_variational_image = {
  .name = "image",
  .family = ZS_FAMILY_PART,
  .summary = "the outlines in a grey picture, where brightness passes through a level",
  .doc = "Constraints lie between neighbouring pixels, with normals against the gradient. Around "
         "the picture it is black. A picture without a pixel as bright as the level says that the "
         "solid ends before its plane.",
  .source = "Turk, O'Brien, \"Shape transformation using variational implicit functions\" (1999), "
            "section 4.1",
  .attributes = image_attributes,
  .attribute_count = ZS_COUNT_OF(image_attributes),
  .parameters_size = sizeof(struct picture),
  .children = ZS_CHILDREN_NONE,
  .check = check_image,
};
