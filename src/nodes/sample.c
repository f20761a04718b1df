/* The child, sampled on a grid and interpolated: what is costly to evaluate becomes cheap. */
#include "nodes/sampled.h"

#include "field/program.h"
#include "nodes/extent.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  MARGIN = 2, /* cells around a solid whose box is found */
  MOST_CELLS = 4096
};

struct sample {
  double min[3], max[3], cell;
  int resolution, interpolation, outside;
};

static const zs_attribute attributes[] = {
  {.name = "min", .type = ZS_VECTOR3, .offset = offsetof(struct sample, min), .initial = "",
   .unit = "length", .doc = "with `max`: the box that is divided into cells; left out, one that is "
                            "found around the child"},
  {.name = "max", .type = ZS_VECTOR3, .offset = offsetof(struct sample, max), .initial = "",
   .unit = "length", .doc = "the opposite corner"},
  {.name = "resolution", .type = ZS_INTEGER, .offset = offsetof(struct sample, resolution),
   .initial = "64", .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 1, .maximum = MOST_CELLS,
   .doc = "cells along the longest side of the box; samples lie in their middles"},
  {.name = "cell", .type = ZS_NUMBER, .offset = offsetof(struct sample, cell), .initial = "",
   .unit = "length", .range = ZS_RANGE_POSITIVE,
   .doc = "instead of a resolution: the side of a cell"},
  ZS_SAMPLED_ATTRIBUTES(struct sample),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct sample *p = node->parameters;
  const bool has_min = zs_node_has(node, "min"), has_max = zs_node_has(node, "max");
  if (has_min != has_max)
    return zs_node_misuse(node, diag, has_min ? "min" : "max",
                          "'%s' is missing; 'min' and 'max' are given together",
                          has_min ? "max" : "min");
  if (zs_node_has(node, "cell") && zs_node_has(node, "resolution"))
    return zs_node_misuse(node, diag, "cell", "'cell' cannot be combined with 'resolution'");
  return !has_min || zs_node_check_order(node, diag, "min", p->min, "max", p->max, 3);
}

/* ---- The grid ----------------------------------------------------------------------- */

typedef struct grid {
  double lo[3], cell; /* corner of the first cell */
  uint32_t count[3];
} grid;

/* The box of the children together. */
static bool find_box(zs_compiler *compiler, const zs_node *node, zs_box *box)
{
  bool first = true;
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_box one = zs_node_extent(node->children[i], zs_compiler_control(compiler),
                                      zs_compiler_cache(compiler));
    *box = first ? one : zs_box_of_union(node, (const zs_box[2]){*box, one}, 2);
    first = false;
  }
  return zs_box_is_finite(box) ||
         zs_node_fail(node, zs_compiler_diag(compiler), NULL,
                      "no box is found around the child; expected 'min' and 'max'");
}

static bool make_grid(grid *g, zs_compiler *compiler, const zs_node *node)
{
  const struct sample *p = node->parameters;
  const bool given = !isnan(p->min[0]);
  zs_diag *diag = zs_compiler_diag(compiler);
  zs_box box;
  if (given) {
    memcpy(box.lo, p->min, sizeof box.lo);
    memcpy(box.hi, p->max, sizeof box.hi);
  } else if (!find_box(compiler, node, &box)) {
    return false;
  }
  double longest = 0, room = 1;
  for (int k = 0; k < 3; k++)
    longest = fmax(longest, box.hi[k] - box.lo[k]);
  const double cells = given ? p->resolution : fmax(1, p->resolution - 2 * MARGIN);
  g->cell = isnan(p->cell) ? longest / cells : p->cell;
  if (!given)
    box = zs_box_grown(box, MARGIN * g->cell);
  for (int k = 0; k < 3; k++) {
    const double count = fmax(1, ceil((box.hi[k] - box.lo[k]) / g->cell - 1e-6));
    if (!(count <= MOST_CELLS))
      return zs_node_fail(node, diag, "cell", "%g makes %g cells along a side; expected at most %d",
                          g->cell, count, MOST_CELLS);
    g->count[k] = (uint32_t)count;
    g->lo[k] = box.lo[k];
    room *= zs_voxels_room(g->count[k], true);
  }
  const double bytes = room * sizeof(float);
  if (room > INT32_MAX || !zs_control_allows(zs_compiler_control(compiler), bytes))
    return zs_report(diag, ZS_ERROR, ZS_ERROR_MEMORY, &node->place, NULL,
                     "%u x %u x %u samples take %.0f MB, more than is allowed", g->count[0],
                     g->count[1], g->count[2], bytes / 1e6);
  return true;
}

/* ---- Samples ------------------------------------------------------------------------- */

typedef struct job {
  const grid *grid;
  zs_voxels *voxels;
} job;

static void brick(void *visitor, unsigned thread, const uint32_t index[3], zs_eval *eval,
                  const zs_program *program)
{
  (void)thread;
  const job *j = visitor;
  const grid *g = j->grid;
  zs_lattice lattice;
  uint32_t from[3];
  double origin[3];
  float f[ZS_LATTICE_SIDE * ZS_LATTICE_SIDE * ZS_LATTICE_SIDE];
  for (int k = 0; k < 3; k++) {
    from[k] = index[k] * ZS_LATTICE_SIDE;
    const uint32_t left = g->count[k] - from[k];
    lattice.count[k] = left < ZS_LATTICE_SIDE ? left : ZS_LATTICE_SIDE;
    origin[k] = g->lo[k] + g->cell * from[k];
    for (uint32_t i = 0; i < lattice.count[k]; i++)
      lattice.at[k][i] = ((float)i + 0.5f) * (float)g->cell;
  }
  lattice.frame = zs_frame_at(origin);
  zs_program_lattice(eval, program, &lattice, ZS_REQUEST_VALUE, false, f);
  for (uint32_t z = 0; z < lattice.count[2]; z++)
    for (uint32_t y = 0; y < lattice.count[1]; y++) {
      const float *row = f + (z * ZS_LATTICE_SIDE + y) * ZS_LATTICE_SIDE;
      float *to = zs_voxels_row(j->voxels, from[1] + y, from[2] + z) + from[0];
      for (uint32_t x = 0; x < lattice.count[0]; x++) /* NaN is outside */
        to[x] = row[x] > -1e30f ? row[x] < 1e30f ? row[x] : 1e30f : -1e30f;
    }
}

static bool fill(zs_compiler *compiler, const grid *g, zs_voxels *voxels, zs_field *field)
{
  job j = {.grid = g, .voxels = voxels};
  zs_walk walk = {.field = field,
                  .request = ZS_REQUEST_VALUE,
                  .control = zs_compiler_control(compiler),
                  .stage = "samples",
                  .progress_to = 1,
                  .visitor = &j,
                  .brick = brick};
  for (int k = 0; k < 3; k++) {
    walk.lo[k] = g->lo[k];
    walk.size[k] = g->cell * ZS_LATTICE_SIDE;
    walk.count[k] = (g->count[k] - 1) / ZS_LATTICE_SIDE + 1;
  }
  return zs_walk_run(&walk, zs_compiler_diag(compiler));
}

static zs_sampled *sampled_of(zs_compiler *compiler, const zs_node *node, const grid *g)
{
  const struct sample *p = node->parameters;
  const unsigned threads = zs_control_threads(zs_compiler_control(compiler));
  zs_diag *diag = zs_compiler_diag(compiler);
  zs_field *field = zs_children_field(compiler, node, diag);
  zs_voxels *voxels =
    field ? zs_voxels_new(g->count, p->interpolation == ZS_SAMPLED_CUBIC) : NULL;
  const bool filled = voxels && fill(compiler, g, voxels, field);
  zs_sampled *sampled = NULL;
  if (filled && zs_voxels_finish(voxels, threads)) {
    double matrix[12] = {0};
    for (int k = 0; k < 3; k++) {
      matrix[5 * k] = g->cell;
      matrix[4 * k + 3] = g->lo[k] + g->cell / 2;
    }
    sampled = zs_sampled_new(voxels, g->count, matrix);
  } else {
    zs_voxels_free(voxels);
  }
  if (!sampled && field && (!voxels || filled)) /* else it has been reported */
    zs_fail_memory(diag);
  zs_field_unref(field);
  return sampled;
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  grid g;
  zs_sampled *sampled =
    make_grid(&g, compiler, node) ? sampled_of(compiler, node, &g) : NULL;
  if (!sampled)
    return zs_emit_constant(compiler, 0);
  return zs_sampled_emit(compiler, sampled, ((const struct sample *)node->parameters)->outside, at);
}

/* Where there is a box at all, the samples end there; else the child does. */
static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct sample *p = node->parameters;
  if (p->outside != ZS_SAMPLED_EMPTY || isnan(p->min[0]))
    return zs_box_of_first(node, children, count);
  zs_box result;
  memcpy(result.lo, p->min, sizeof result.lo);
  memcpy(result.hi, p->max, sizeof result.hi);
  return result;
}

const zs_kind zs_kind_sample = {
  .name = "sample",
  .family = ZS_FAMILY_DATA,
  .summary = "the child, sampled on a grid and interpolated",
  .doc = "Makes costly children cheap, and smooths them at the scale of a cell. What is finer than "
         "two cells is lost.",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct sample),
  .children = ZS_CHILDREN_ONE,
  .check = check,
  .emit = emit,
  .box = box,
};
