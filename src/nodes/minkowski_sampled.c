/* Weighted Minkowski sums of any nodes, on a lattice. */
#include "nodes/minkowski_morph.h"

#include "field/program.h"
#include "nodes/common.h"
#include "nodes/extent.h"
#include "nodes/sampled.h"
#include "samples/minkowski.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  MARGIN = 3,        /* cells around the sum */
  IN_SPACE = 48,     /* the resolutions where none is given */
  IN_THE_PLANE = 400,
  STEPS = 4          /* of Newton's towards the surface */
};

/* Instead of infinite numbers: its square is finite. */
static const float HUGE_NUMBER = 1e15f;

/* Cells from the surface within which slopes are trusted. */
static const float NEAR = 3;

/* One of the two solids. */
typedef struct side {
  const zs_node *node;
  double scale;
  bool flat; /* does not depend on z */
  zs_field *field;
  zs_box box; /* of the scaled solid; of a flat one z is 0 */
  zs_lattice_samples samples;
  zs_lattice_points points; /* on the surface, and one inside every part */
} side;

typedef struct sampler {
  zs_compiler *compiler; /* that the sum is for */
  const zs_node *node;
  side sides[2];
  double h;
  zs_lattice_samples sum;
} sampler;

static bool fail(const sampler *s, const char *message)
{
  return zs_node_fail(s->node, zs_compiler_diag(s->compiler), NULL, "%s", message);
}

/* ---- Where they are --------------------------------------------------------------------- */

/* Compile a node alone; `cut`: from z = -1 to 1, so that what does not depend on z has a box.  NULL
 * after reporting. */
static zs_field *compile_alone(const sampler *s, const zs_node *node, bool cut)
{
  zs_compiler *own = zs_compiler_new(zs_compiler_control(s->compiler),
                                     zs_compiler_cache(s->compiler), zs_compiler_diag(s->compiler));
  if (!own)
    return NULL;
  const zs_coordinates root = zs_coordinates_root();
  zs_value f = zs_node_emit(own, node, &root);
  if (cut)
    f = zs_emit_cut(own, f, &root, -1, 1);
  return zs_compiler_finish(own, f, 1);
}

/* Whether f is the same number above each other wherever one looks, near and far.  For solids that
 * have no end along z, as far as is known. */
static bool is_flat(zs_field *field, zs_diag *diag)
{
  zs_eval *eval = zs_eval_new(field, diag);
  bool flat = eval != NULL;
  double size = 1e-3;
  for (int i = 0; flat && i < 40; i++, size *= 1.7) {
    const double low[3] = {size * sin(i), size * cos(3 * i), 0.3 * size};
    const double high[3] = {low[0], low[1], -0.8 * size};
    const double f = zs_eval_point(eval, low), g = zs_eval_point(eval, high);
    flat = f == g || (isnan(f) && isnan(g));
  }
  zs_eval_free(eval);
  return flat;
}

static bool find_side(const sampler *s, side *one)
{
  zs_diag quiet = {0};
  one->field = compile_alone(s, one->node, false);
  if (!one->field)
    return false;
  one->box = zs_node_extent(one->node, zs_compiler_control(s->compiler),
                            zs_compiler_cache(s->compiler));
  one->flat = !zs_box_is_finite(&one->box) && is_flat(one->field, zs_compiler_diag(s->compiler));
  if (one->flat) {
    zs_field *piece = compile_alone(s, one->node, true);
    if (!piece)
      return false;
    if (zs_field_box(piece, one->box.lo, one->box.hi, &quiet))
      one->box.lo[2] = one->box.hi[2] = 0;
    zs_field_unref(piece);
  }
  if (!zs_box_is_finite(&one->box))
    return zs_node_fail(one->node, zs_compiler_diag(s->compiler), NULL,
                        "no box is found around it; <minkowski-morph> needs solids with an end");
  for (int k = 0; k < 3; k++) {
    one->box.lo[k] *= one->scale;
    one->box.hi[k] *= one->scale;
  }
  return true;
}

/* ---- The lattice -------------------------------------------------------------------------- */

static bool allocate(const sampler *s, zs_lattice_samples *samples)
{
  double count = 1;
  for (int k = 0; k < 3; k++)
    count *= samples->count[k];
  const double bytes = 3 * count * sizeof(float);
  if (count > INT32_MAX || !zs_control_allows(zs_compiler_control(s->compiler), bytes))
    return zs_report(zs_compiler_diag(s->compiler), ZS_ERROR, ZS_ERROR_MEMORY, &s->node->place,
                     "a smaller resolution", "%u x %u x %u samples take %.0f MB, more than is allowed",
                     samples->count[0], samples->count[1], samples->count[2], bytes / 1e6);
  samples->f = malloc((size_t)count * sizeof *samples->f);
  return samples->f || zs_fail_memory(zs_compiler_diag(s->compiler));
}

/* Cells; the points of the sum, and for either solid all that are differences of these and points
 * of the other one. */
static bool make_lattices(sampler *s)
{
  const struct minkowski_morph *p = s->node->parameters;
  const bool flat = s->sides[0].flat;
  const double cells = p->resolution ? p->resolution : flat ? IN_THE_PLANE : IN_SPACE;
  const zs_box *boxes[2] = {&s->sides[0].box, &s->sides[1].box};
  double longest = 0, away = 0;
  for (int k = 0; k < 3; k++) {
    longest = fmax(longest, boxes[0]->hi[k] - boxes[0]->lo[k] + boxes[1]->hi[k] - boxes[1]->lo[k]);
    for (int i = 0; i < 2; i++)
      away = fmax(away, fmax(fabs(boxes[i]->lo[k]), fabs(boxes[i]->hi[k])));
  }
  s->h = longest / cells;
  if (!(s->h > 0) || !(away / s->h < 1e8))
    return fail(s, "the solids are too small, or too far from the origin, to be sampled");
  for (int k = 0; k < 3; k++) {
    const int32_t room = k == 2 && flat ? 0 : MARGIN;
    int32_t lo[2], hi[2];
    for (int i = 0; i < 2; i++) {
      lo[i] = (int32_t)floor(boxes[i]->lo[k] / s->h) - room;
      hi[i] = (int32_t)ceil(boxes[i]->hi[k] / s->h) + room;
    }
    s->sum.lo[k] = lo[0] + lo[1];
    s->sum.count[k] = (uint32_t)(hi[0] + hi[1] - (lo[0] + lo[1]) + 1);
    for (int i = 0; i < 2; i++) {
      zs_lattice_samples *l = &s->sides[i].samples;
      l->lo[k] = lo[0] + lo[1] - hi[!i];
      l->count[k] = (uint32_t)(hi[0] + hi[1] - lo[!i] + (room > 0) - l->lo[k] + 1);
    }
  }
  if (!allocate(s, &s->sum) || !allocate(s, &s->sides[0].samples) ||
      !allocate(s, &s->sides[1].samples))
    return false;
  const size_t count = (size_t)s->sum.count[0] * s->sum.count[1] * s->sum.count[2];
  for (size_t i = 0; i < count; i++)
    s->sum.f[i] = -INFINITY;
  return true;
}

/* ---- Samples -------------------------------------------------------------------------------- */

static bool sample(const sampler *s, side *one)
{
  zs_lattice_samples *l = &one->samples;
  const uint32_t n = l->count[0];
  float *x = malloc(3 * (size_t)n * sizeof *x);
  if (!x)
    return zs_fail_memory(zs_compiler_diag(s->compiler));
  zs_eval *eval = zs_eval_new(one->field, zs_compiler_diag(s->compiler));
  if (!eval) {
    free(x);
    return false;
  }
  float *y = x + n, *z = y + n;
  const double step = s->h / one->scale;
  for (uint32_t i = 0; i < n; i++) {
    x[i] = (float)(step * i);
    y[i] = z[i] = 0;
  }
  for (uint32_t k = 0; k < l->count[2]; k++)
    for (uint32_t j = 0; j < l->count[1]; j++) {
      const double origin[3] = {step * l->lo[0], step * (l->lo[1] + (double)j),
                                step * (l->lo[2] + (double)k)};
      float *f = l->f + ((size_t)k * l->count[1] + j) * n;
      zs_eval_values(eval, origin, n, x, y, z, f);
      for (uint32_t i = 0; i < n; i++) /* NaN is outside */
        f[i] = (float)one->scale * (f[i] > -HUGE_NUMBER ? fminf(f[i], HUGE_NUMBER) : -HUGE_NUMBER);
    }
  zs_eval_free(eval);
  free(x);
  return true;
}

/* The slope along an axis: that between both neighbours, or across a crease the steeper one of those
 * to either. */
static float slope(const zs_lattice_samples *l, const float *f, size_t i, uint32_t at, int k,
                   size_t stride)
{
  if (l->count[k] < 2)
    return 0;
  const float before = at > 0 ? f[i] - f[i - stride] : f[i + stride] - f[i];
  const float after = at + 1 < l->count[k] ? f[i + stride] - f[i] : before;
  const float middle = fabsf(before + after) / 2, most = fmaxf(fabsf(before), fabsf(after));
  return middle > most / 2 ? middle : most;
}

/* From values to distances, by their slopes.  Far from the surface there may be none, where unions
 * have their plateaus: distances are no larger than values there. */
static bool normalize(const sampler *s, side *one)
{
  zs_lattice_samples *l = &one->samples;
  const size_t row = l->count[0], layer = row * l->count[1];
  float *distances = malloc(layer * l->count[2] * sizeof *distances);
  if (!distances)
    return zs_fail_memory(zs_compiler_diag(s->compiler));
  const float h = (float)s->h, most = h * (float)(l->count[0] + l->count[1] + l->count[2]);
  for (uint32_t k = 0; k < l->count[2]; k++)
    for (uint32_t j = 0; j < l->count[1]; j++)
      for (uint32_t i = 0; i < l->count[0]; i++) {
        const size_t at = k * layer + j * row + i;
        const float x = slope(l, l->f, at, i, 0, 1), y = slope(l, l->f, at, j, 1, row);
        const float z = slope(l, l->f, at, k, 2, layer);
        const float steep = sqrtf(x * x + y * y + z * z) / h;
        const float f = fabsf(l->f[at]), d = f / fmaxf(steep, 1e-6f);
        const float far = fminf(d > NEAR * h ? fmaxf(NEAR * h, fminf(d, f)) : d, most);
        distances[at] = copysignf(far, l->f[at]);
      }
  free(l->f);
  l->f = distances;
  return true;
}

/* ---- Points -------------------------------------------------------------------------------- */

/* Move a lattice point next to the surface onto it.  False where that does not succeed, and it
 * stays. */
static bool settle(const side *one, zs_eval *eval, double h, double start[3])
{
  double at[3] = {start[0], start[1], start[2]};
  for (int step = 0; step < STEPS; step++) {
    double world[3], square = 0;
    float zero = 0, f, g[3];
    for (int k = 0; k < 3; k++)
      world[k] = at[k] * h / one->scale;
    zs_eval_gradients(eval, world, 1, &zero, &zero, &zero, &f, &g[0], &g[1], &g[2]);
    for (int k = 0; k < 3; k++)
      square += (double)g[k] * g[k];
    const double move = f / square * one->scale / h;
    if (!isfinite(move))
      return false;
    for (int k = 0; k < 3; k++)
      at[k] -= move * g[k];
    if (fabs(f) * one->scale <= 1e-5 * h * sqrt(square))
      break;
  }
  for (int k = 0; k < 3; k++)
    if (!(fabs(at[k] - start[k]) <= 2))
      return false;
  memcpy(start, at, sizeof at);
  return true;
}

/* Points outside, within the diagonal of a cell.  Before every part of the surface, and before every
 * corner that stands out at a right angle, there is one that comes to it. */
static bool is_near(const zs_lattice_samples *l, size_t i, double h)
{
  return l->f[i] <= 0 && l->f[i] >= -1.75f * (float)h;
}

static bool find_points(const sampler *s, side *one)
{
  const zs_lattice_samples *l = &one->samples;
  const size_t row = l->count[0], layer = row * l->count[1], all = layer * l->count[2];
  zs_diag *diag = zs_compiler_diag(s->compiler);
  size_t parts = 0, room = 0;
  uint32_t(*inside)[3] = zs_lattice_parts(l, &parts);
  zs_eval *eval = zs_eval_new(one->field, diag);
  for (size_t i = 0; i < all; i++)
    room += is_near(l, i, s->h);
  one->points.at = malloc((room + parts + 1) * sizeof *one->points.at);
  const bool memory = inside && eval && one->points.at;
  for (size_t i = 0; memory && i < all + parts; i++) {
    const bool part = i >= all;
    if (!part && !is_near(l, i, s->h))
      continue;
    const size_t where = part ? inside[i - all][0] + inside[i - all][1] * row +
                                  inside[i - all][2] * layer
                              : i;
    double *at = one->points.at[one->points.count];
    at[0] = l->lo[0] + (double)(where % row);
    at[1] = l->lo[1] + (double)(where / row % l->count[1]);
    at[2] = l->lo[2] + (double)(where / layer);
    one->points.count += part || settle(one, eval, s->h, at) || l->f[where] >= 0;
  }
  free(inside);
  zs_eval_free(eval);
  if (!memory)
    return zs_fail_memory(diag);
  return one->points.count ||
         zs_node_fail(one->node, diag, NULL, "nothing of it is found in cells of %g; expected a "
                      "larger 'resolution' of <minkowski-morph>", s->h);
}

/* ---- f ------------------------------------------------------------------------------------------ */

static zs_sampled *sampled_of(const sampler *s)
{
  const zs_lattice_samples *l = &s->sum;
  double room = 1, matrix[12] = {0};
  for (int k = 0; k < 3; k++)
    room *= zs_voxels_room(l->count[k], true);
  zs_voxels *voxels = room <= INT32_MAX ? zs_voxels_new(l->count, true) : NULL;
  if (!voxels)
    return NULL;
  for (uint32_t k = 0; k < l->count[2]; k++)
    for (uint32_t j = 0; j < l->count[1]; j++)
      memcpy(zs_voxels_row(voxels, j, k), l->f + ((size_t)k * l->count[1] + j) * l->count[0],
             l->count[0] * sizeof *l->f);
  if (!zs_voxels_finish(voxels, zs_control_threads(zs_compiler_control(s->compiler)))) {
    zs_voxels_free(voxels);
    return NULL;
  }
  for (int k = 0; k < 3; k++) {
    matrix[5 * k] = s->h;
    matrix[4 * k + 3] = s->h * l->lo[k];
  }
  if (s->sides[0].flat) /* no end is near along z */
    matrix[10] = s->h * (l->count[0] + l->count[1]);
  return zs_sampled_new(voxels, l->count, matrix);
}

static bool run(sampler *s)
{
  side *a = &s->sides[0], *b = &s->sides[1];
  if (!find_side(s, a) || !find_side(s, b))
    return false;
  if (a->flat != b->flat)
    return fail(s, "one node is a plane shape and the other one is not; expected two of a kind");
  if (!make_lattices(s))
    return false;
  for (int i = 0; i < 2; i++)
    if (!sample(s, &s->sides[i]) || !normalize(s, &s->sides[i]) || !find_points(s, &s->sides[i]))
      return false;
  const zs_control *control = zs_compiler_control(s->compiler);
  zs_diag *diag = zs_compiler_diag(s->compiler);
  return zs_minkowski_raise(&a->samples, &b->points, &s->sum, control, diag) &&
         zs_minkowski_raise(&b->samples, &a->points, &s->sum, control, diag);
}

zs_value zs_minkowski_sampled_emit(zs_compiler *compiler, const zs_node *node,
                                   const zs_node *const ends[2], double t, const zs_coordinates *at)
{
  sampler s = {.compiler = compiler, .node = node};
  zs_value f = zs_emit_constant(compiler, 0);
  s.sides[0] = (side){.node = ends[0], .scale = 1 - t};
  s.sides[1] = (side){.node = ends[1], .scale = t};
  if (run(&s)) {
    zs_sampled *sampled = sampled_of(&s);
    zs_coordinates where = *at;
    if (s.sides[0].flat) {
      where = zs_coordinates_from(zs_emit_coordinate(compiler, at, 0),
                                  zs_emit_coordinate(compiler, at, 1), f);
    }
    if (sampled)
      f = zs_sampled_emit(compiler, sampled, ZS_SAMPLED_EMPTY, &where);
    else
      zs_fail_memory(zs_compiler_diag(compiler));
  }
  for (int i = 0; i < 2; i++) {
    zs_field_unref(s.sides[i].field);
    free(s.sides[i].samples.f);
    free(s.sides[i].points.at);
  }
  free(s.sum.f);
  return f;
}
