/* Surfaces through points: the fit is made in src/rbf. */
#include "nodes/common.h"

#include "field/program.h"
#include "files/points.h"
#include "mesh/mesh.h"
#include "rbf/constraints.h"
#include "rbf/sum.h"
#include "scene/tree.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

struct variational {
  int kernel; /* 0 is "auto", then zs_rbf_kernel + 1 */
  int sides;
  double normal_offset, smoothing;
};

struct file_part {
  const char *src;
};

struct point_part {
  double at[3], normal[3], value;
};

static const char *const kernels[] = {"auto", "r", "r3", "r5", "tps2", "tps4", NULL};
static const char *const sides[] = {"both", "in", NULL};
static const char *const words[] = {"auto", NULL};
enum { SIDES_BOTH = 0 };

/* The box around the constraints grows by this part of its longest side. */
static const double MARGIN = 0.05;

/* ---- Parts -------------------------------------------------------------------- */

static const zs_attribute mesh_attributes[] = {
  {.name = "src", .type = ZS_FILE, .offset = offsetof(struct file_part, src), .unit = "",
   .doc = "an STL, PLY, OBJ, OFF or OM file; vertex normals are taken from it, or made from its "
          "triangles, which should be counter-clockwise seen from outside"},
};

static const zs_kind mesh_part = {
  .name = "mesh",
  .family = ZS_FAMILY_PART,
  .summary = "the vertices of a mesh, with their normals",
  .attributes = mesh_attributes,
  .attribute_count = ZS_COUNT_OF(mesh_attributes),
  .parameters_size = sizeof(struct file_part),
  .children = ZS_CHILDREN_NONE,
};

static const zs_attribute points_attributes[] = {
  {.name = "src", .type = ZS_FILE, .offset = offsetof(struct file_part, src), .unit = "",
   .doc = "a text file of one point a line, or a PLY file"},
};

static const zs_kind points_part = {
  .name = "points",
  .family = ZS_FAMILY_PART,
  .summary = "the points of a file, with their normals and values if it has them",
  .doc = "A line of text holds 3 numbers (x y z), 4 (and a value), 6 (and a normal) or 7 (a normal "
         "and a value), separated by spaces, tabs, commas or semicolons; a header line of the "
         "names x y z nx ny nz value may give another order, and columns with other names are "
         "ignored. '#' starts a comment. A PLY file has vertex properties of those names. Points "
         "without a value lie on the surface; a normal of 0 0 0 is unknown.",
  .attributes = points_attributes,
  .attribute_count = ZS_COUNT_OF(points_attributes),
  .parameters_size = sizeof(struct file_part),
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

static const zs_kind point_part = {
  .name = "point",
  .family = ZS_FAMILY_PART,
  .summary = "one point, with a normal or a value",
  .attributes = point_attributes,
  .attribute_count = ZS_COUNT_OF(point_attributes),
  .parameters_size = sizeof(struct point_part),
  .children = ZS_CHILDREN_NONE,
  .check = check_point,
};

/* ---- Samples ------------------------------------------------------------------- */

/* Add to each vertex twice the area vector of its triangles. */
static void add_area_normals(const zs_mesh *mesh, zs_rbf_sample *samples)
{
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t *corner = mesh->triangles + 3 * t;
    const double *a = samples[corner[0]].position, *b = samples[corner[1]].position,
                 *c = samples[corner[2]].position;
    double u[3], v[3];
    for (int k = 0; k < 3; k++) {
      u[k] = b[k] - a[k];
      v[k] = c[k] - a[k];
    }
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 3; k++)
        samples[corner[j]].normal[k] +=
          u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
  }
}

/* Six times the volume that a mesh encloses, negative when its triangles are
 * clockwise seen from outside; about a vertex, so that meshes that are almost
 * closed count too. */
static double signed_volume(const zs_mesh *mesh, const zs_rbf_sample *samples)
{
  double volume = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    double v[3][3];
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < 3; k++)
        v[i][k] = samples[mesh->triangles[3 * t + (size_t)i]].position[k] - samples[0].position[k];
    for (int k = 0; k < 3; k++)
      volume += v[0][k] * (v[1][(k + 1) % 3] * v[2][(k + 2) % 3] -
                           v[1][(k + 2) % 3] * v[2][(k + 1) % 3]);
  }
  return volume;
}

/* Warn of a mesh that is inside out by a good part of its box. */
static void check_orientation(const zs_node *part, const zs_mesh *mesh,
                              const zs_rbf_sample *samples, zs_diag *diag)
{
  double box = 1;
  for (int k = 0; k < 3; k++) {
    double lo = INFINITY, hi = -INFINITY;
    for (size_t i = 0; i < mesh->vertex_count; i++) {
      lo = fmin(lo, samples[i].position[k]);
      hi = fmax(hi, samples[i].position[k]);
    }
    box *= hi - lo;
  }
  if (signed_volume(mesh, samples) / 6 >= -0.05 * box)
    return;
  const zs_place place = zs_node_place(part, "src");
  zs_report(diag, ZS_WARNING, ZS_ERROR_GEOMETRY, &place, NULL,
            "the mesh is inside out: its triangles are clockwise seen from outside, so the solid "
            "is what lies around it");
}

static bool add_mesh(zs_rbf_samples *list, const zs_node *part, zs_diag *diag)
{
  const char *path = ((const struct file_part *)part->parameters)->src;
  zs_mesh *mesh = zs_mesh_read(path, diag);
  bool done = mesh != NULL;
  const size_t first = list->count;
  for (size_t i = 0; done && i < mesh->vertex_count; i++) {
    zs_rbf_sample sample = {.value = 0};
    for (int k = 0; k < 3; k++) {
      sample.position[k] = (double)mesh->positions[3 * i + k];
      if (mesh->normals)
        sample.normal[k] = (double)mesh->normals[3 * i + k];
    }
    done = zs_rbf_samples_add(list, &sample, diag);
  }
  if (done && !mesh->normals) {
    add_area_normals(mesh, list->samples + first);
    check_orientation(part, mesh, list->samples + first, diag);
  }
  bool directed = list->count == first;
  for (size_t i = first; done && !directed && i < list->count; i++)
    for (int k = 0; k < 3; k++)
      directed = directed || list->samples[i].normal[k] != 0;
  if (done && !directed)
    done = zs_fail(diag, ZS_ERROR_GEOMETRY, path,
                   "the mesh has no normals, and no triangle with an area to make them from");
  zs_mesh_free(mesh);
  return done;
}

static bool add_points(zs_rbf_samples *list, const char *path, zs_diag *diag)
{
  zs_points points;
  bool done = zs_points_read(&points, path, diag);
  for (size_t i = 0; done && i < points.count; i++) {
    zs_rbf_sample sample = {.value = points.values ? points.values[i] : 0};
    memcpy(sample.position, points.positions + 3 * i, sizeof sample.position);
    if (points.normals)
      memcpy(sample.normal, points.normals + 3 * i, sizeof sample.normal);
    done = zs_rbf_samples_add(list, &sample, diag);
  }
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

static bool gather(const zs_node *node, zs_rbf_samples *list, zs_diag *diag)
{
  bool done = true;
  for (size_t i = 0; done && i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    const struct file_part *file = part->parameters;
    if (part->kind == &mesh_part)
      done = add_mesh(list, part, diag);
    else if (part->kind == &points_part)
      done = add_points(list, file->src, diag);
    else
      done = add_point(list, part, diag);
  }
  return done;
}

/* ---- The kind ------------------------------------------------------------------- */

static const zs_attribute attributes[] = {
  ZS_SELECT(struct variational, kernel, "kernel", "auto", kernels,
            "the radial function: r, r3 (r^3), r5 (r^5), tps2 (r^2 log r) or tps4 (r^4 log r); "
            "auto is r3"),
  {.name = "normal-offset", .type = ZS_NUMBER,
   .offset = offsetof(struct variational, normal_offset), .initial = "auto", .unit = "length",
   .range = ZS_RANGE_POSITIVE, .choices = words,
   .doc = "how far from a point with a normal the constraints lie that say which side is inside; "
          "auto is a hundredth of the diagonal of the points' box, or less where the surface bends "
          "or comes near itself"},
  ZS_SELECT(struct variational, sides, "sides", "both", sides,
            "whether normals make constraints on both sides of the surface or inside only"),
  ZS_PLAIN(struct variational, smoothing, "smoothing", "0", ZS_RANGE_NOT_NEGATIVE,
           "0 passes through every point; more lets the surface miss them to be smoother "
           "(1e-6 is a light touch)"),
};

static const zs_kind *const parts[] = {&mesh_part, &points_part, &point_part, NULL};

static zs_rbf_kernel kernel_of(const struct variational *p)
{
  return p->kernel ? (zs_rbf_kernel)(p->kernel - 1) : zs_rbf_default_kernel(3);
}

/* A fit as scenes remember it and fields share it. */
typedef struct fitted {
  atomic_uint references;
  zs_rbf_sum *sum;
  double centre[3], size; /* of the unit box that the sum is in */
  zs_fit_info info;
} fitted;

static void *fitted_ref(void *data)
{
  fitted *f = data;
  atomic_fetch_add_explicit(&f->references, 1, memory_order_relaxed);
  return f;
}

static void fitted_unref(void *data)
{
  fitted *f = data;
  if (atomic_fetch_sub_explicit(&f->references, 1, memory_order_acq_rel) > 1)
    return;
  zs_rbf_sum_free(f->sum);
  free(f);
}

static const zs_cache_type fitted_type = {fitted_ref, fitted_unref};

static fitted *fitted_new(const zs_node *node, const zs_rbf *rbf, const zs_control *control,
                          zs_diag *diag)
{
  fitted *f = calloc(1, sizeof *f);
  zs_rbf_sum *sum = zs_rbf_sum_new(rbf, NULL, zs_control_threads(control));
  if (!f || !sum) {
    free(f);
    zs_rbf_sum_free(sum);
    zs_fail_memory(diag);
    return NULL;
  }
  atomic_init(&f->references, 1);
  f->sum = sum;
  memcpy(f->centre, rbf->centre, sizeof f->centre);
  f->size = rbf->size;
  f->info = (zs_fit_info){.element = node->kind->name,
                          .kernel = zs_rbf_kernel_names[rbf->kernel],
                          .method = rbf->method,
                          .dimension = rbf->dimension,
                          .constraints = rbf->count,
                          .seconds = rbf->seconds,
                          .residual = rbf->residual,
                          .bytes = rbf->bytes};
  return f;
}

static fitted *fit(const zs_node *node, const zs_rbf_samples *samples, const zs_control *control,
                   zs_diag *diag)
{
  const struct variational *p = node->parameters;
  zs_rbf_constraints constraints;
  if (!zs_rbf_constraints_build(&constraints, samples, p->normal_offset, p->sides == SIDES_BOTH,
                                control, &node->place, diag))
    return NULL;
  const zs_rbf_problem problem = {.dimension = 3,
                                  .kernel = kernel_of(p),
                                  .smoothing = p->smoothing,
                                  .count = constraints.count,
                                  .positions = constraints.positions,
                                  .values = constraints.values};
  zs_rbf *rbf = zs_rbf_fit(&problem, control, &node->place, diag);
  fitted *f = rbf ? fitted_new(node, rbf, control, diag) : NULL;
  zs_rbf_free(rbf);
  zs_rbf_constraints_clear(&constraints);
  return f;
}

/* Mix some numbers into a key: two chains of multiplications by odd constants
 * (of the golden ratio and of splitmix64), each word spread over all bits. */
static void mix(uint64_t key[2], const double *numbers, size_t count)
{
  static const uint64_t factor[2] = {UINT64_C(0x9e3779b97f4a7c15), UINT64_C(0xbf58476d1ce4e5b9)};
  for (size_t i = 0; i < count; i++) {
    uint64_t bits;
    memcpy(&bits, &numbers[i], sizeof bits);
    for (int k = 0; k < 2; k++) {
      key[k] = (key[k] ^ bits) * factor[k];
      key[k] ^= key[k] >> 29;
    }
  }
}

/* A key of everything that a fit depends on. */
static void key_of(const struct variational *p, const zs_rbf_samples *samples, uint64_t key[2])
{
  const double settings[] = {kernel_of(p), p->smoothing, p->sides,
                             isnan(p->normal_offset) ? -1 : p->normal_offset};
  key[0] = samples->count;
  key[1] = ~key[0];
  mix(key, settings, ZS_COUNT_OF(settings));
  for (size_t i = 0; i < samples->count; i++) {
    const zs_rbf_sample *sample = &samples->samples[i];
    mix(key, sample->position, 3);
    mix(key, sample->normal, 3);
    mix(key, &sample->value, 1);
  }
}

/* The fit of a node, made now or remembered, with a reference for the caller. */
static fitted *fit_or_find(const zs_node *node, zs_cache *cache, const zs_control *control,
                           zs_diag *diag)
{
  zs_rbf_samples samples = {0};
  fitted *f = NULL;
  if (gather(node, &samples, diag)) {
    uint64_t key[2];
    key_of(node->parameters, &samples, key);
    f = zs_cache_find(cache, key, &fitted_type);
    if (!f) {
      f = fit(node, &samples, control, diag);
      /* What cannot be remembered is only made again. */
      if (f && cache)
        zs_cache_add(cache, key, &fitted_type, f);
    }
  }
  zs_rbf_samples_clear(&samples);
  return f;
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  fitted *f = fit_or_find(node, zs_compiler_cache(compiler), zs_compiler_control(compiler),
                          zs_compiler_diag(compiler));
  if (!f)
    return zs_emit_constant(compiler, 0);
  const zs_rbf_sum *sum = f->sum;
  const double *c = f->centre, s = 1 / f->size;
  const double to_unit_box[12] = {s, 0, 0, -c[0] * s, 0, s, 0, -c[1] * s, 0, 0, s, -c[2] * s};
  zs_fit_info info = f->info;
  info.line = node->place.line;
  if (!zs_compiler_keep(compiler, f, fitted_unref)) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return zs_emit_constant(compiler, 0);
  }
  zs_compiler_add_fit(compiler, &info);
  zs_coordinates unit = zs_coordinates_affine(at, to_unit_box);
  zs_value u[3];
  for (int k = 0; k < 3; k++)
    u[k] = zs_emit_coordinate(compiler, &unit, k);
  return zs_emit_operation(compiler, zs_rbf_sum_operation(sum->kernel), sum, u[0], u[1], u[2]);
}

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)children, (void)count;
  const struct variational *p = node->parameters;
  zs_rbf_samples samples = {0};
  zs_box result = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
  if (!gather(node, &samples, NULL))
    samples.count = 0;
  double longest = 0;
  for (int k = 0; k < 3; k++) {
    for (size_t i = 0; i < samples.count; i++) {
      result.lo[k] = fmin(result.lo[k], samples.samples[i].position[k]);
      result.hi[k] = fmax(result.hi[k], samples.samples[i].position[k]);
    }
    longest = fmax(longest, result.hi[k] - result.lo[k]);
  }
  double margin = MARGIN * longest + (p->normal_offset > 0 ? p->normal_offset : 0);
  for (int k = 0; k < 3; k++) {
    result.lo[k] -= margin;
    result.hi[k] += margin;
  }
  zs_rbf_samples_clear(&samples);
  return result;
}

const zs_kind zs_kind_variational = {
  .name = "variational",
  .family = ZS_FAMILY_INTERPOLATION,
  .summary = "the smoothest surface through points",
  .doc = "A sum of radial functions about the points and a polynomial, with the weights that give "
         "f its value at every point and bend it least. Points of the parts lie on the surface "
         "unless they have a value; those with normals also get constraints beside the surface. "
         "Either normals or values inside are needed. f is about the distance near the surface; "
         "far from the points it is not, and may be positive again.",
  .source = "Turk, O'Brien, \"Shape transformation using variational implicit functions\" (1999)",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct variational),
  .children = ZS_CHILDREN_NONE,
  .parts = parts,
  .emit = emit,
  .box = box,
};
