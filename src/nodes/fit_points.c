/* A solid made to pass through points. */
#include "nodes/common.h"
#include "nodes/probe.h"
#include "nodes/radial.h"

#include "base/array.h"
#include "files/points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Parts ------------------------------------------------------------------------ */

struct point {
  double at[3], value;
};

static const zs_attribute point_attributes[] = {
  ZS_POINT(struct point, at, "at", NULL, "where it is"),
  ZS_LENGTH(struct point, value, "value", "0", ZS_RANGE_ANY,
            "f there: 0 on the surface, above 0 so far inside, below 0 outside"),
};

static const zs_kind point = {
  .name = "point",
  .family = ZS_FAMILY_PART,
  .summary = "a point where f has a known value",
  .attributes = point_attributes,
  .attribute_count = ZS_COUNT_OF(point_attributes),
  .parameters_size = sizeof(struct point),
  .children = ZS_CHILDREN_NONE,
};

struct points {
  const char *src;
};

static const zs_attribute points_attributes[] = {
  {.name = "src",
   .type = ZS_FILE,
   .offset = offsetof(struct points, src),
   .unit = "",
   .doc = "a text file of one point a line, or a PLY file; values count, normals do not"},
};

static const zs_kind points = {
  .name = "points",
  .family = ZS_FAMILY_PART,
  .summary = "points from a file",
  .attributes = points_attributes,
  .attribute_count = ZS_COUNT_OF(points_attributes),
  .parameters_size = sizeof(struct points),
  .children = ZS_CHILDREN_NONE,
};
static const zs_kind *const parts[] = {&point, &points, NULL};

/* ---- fit-points --------------------------------------------------------------------- */

static const char *const words[] = {"auto", NULL};

struct fit_points {
  int kernel;
  double sigma, smoothing;
};

static const zs_attribute attributes[] = {
  ZS_SELECT(struct fit_points, kernel, "kernel", "r3", zs_rbf_kernel_names,
            "the radial function of the correction: r, r3 (r^3), r5 (r^5), tps2 (r^2 log r), tps4 "
            "(r^4 log r), which reach everywhere, or gaussian (exp(-r^2 / sigma^2)), which fades"),
  {.name = "sigma",
   .type = ZS_NUMBER,
   .offset = offsetof(struct fit_points, sigma),
   .initial = "auto",
   .unit = "length",
   .range = ZS_RANGE_POSITIVE,
   .choices = words,
   .doc = "width of the gaussian kernel; auto is as wide as is good"},
  ZS_PLAIN(struct fit_points, smoothing, "smoothing", "0", ZS_RANGE_NOT_NEGATIVE,
           "0 passes through every point; more lets the surface miss them to be smoother "
           "(1e-6 is a light touch)"),
};

/* Points and the values wanted there. */
typedef struct wishes {
  double *positions, *values;
  size_t count, capacity;
} wishes;

static void clear(wishes *w)
{
  free(w->positions);
  free(w->values);
}

/* At least one point; false after reporting that memory is out.  `values` NULL: all 0. */
static bool add(wishes *w, const double *positions, const double *values, size_t count,
                zs_diag *diag)
{
  size_t capacity = w->capacity;
  double *p = zs_array_grown(w->positions, w->count + count, &capacity, 3 * sizeof *p);
  w->positions = p ? p : w->positions;
  double *v = zs_array_grown(w->values, w->count + count, &w->capacity, sizeof *v);
  w->values = v ? v : w->values;
  if (!p || !v)
    return zs_fail_memory(diag);
  memcpy(w->positions + 3 * w->count, positions, 3 * count * sizeof *positions);
  for (size_t i = 0; i < count; i++)
    w->values[w->count + i] = values ? values[i] : 0;
  w->count += count;
  return true;
}

static bool gather(const zs_node *node, wishes *w, zs_diag *diag)
{
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    if (part->kind == &point) {
      const struct point *p = part->parameters;
      if (!add(w, p->at, &p->value, 1, diag))
        return false;
    } else if (part->kind == &points) {
      zs_points file;
      bool done = zs_points_read(&file, ((const struct points *)part->parameters)->src, diag);
      done = done && add(w, file.positions, file.values, file.count, diag);
      zs_points_clear(&file);
      if (!done)
        return false;
    }
  }
  return true;
}

/* What the child lacks at the points, in place of the values; those where it is not
 * finite are left out: nothing and everything stay what they are.  False after reporting. */
static bool subtract_child(zs_compiler *compiler, const zs_node *node, wishes *w)
{
  zs_diag *diag = zs_compiler_diag(compiler);
  double *f = malloc((w->count + 1) * sizeof *f);
  bool done = f != NULL;
  if (!done)
    zs_fail_memory(diag);
  done = done && zs_probe_children(compiler, node, w->positions, w->count, f);
  size_t kept = 0;
  for (size_t i = 0; done && i < w->count; i++) {
    const double *p = w->positions + 3 * i;
    if (isnan(f[i]))
      zs_report(diag, ZS_WARNING, ZS_ERROR_GEOMETRY, &node->place, NULL,
                "the child's f is not a number at %g %g %g: the point has no effect", p[0], p[1],
                p[2]);
    if (!isfinite(f[i]))
      continue;
    memmove(w->positions + 3 * kept, p, 3 * sizeof *p);
    w->values[kept++] = w->values[i] - f[i];
  }
  w->count = kept;
  free(f);
  return done;
}

static bool check(const zs_node *node, zs_diag *diag)
{
  for (size_t i = 0; i < node->child_count; i++)
    if (zs_node_is_part(node->children[i]))
      return true;
  return zs_node_misuse(node, diag, NULL, "there are no points; expected <point at=\"...\"/> or "
                        "<points src=\"...\"/>");
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct fit_points *p = node->parameters;
  const zs_value f = zs_children_emit(compiler, node, at);
  zs_value correction = zs_emit_constant(compiler, 0);
  wishes w = {0};
  if (gather(node, &w, zs_compiler_diag(compiler)) && subtract_child(compiler, node, &w) &&
      w.count > 0) {
    const zs_rbf_problem problem = {.dimension = 3,
                                    .kernel = (zs_rbf_kernel)p->kernel,
                                    .sigma = isnan(p->sigma) ? 0 : p->sigma,
                                    .smoothing = p->smoothing,
                                    .count = w.count,
                                    .positions = w.positions,
                                    .values = w.values};
    correction = zs_radial_emit(compiler, node, &problem, at);
  }
  clear(&w);
  return zs_emit(compiler, ZS_FUNCTION_ADD, f, correction, 0);
}

const zs_kind zs_kind_fit_points = {
  .name = "fit-points",
  .family = ZS_FAMILY_FUNCTION_MAP,
  .summary = "the child with its surface bent to pass through points",
  .doc = "To f is added U, the smoothest function with U = value - f at every point: a template "
         "that is fitted to measured points keeps its details elsewhere. Give points all over the "
         "surface, also where it is right already, or `gaussian` for corrections that stay near "
         "them.",
  .source = "V. Savchenko, A. Pasko, O. Okunev, T. Kunii, Function representation of solids "
            "reconstructed from scattered surface points and contours, 1995",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct fit_points),
  .children = ZS_CHILDREN_ONE,
  .parts = parts,
  .check = check,
  .emit = emit,
};
