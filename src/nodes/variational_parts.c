/* Parts of <variational> that give samples of the surface. */
#include "nodes/variational.h"

#include "files/points.h"
#include "rbf/facing.h"
#include "rbf/fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct points_part {
  const char *src;
  int normals;
};

struct point_part {
  double at[3], normal[3], value;
};

struct shape_part {
  zs_numbers at;
};

static const char *const normals[] = {"auto", "estimate", "none", NULL};
enum { NORMALS_AUTO, NORMALS_ESTIMATE };

/* ---- Parts -------------------------------------------------------------------- */

static const zs_attribute points_attributes[] = {
  {.name = "src", .type = ZS_FILE, .offset = offsetof(struct points_part, src), .unit = "",
   .doc = "a text file of one point a line, or a PLY file"},
  ZS_SELECT(struct points_part, normals, "normals", "auto", normals,
            "`estimate`: points whose normal is not in the file get one from their neighbours; "
            "`none`: they get none; `auto`: they get one when nothing else says where the inside "
            "is"),
};

const zs_kind zs_variational_points = {
  .name = "points",
  .family = ZS_FAMILY_PART,
  .summary = "the points of a file, with their normals and values if it has them",
  .doc = "A line of text holds 3 numbers (x y z), 4 (and a value), 6 (and a normal) or 7 (a normal "
         "and a value), separated by spaces, tabs, commas or semicolons; a header line of the "
         "names x y z nx ny nz value may give another order, and columns with other names are "
         "ignored. '#' starts a comment. A PLY file has vertex properties of those names. Points "
         "without a value lie on the surface; a normal of 0 0 0 is unknown. Estimated normals are "
         "across the plane of a point's neighbours, all turned out of the solid; every connected "
         "part of the points is taken for the surface of a solid. Given normals are taken as they "
         "are, with a warning where a tenth of them point against their neighbours', or most point "
         "inwards.",
  .attributes = points_attributes,
  .attribute_count = ZS_COUNT_OF(points_attributes),
  .parameters_size = sizeof(struct points_part),
  .children = ZS_CHILDREN_NONE,
};

static const zs_attribute point_attributes[] = {
  ZS_POINT(struct point_part, at, "at", NULL, "where the point is"),
  {.name = "normal", .type = ZS_VECTOR3, .offset = offsetof(struct point_part, normal),
   .initial = "", .unit = "1", .doc = "direction out of the solid, of any length"},
  ZS_PLAIN(struct point_part, value, "value", "0", ZS_RANGE_ANY,
           "f at the point: positive inside, 0 on the surface"),
};

static bool check_point(const zs_node *node, zs_diag *diag)
{
  const struct point_part *p = node->parameters;
  return !zs_node_has(node, "normal") || zs_node_check_direction(node, diag, "normal", p->normal);
}

const zs_kind zs_variational_point = {
  .name = "point",
  .family = ZS_FAMILY_PART,
  .summary = "one point, with a normal or a value",
  .attributes = point_attributes,
  .attribute_count = ZS_COUNT_OF(point_attributes),
  .parameters_size = sizeof(struct point_part),
  .children = ZS_CHILDREN_NONE,
  .check = check_point,
};

/* ---- shape -------------------------------------------------------------------- */

static const zs_attribute shape_attributes[] = {
  {.name = "at", .type = ZS_NUMBERS, .offset = offsetof(struct shape_part, at), .unit = "1",
   .doc = "where the shape is beyond space: as many numbers as `slice` has"},
};

static const zs_kind *const shape_parts[] = {
  &zs_variational_mesh, &zs_variational_points, &zs_variational_point, &zs_variational_contour,
  &zs_variational_image, NULL};

const zs_kind zs_variational_shape = {
  .name = "shape",
  .family = ZS_FAMILY_PART,
  .summary = "one of the shapes that become each other",
  .attributes = shape_attributes,
  .attribute_count = ZS_COUNT_OF(shape_attributes),
  .parameters_size = sizeof(struct shape_part),
  .children = ZS_CHILDREN_NONE,
  .parts = shape_parts,
};

const zs_numbers *zs_variational_shape_at(const zs_node *shape)
{
  return &((const struct shape_part *)shape->parameters)->at;
}

/* ---- Samples ------------------------------------------------------------------- */

static bool has_normal(const zs_rbf_sample *sample)
{
  return sample->normal[0] != 0 || sample->normal[1] != 0 || sample->normal[2] != 0;
}

/* Warn of normals that came with points and cannot be meant: they are taken as they are. */
static bool check_normals(const zs_rbf_samples *list, size_t first, const zs_node *part,
                          zs_diag *diag)
{
  static const double MANY = 0.1, INSIDE_OUT = -0.25;
  const zs_place place = zs_node_place(part, "src");
  zs_rbf_facing facing;
  if (list->count > ZS_RBF_MAXIMUM_COUNT) /* which is refused later on */
    return true;
  if (!zs_rbf_facing_find(&facing, list, first))
    return zs_fail_memory(diag);
  if ((double)facing.against > MANY * (double)facing.looked_at)
    zs_report(diag, ZS_WARNING, ZS_ERROR_GEOMETRY, &place,
              "take the normals out of the file, and they are estimated",
              "%zu of %zu normals point against those of the points around them: the surface "
              "turns over there, or some of them are inside out", facing.against,
              facing.looked_at);
  else if (facing.outwards < INSIDE_OUT)
    zs_report(diag, ZS_WARNING, ZS_ERROR_GEOMETRY, &place, NULL,
              "the normals point inwards, so the solid is what lies around the points");
  return true;
}

static bool add_points(zs_rbf_samples *list, const zs_node *part, zs_diag *diag)
{
  const struct points_part *p = part->parameters;
  const size_t first = list->count;
  zs_points points;
  bool done = zs_points_read(&points, p->src, diag);
  for (size_t i = 0; done && i < points.count; i++) {
    zs_rbf_sample sample = {.value = points.values ? points.values[i] : 0};
    memcpy(sample.position, points.positions + 3 * i, sizeof sample.position);
    if (points.normals)
      memcpy(sample.normal, points.normals + 3 * i, sizeof sample.normal);
    sample.estimate = p->normals == NORMALS_ESTIMATE && !has_normal(&sample);
    done = zs_rbf_samples_add(list, &sample, diag);
  }
  done = done && (!points.normals || check_normals(list, first, part, diag));
  zs_points_clear(&points);
  return done;
}

static bool add_point(zs_rbf_samples *list, const zs_node *part, zs_diag *diag)
{
  const struct point_part *p = part->parameters;
  zs_rbf_sample sample = {.value = p->value};
  memcpy(sample.position, p->at, sizeof sample.position);
  if (zs_node_has(part, "normal"))
    memcpy(sample.normal, p->normal, sizeof sample.normal);
  return zs_rbf_samples_add(list, &sample, diag);
}

/* ---- All parts ------------------------------------------------------------------- */

static bool is_flat(const zs_node *part)
{
  return part->kind == &zs_variational_contour || part->kind == &zs_variational_image
           ? zs_variational_is_flat(part)
           : part->kind == &zs_variational_pair;
}

unsigned zs_variational_dimension(const zs_node *node)
{
  bool flat = node->child_count > 0;
  for (size_t i = 0; flat && i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    flat = part->kind == &zs_variational_shape ? zs_variational_dimension(part) == 2
                                               : is_flat(part);
  }
  return flat ? 2 : 3;
}

static bool add_part(zs_rbf_samples *list, const zs_node *part, bool *empty, zs_diag *diag)
{
  return part->kind == &zs_variational_mesh      ? zs_variational_add_mesh(list, part, diag)
         : part->kind == &zs_variational_points  ? add_points(list, part, diag)
         : part->kind == &zs_variational_contour ? zs_variational_add_contour(list, part, diag)
         : part->kind == &zs_variational_image
           ? zs_variational_add_image(list, part, empty, diag)
           : add_point(list, part, diag);
}

/* Pictures without a white pixel: what they say depends on the other parts. */
static bool add_empty_pictures(const zs_node *node, const bool *empty, unsigned dimension,
                               zs_rbf_samples *list, zs_diag *diag)
{
  const bool nothing = list->count == 0;
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    const zs_place place = zs_node_place(part, "src");
    if (empty[i] && (nothing || dimension == 2))
      return zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, &place, NULL,
                       "the picture is black: no pixel is as bright as its level, so there is no "
                       "outline");
    if (empty[i] && !zs_variational_add_empty(list, part, diag))
      return false;
  }
  return true;
}

/* Whether normals or values say where the inside is. */
static bool says_inside(const zs_rbf_samples *list)
{
  for (size_t i = 0; i < list->count; i++)
    if (has_normal(&list->samples[i]) || list->samples[i].value != list->samples[0].value)
      return true;
  return false;
}

/* The samples of <points normals="auto">, when nothing else helps.  `ends` tells
 * how many samples there are up to each part. */
static void mark_unknown(const zs_node *node, const size_t *ends, zs_rbf_samples *list)
{
  if (says_inside(list))
    return;
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    if (part->kind == &zs_variational_points &&
        ((const struct points_part *)part->parameters)->normals == NORMALS_AUTO)
      for (size_t j = i ? ends[i - 1] : 0; j < ends[i]; j++)
        list->samples[j].estimate = true;
  }
}

static void flatten(zs_rbf_samples *list)
{
  for (size_t i = 0; i < list->count; i++)
    list->samples[i].position[2] = list->samples[i].normal[2] = 0;
}

bool zs_variational_gather(const zs_node *node, unsigned dimension, zs_rbf_samples *list,
                           zs_diag *diag)
{
  const size_t count = node->child_count;
  size_t *ends = calloc(count + 1, sizeof *ends);
  bool *empty = calloc(count + 1, sizeof *empty);
  bool done = ends && empty;
  if (!done)
    zs_fail_memory(diag);
  for (size_t i = 0; done && i < count; i++) {
    done = add_part(list, node->children[i], &empty[i], diag);
    ends[i] = list->count;
  }
  if (done) {
    mark_unknown(node, ends, list);
    done = add_empty_pictures(node, empty, dimension, list, diag);
  }
  if (dimension == 2)
    flatten(list);
  free(ends);
  free(empty);
  return done;
}
