/* Values on a small lattice of points, which costs less than the same points
 * one by one: parts of it get shorter programs, or none, and what depends on
 * fewer than three coordinates is computed for fewer points. */
#include "field/field.h"

#include <string.h>

enum { PARTS_X = 2, PARTS_Y = 2, PARTS_Z = ZS_LANES / (PARTS_X * PARTS_Y) };

/* Planes lo <= i < hi of a lattice. */
typedef struct part {
  unsigned lo[3], hi[3];
} part;

static unsigned point_count(const part *p)
{
  return (p->hi[0] - p->lo[0]) * (p->hi[1] - p->lo[1]) * (p->hi[2] - p->lo[2]);
}

static part whole(const zs_lattice *lattice)
{
  return (part){{0, 0, 0}, {lattice->count[0], lattice->count[1], lattice->count[2]}};
}

/* Part l of the sixteen that a lattice is cut into; some may be empty. */
static part part_at(const zs_lattice *lattice, unsigned l)
{
  static const unsigned parts[3] = {PARTS_X, PARTS_Y, PARTS_Z};
  const unsigned at[3] = {l % PARTS_X, l / PARTS_X % PARTS_Y, l / (PARTS_X * PARTS_Y)};
  part p;
  for (int k = 0; k < 3; k++) {
    p.lo[k] = at[k] * lattice->count[k] / parts[k];
    p.hi[k] = (at[k] + 1) * lattice->count[k] / parts[k];
  }
  return p;
}

static size_t row_of(unsigned y, unsigned z)
{
  return (size_t)(z * ZS_LATTICE_SIDE + y) * ZS_LATTICE_SIDE;
}

/* ---- A part by itself --------------------------------------------------------- */

/* Coordinates of a part's points, row by row. */
static void fill_points(const zs_lattice *lattice, const part *p, float *x, float *y, float *z)
{
  const unsigned n = p->hi[0] - p->lo[0];
  for (unsigned k = p->lo[2]; k < p->hi[2]; k++)
    for (unsigned j = p->lo[1]; j < p->hi[1]; j++) {
      const float at_y = lattice->at[1][j], at_z = lattice->at[2][k];
      memcpy(x, lattice->at[0] + p->lo[0], n * sizeof *x);
#pragma omp simd
      for (unsigned i = 0; i < n; i++) {
        y[i] = at_y;
        z[i] = at_z;
      }
      x += n;
      y += n;
      z += n;
    }
}

static void store_points(const part *p, const float *values, float *f)
{
  const unsigned n = p->hi[0] - p->lo[0];
  for (unsigned k = p->lo[2]; k < p->hi[2]; k++)
    for (unsigned j = p->lo[1]; j < p->hi[1]; j++, values += n)
      memcpy(f + row_of(j, k) + p->lo[0], values, n * sizeof *f);
}

static void fill_part(const part *p, float value, float *f)
{
  for (unsigned k = p->lo[2]; k < p->hi[2]; k++)
    for (unsigned j = p->lo[1]; j < p->hi[1]; j++)
      for (unsigned i = p->lo[0]; i < p->hi[0]; i++)
        f[row_of(j, k) + i] = value;
}

/* A part of no more than ZS_BLOCK points. */
static void evaluate_part(zs_eval *eval, const zs_program *program, const zs_lattice *lattice,
                          const part *p, float *f)
{
  float *x = eval->block, *y = x + ZS_BLOCK, *z = y + ZS_BLOCK, *out = z + ZS_BLOCK;
  fill_points(lattice, p, x, y, z);
  zs_program_values(eval, program, &lattice->frame, point_count(p), x, y, z, out);
  store_points(p, out, f);
}

/* ---- Layer by layer ------------------------------------------------------------
 *
 * The points of a layer are one block.  Instructions that do not depend on z
 * have the same values in every layer and are run once; those that depend on
 * nothing but z are run once, for a point per layer. */

enum { ON_Z = 1 << 2 }; /* the bit of coordinate 2 */

/* Which inputs each instruction depends on, and which coordinates, one bit each. */
static void find_dependences(const zs_program *program, uint8_t *used, uint8_t *on)
{
  for (unsigned k = 0; k < ZS_COORDINATES; k++)
    on[k] = (uint8_t)(1u << k);
  for (uint32_t i = ZS_COORDINATES; i < program->count; i++) {
    const zs_instruction *instruction = &program->instructions[i];
    const zs_operation *operation = instruction->operation;
    used[i] = (uint8_t)(operation->used ? operation->used(instruction->data) : ~0u);
    on[i] = 0;
    for (unsigned k = 0; k < operation->arity; k++)
      on[i] |= used[i] >> k & 1 ? on[instruction->in[k]] : 0;
  }
}

/* Where the value of each instruction is while layers are run: its register, or
 * a block that is kept from layer to layer. */
typedef struct layers {
  zs_eval *eval;
  const zs_program *program;
  const zs_lattice *lattice;
  const uint8_t *used, *on; /* see find_dependences */
  float **at;  /* by instruction */
  float (*by_z)[ZS_LATTICE_SIDE]; /* by kept block: the values of what depends on z alone */
  unsigned kept;
} layers;

/* Whether a value outlives a layer. */
static bool is_kept(uint8_t on)
{
  return !(on & ON_Z) || on == ON_Z;
}

/* Give out the places.  False when there is too much to keep. */
static bool place_values(layers *w)
{
  for (uint32_t i = ZS_COORDINATES; i < w->program->count; i++) {
    if (!is_kept(w->on[i])) {
      w->at[i] = w->eval->values[w->program->registers[i]];
      continue;
    }
    if (w->kept == ZS_MAXIMUM_KEPT)
      return false;
    w->at[i] = w->eval->kept + (size_t)w->kept++ * ZS_BLOCK;
  }
  return true;
}

/* Run an instruction and its siblings; returns how many these are.  Inputs that are not used
 * may not have been computed: 0 times what is there need not be 0. */
static uint32_t run_instruction(const layers *w, uint32_t i, unsigned n)
{
  const zs_instruction *instruction = &w->program->instructions[i];
  zs_block_arguments arguments = {.data = instruction->data,
                                  .frame = &w->lattice->frame,
                                  .n = n,
                                  .out = w->at[i],
                                  .siblings = zs_program_siblings(w->program, i)};
  for (unsigned k = 0; k < instruction->operation->arity; k++)
    arguments.in[k] = w->at[w->used[i] >> k & 1 ? instruction->in[k] : 0];
  for (unsigned k = 0; k < arguments.siblings; k++) {
    arguments.sibling[k].data = instruction[k + 1].data;
    arguments.sibling[k].out = w->at[i + k + 1];
  }
  instruction->operation->kernels[w->eval->isa]->value(&arguments);
  return 1 + arguments.siblings;
}

static void fill(float *block, unsigned n, float value)
{
#pragma omp simd
  for (unsigned i = 0; i < n; i++)
    block[i] = value;
}

/* What depends on z alone, a point per layer. */
static void run_by_z(const layers *w)
{
  const zs_lattice *lattice = w->lattice;
  memcpy(w->at[2], lattice->at[2], sizeof lattice->at[2]);
  for (unsigned k = lattice->count[2]; k < ZS_LATTICE_SIDE; k++)
    w->at[2][k] = lattice->at[2][lattice->count[2] - 1];
  for (uint32_t i = ZS_COORDINATES; i < w->program->count;) {
    if (w->on[i] != ON_Z) {
      i++;
      continue;
    }
    for (uint32_t end = i + run_instruction(w, i, ZS_LATTICE_SIDE); i < end; i++)
      memcpy(w->by_z[(w->at[i] - w->eval->kept) / ZS_BLOCK], w->at[i], sizeof *w->by_z);
  }
}

static void run_layer(const layers *w, unsigned k, unsigned n)
{
  fill(w->at[2], n, w->lattice->at[2][k]);
  for (uint32_t i = ZS_COORDINATES; i < w->program->count;) {
    if (w->on[i] == ON_Z)
      fill(w->at[i], n, w->by_z[(w->at[i] - w->eval->kept) / ZS_BLOCK][k]);
    i += w->on[i] != ON_Z && w->on[i] & ON_Z ? run_instruction(w, i, n) : 1;
  }
}

static void run_layers(layers *w, float *f)
{
  const zs_lattice *lattice = w->lattice;
  part layer = whole(lattice);
  layer.hi[2] = 1;
  for (unsigned k = 0; k < ZS_COORDINATES; k++)
    w->at[k] = w->eval->block + (size_t)k * ZS_BLOCK;
  fill_points(lattice, &layer, w->at[0], w->at[1], w->at[2]);
  const unsigned n = zs_pad_points(point_count(&layer), w->at[0], w->at[1], w->at[2]);
  for (uint32_t i = ZS_COORDINATES; i < w->program->count;)
    i += w->on[i] & ON_Z ? 1 : run_instruction(w, i, n);
  run_by_z(w);
  for (unsigned k = 0; k < lattice->count[2]; k++) {
    run_layer(w, k, n);
    layer.lo[2] = k;
    layer.hi[2] = k + 1;
    store_points(&layer, w->at[w->program->count - 1], f);
  }
}

static void evaluate_layers(zs_eval *eval, const zs_program *program, const zs_lattice *lattice,
                            float *f)
{
  const zs_arena_mark mark = zs_arena_mark_here(&eval->arena);
  uint8_t *used = ZS_ARENA_NEW(&eval->arena, uint8_t, program->count);
  uint8_t *on = ZS_ARENA_NEW(&eval->arena, uint8_t, program->count);
  layers w = {.eval = eval, .program = program, .lattice = lattice, .used = used, .on = on};
  w.at = ZS_ARENA_NEW(&eval->arena, float *, program->count);
  w.by_z = zs_arena_alloc(&eval->arena, ZS_MAXIMUM_KEPT, sizeof *w.by_z);
  bool few = false;
  if (used && on && w.at && w.by_z) {
    find_dependences(program, used, on);
    few = place_values(&w);
  }
  if (few) {
    run_layers(&w, f);
  } else {
    part layer = whole(lattice);
    for (unsigned k = 0; k < lattice->count[2]; k++) {
      layer.lo[2] = k;
      layer.hi[2] = k + 1;
      evaluate_part(eval, program, lattice, &layer, f);
    }
  }
  zs_arena_rewind(&eval->arena, mark);
}

/* ---- Part by part ---------------------------------------------------------------- */

/* The boxes of the parts; empty ones repeat the last, which never is. */
static void part_boxes(const zs_lattice *lattice, zs_boxes *boxes)
{
  for (unsigned l = 0; l < ZS_LANES; l++) {
    part p = part_at(lattice, l);
    if (!point_count(&p))
      p = part_at(lattice, ZS_LANES - 1);
    for (int k = 0; k < 3; k++) {
      boxes->axis[k].lo[l] = lattice->at[k][p.lo[k]];
      boxes->axis[k].hi[l] = lattice->at[k][p.hi[k] - 1];
    }
  }
}

/* Evaluate the parts that `wanted` names by programs of their own.  False,
 * having done nothing, when one program for all is quicker. */
static bool evaluate_parts(zs_eval *eval, const zs_program *program, const zs_lattice *lattice,
                           unsigned wanted, zs_request request, float *f)
{
  const zs_arena_mark mark = zs_arena_mark_here(&eval->arena);
  const zs_program *programs[ZS_LANES];
  zs_program_restrict_lanes(eval, program, wanted, request, &eval->arena, programs);
  size_t steps = 0;
  for (unsigned lanes = wanted; lanes; lanes &= lanes - 1)
    steps += zs_program_length(programs[__builtin_ctz(lanes)]);
  const bool quicker = steps < (size_t)zs_program_length(program) * lattice->count[2] / 4 * 3;
  for (unsigned lanes = quicker ? wanted : 0; lanes; lanes &= lanes - 1) {
    const unsigned l = (unsigned)__builtin_ctz(lanes);
    const part p = part_at(lattice, l);
    evaluate_part(eval, programs[l], lattice, &p, f);
  }
  zs_arena_rewind(&eval->arena, mark);
  return quicker;
}

/* Points of a part whose sign bounds know get a bound of that sign.  Returns
 * the parts that are left, one bit each. */
static unsigned decide_parts(const zs_lattice *lattice, const zs_bounds *bounds, bool sign_suffices,
                             float *f, unsigned *points)
{
  unsigned left = 0;
  *points = 0;
  for (unsigned l = 0; l < ZS_LANES; l++) {
    const part p = part_at(lattice, l);
    if (!point_count(&p))
      continue;
    if (sign_suffices && bounds->lo[l] >= 0) {
      fill_part(&p, bounds->lo[l], f);
    } else if (sign_suffices && bounds->hi[l] < 0) {
      fill_part(&p, bounds->hi[l], f);
    } else {
      left |= 1u << l;
      *points += point_count(&p);
    }
  }
  return left;
}

unsigned zs_program_lattice(zs_eval *eval, const zs_program *program, const zs_lattice *lattice,
                            zs_request request, bool prune, float *f)
{
  const part all = whole(lattice);
  const unsigned points = point_count(&all);
  if (points <= ZS_BLOCK) {
    evaluate_part(eval, program, lattice, &all, f);
    return points;
  }
  const bool sign_suffices = request == ZS_REQUEST_SIGN;
  if (!prune || program->regional_count || !(sign_suffices || zs_program_choices(program))) {
    evaluate_layers(eval, program, lattice, f);
    return points;
  }
  zs_boxes boxes;
  zs_bounds bounds;
  unsigned evaluated;
  part_boxes(lattice, &boxes);
  zs_program_bounds(eval, program, &lattice->frame, &boxes, &bounds);
  const unsigned left = decide_parts(lattice, &bounds, sign_suffices, f, &evaluated);
  if (!left || evaluate_parts(eval, program, lattice, left, request, f))
    return evaluated;
  evaluate_layers(eval, program, lattice, f);
  return points;
}
