/* Evaluators: the working data of one thread, and running programs on it. */
#include "field/field.h"
#include "field/scalar.h"

#include "base/diagnostic.h"
#include "base/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { AHEAD = 8 /* instructions from prefetching data to using them */ };

/* A regional program is worth having when it is this part of its parent. */
static const double WORTHWHILE = 0.9;

/* Nothing is read of an evaluator's memory that has not been written: pages of it that a
 * job has no use for are never touched. */
zs_eval *zs_eval_new(zs_field *field, zs_diag *diag)
{
  const zs_program *program = field->program;
  const size_t registers = program->register_count, count = program->count;
  zs_eval *e = calloc(1, sizeof *e);
  if (!e) {
    zs_fail_memory(diag);
    return NULL;
  }
  e->field = zs_field_ref(field);
  e->isa = zs_isa_select();
  e->storage = zs_memory_new(registers, ZS_EVAL_ROWS * ZS_BLOCK * sizeof(float));
  e->values = zs_memory_new(registers, sizeof *e->values);
  e->gradients = zs_memory_new(registers, sizeof *e->gradients);
  e->bounds = zs_memory_new(registers, sizeof *e->bounds);
  e->choices = zs_memory_new(program->choice_count, sizeof *e->choices);
  e->links = zs_memory_new(program->link_count, sizeof *e->links);
  e->zeros = zs_memory_new(count, sizeof *e->zeros);
  e->regional = zs_memory_new(program->regional_count, sizeof *e->regional);
  e->points = zs_memory_new(count, sizeof *e->points);
  e->block = zs_memory_new((3 + 1) * (size_t)ZS_EVAL_ROWS * ZS_BLOCK, sizeof *e->block);
  e->kept = zs_memory_new(ZS_MAXIMUM_KEPT * (size_t)ZS_BLOCK, sizeof *e->kept);
  e->index = zs_memory_new(ZS_SCATTER_CHUNK, sizeof *e->index);
  if (!e->kept || !e->index || !e->storage || !e->values || !e->gradients || !e->bounds ||
      !e->choices || !e->links || !e->zeros || !e->regional || !e->points || !e->block ||
      !zs_shortener_init(&e->shortener, program->count, program->link_count,
                         program->regional_count)) {
    zs_eval_free(e);
    zs_fail_memory(diag);
    return NULL;
  }
  for (size_t r = 0; r < registers; r++) {
    e->values[r] = e->storage + r * ZS_BLOCK;
    e->gradients[r] = e->storage + r * ZS_EVAL_ROWS * ZS_BLOCK;
  }
  memset(e->zeros, 0, ZS_COORDINATES * sizeof *e->zeros);
  e->programs[0] = program;
  return e;
}

void zs_eval_free(zs_eval *eval)
{
  if (!eval)
    return;
  zs_field_unref(eval->field);
  free(eval->storage);
  free(eval->values);
  free(eval->gradients);
  free(eval->bounds);
  free(eval->choices);
  free(eval->links);
  free(eval->zeros);
  free(eval->regional);
  free(eval->points);
  zs_shortener_free(&eval->shortener);
  free(eval->block);
  free(eval->kept);
  free(eval->index);
  zs_arena_free(&eval->arena);
  free(eval);
}

zs_field *zs_eval_field(const zs_eval *eval)
{
  return eval->field;
}

zs_isa_kind zs_eval_isa(const zs_eval *eval)
{
  return eval->isa;
}

zs_frame zs_frame_at(const double origin[3])
{
  zs_frame frame = {.axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .parallel = true};
  if (origin)
    memcpy(frame.origin, origin, sizeof frame.origin);
  return frame;
}

/* ---- Running programs -------------------------------------------------------- */

unsigned zs_pad_points(unsigned n, float *x, float *y, float *z)
{
  unsigned padded = (n + ZS_LANES - 1) / ZS_LANES * ZS_LANES;
  for (unsigned i = n; i < padded; i++) {
    x[i] = x[n - 1];
    y[i] = y[n - 1];
    z[i] = z[n - 1];
  }
  return padded;
}

static void run(zs_eval *eval, const zs_program *program, const zs_frame *frame, unsigned n,
                float *const coordinates[3], float *result, float **rows, bool gradients)
{
  for (int k = 0; k < ZS_COORDINATES; k++)
    rows[k] = coordinates[k];
  zs_block_arguments arguments = {.frame = frame, .n = n};
  const uint32_t last = program->count - 1;
  for (uint32_t i = ZS_COORDINATES; i <= last; i++) {
    const zs_instruction *instruction = &program->instructions[i];
    const zs_operation *operation = instruction->operation;
    arguments.data = instruction->data;
    for (unsigned k = 0; k < operation->arity; k++)
      arguments.in[k] = rows[program->registers[instruction->in[k]]];
    arguments.out = i == last ? result : rows[program->registers[i]];
    arguments.siblings = zs_program_siblings(program, i);
    for (unsigned k = 0; k < arguments.siblings; k++) {
      arguments.sibling[k].data = program->instructions[++i].data;
      arguments.sibling[k].out = i == last ? result : rows[program->registers[i]];
    }
    const zs_kernels *kernels = operation->kernels[eval->isa];
    (gradients ? kernels->gradient : kernels->value)(&arguments);
  }
}

void zs_program_values(zs_eval *eval, const zs_program *program, const zs_frame *frame, unsigned n,
                       float *x, float *y, float *z, float *f)
{
  if (!n)
    return;
  float *const coordinates[3] = {x, y, z};
  n = zs_pad_points(n, x, y, z);
  run(eval, program, frame, n, coordinates, f, eval->values, false);
}

void zs_program_gradients(zs_eval *eval, const zs_program *program, const zs_frame *frame,
                          unsigned n, float *x, float *y, float *z, float *gradient)
{
  if (!n)
    return;
  float *const coordinates[3] = {x, y, z};
  n = zs_pad_points(n, x, y, z);
  run(eval, program, frame, n, coordinates, gradient, eval->gradients, true);
}

double zs_program_point(zs_eval *eval, const zs_program *program, const double point[3])
{
  double *value = eval->points;
  memcpy(value, point, 3 * sizeof *point);
  for (uint32_t i = ZS_COORDINATES; i < program->count; i++) {
    const zs_instruction *instruction = &program->instructions[i];
    double in[ZS_MAXIMUM_INPUTS] = {0, 0, 0};
    for (unsigned k = 0; k < instruction->operation->arity; k++)
      in[k] = value[instruction->in[k]];
    value[i] = instruction->operation->reference(instruction->data, in);
  }
  return value[program->count - 1];
}

/* Remember where the inputs of an instruction with a regional form are. */
static void keep_inputs(zs_eval *eval, const zs_instruction *instruction,
                        const zs_bounds_arguments *arguments)
{
  const zs_operation *operation = instruction->operation;
  for (unsigned k = 0; operation->restricted && k < operation->arity; k++)
    eval->regional[instruction->ordinal][k] = *arguments->in[k];
}

/* A sibling has the inputs of the instruction whose arguments these are. */
static void take_sibling(zs_eval *eval, const zs_program *program, uint32_t index,
                         zs_bounds *result, zs_bounds_arguments *arguments, unsigned number)
{
  const zs_instruction *instruction = &program->instructions[index];
  keep_inputs(eval, instruction, arguments);
  arguments->sibling[number].data = instruction->data;
  arguments->sibling[number].out =
    index == program->count - 1 ? result : &eval->bounds[program->registers[index]];
}

void zs_program_bounds(zs_eval *eval, const zs_program *program, const zs_frame *frame,
                       const zs_boxes *boxes, zs_bounds *result)
{
  zs_bounds_arguments arguments = {.frame = frame};
  const uint32_t last = program->count - 1;
  const zs_lanes_test zero_lanes = zs_zero_lanes(eval->isa);
  memset(eval->choices, 0, program->choice_count * sizeof *eval->choices);
  for (uint32_t i = ZS_COORDINATES; i <= last; i++) {
    const zs_instruction *instruction = &program->instructions[i];
    const zs_operation *operation = instruction->operation;
    arguments.data = instruction->data;
    /* Data of regional programs lie where the whole program put them. */
    __builtin_prefetch(instruction[i + AHEAD <= last ? AHEAD : 0].data);
    for (unsigned k = 0; k < operation->arity; k++) {
      uint32_t in = instruction->in[k];
      arguments.in[k] =
        in < ZS_COORDINATES ? &boxes->axis[in] : &eval->bounds[program->registers[in]];
    }
    keep_inputs(eval, instruction, &arguments);
    arguments.demand = instruction->demand;
    arguments.choice = operation->choice ? &eval->choices[instruction->ordinal] : NULL;
    arguments.links = operation->chain ? &eval->links[instruction->ordinal] : NULL;
    arguments.out = i == last ? result : &eval->bounds[program->registers[i]];
    arguments.siblings = zs_program_siblings(program, i);
    for (unsigned k = 0; k < arguments.siblings; k++)
      take_sibling(eval, program, i + 1 + k, result, &arguments, k);
    operation->kernels[eval->isa]->bounds(&arguments);
    eval->zeros[i] = instruction->signed_zero ? 0 : zero_lanes(arguments.out);
    for (unsigned k = 0; k < arguments.siblings; k++) {
      const bool signed_zero = program->instructions[++i].signed_zero;
      eval->zeros[i] = signed_zero ? 0 : zero_lanes(arguments.sibling[k].out);
    }
  }
}

/* ---- Regional programs -------------------------------------------------------- */

/* Whether a lane's list is so much shorter than the program that a program of
 * its own pays. */
static bool pays(const zs_shortener *shortener, const zs_program *program, unsigned lane)
{
  return shortener->kept[lane] + shortener->link_count[lane] <
         WORTHWHILE * zs_program_length(program);
}

/* Lanes with data of their own have a program of their own. */
static void restrict_lanes(zs_eval *eval, const zs_program *program, unsigned lanes,
                           zs_request request, bool regions, zs_arena *arena,
                           const zs_program *result[ZS_LANES])
{
  zs_shortener *shortener = &eval->shortener;
  const zs_instruction *instructions = program->instructions;
  const bool with_data = regions && program->regional_count;
  const bool can_shorten = zs_program_choices(program) || with_data;
  if (can_shorten)
    zs_shortener_list(shortener, instructions, program->count,
                      &(zs_findings){.choices = eval->choices,
                                     .links = eval->links,
                                     .zeros = eval->field->plain ? NULL : eval->zeros},
                      lanes, request);
  const zs_bounds(*regional)[ZS_MAXIMUM_INPUTS] =
    (const zs_bounds(*)[ZS_MAXIMUM_INPUTS])eval->regional;
  unsigned alike = 0; /* lanes without, whose programs others may share */
  for (unsigned l = 0; l < ZS_LANES; l++) {
    if (!(lanes >> l & 1))
      continue;
    const bool own =
      with_data && zs_shortener_restrict(shortener, instructions, l, regional, arena);
    result[l] = NULL;
    if (!own && !(can_shorten && pays(shortener, program, l))) {
      result[l] = program;
      continue;
    }
    for (unsigned m = 0; m < l && !result[l] && !own; m++)
      if (alike >> m & 1 && zs_shortener_equal(shortener, l, m))
        result[l] = result[m];
    if (!result[l])
      result[l] = zs_shortener_emit(shortener, instructions, l, request, own, arena);
    if (!result[l])
      result[l] = program;
    alike |= own ? 0 : 1u << l;
  }
}

void zs_program_restrict_lanes(zs_eval *eval, const zs_program *program, unsigned lanes,
                               zs_request request, zs_arena *arena,
                               const zs_program *result[ZS_LANES])
{
  restrict_lanes(eval, program, lanes, request, true, arena, result);
}

void zs_program_restrict_choices(zs_eval *eval, const zs_program *program, unsigned lanes,
                                 zs_request request, zs_arena *arena,
                                 const zs_program *result[ZS_LANES])
{
  restrict_lanes(eval, program, lanes, request, false, arena, result);
}

const zs_program *zs_program_restrict(zs_eval *eval, const zs_program *program, unsigned lane,
                                      zs_request request, zs_arena *arena)
{
  const zs_program *result[ZS_LANES];
  zs_program_restrict_lanes(eval, program, 1u << lane, request, arena, result);
  return result[lane];
}

/* ---- Public calls ---------------------------------------------------------------- */

static const zs_program *current(const zs_eval *eval)
{
  return eval->programs[eval->regions];
}

/* Points of a block of a program's values: without derivatives, the registers
 * have room for more, which a few of them may hold without leaving the nearest
 * cache.  Operations with a regional form count on ZS_BLOCK. */
static unsigned value_block(const zs_program *program)
{
  enum { FEW = 6 };
  return program->register_count <= FEW && !program->regional_count ? ZS_EVAL_ROWS * ZS_BLOCK
                                                                    : ZS_BLOCK;
}

/* Numbers from where an index says, or one after the other without one. */
static void gather(float *to, const float *from, const uint32_t *index, unsigned n)
{
  if (!index)
    memcpy(to, from, n * sizeof *to);
  for (unsigned i = 0; index && i < n; i++)
    to[i] = from[index[i]];
}

static void spread(float *to, const float *from, const uint32_t *index, unsigned n)
{
  if (!index)
    memcpy(to, from, n * sizeof *to);
  for (unsigned i = 0; index && i < n; i++)
    to[index[i]] = from[i];
}

void zs_points_evaluate(zs_eval *eval, const zs_program *program, const zs_frame *frame,
                        const zs_points *points, size_t first, const uint32_t *index, size_t count)
{
  const bool gradients = points->rows > 1;
  const unsigned block = gradients ? ZS_BLOCK : value_block(program);
  float *const at[3] = {eval->block, eval->block + block, eval->block + 2 * block};
  float *out = eval->block + 3 * block;
  for (size_t from = 0; from < count; from += block) {
    const unsigned m = count - from < block ? (unsigned)(count - from) : block;
    const uint32_t *which = index ? index + from : NULL;
    const size_t base = index ? first : first + from;
    for (int k = 0; k < 3; k++)
      gather(at[k], points->at[k] + base, which, m);
    run(eval, program, frame, zs_pad_points(m, at[0], at[1], at[2]), at, out, eval->gradients,
        gradients);
    for (unsigned k = 0; k < points->rows; k++)
      spread(points->result[k] + base, out + (size_t)k * ZS_BLOCK, which, m);
  }
}

static void evaluate(zs_eval *eval, const double origin[3], const zs_points *points, size_t count)
{
  const zs_program *program = current(eval);
  const zs_frame frame = zs_frame_at(origin);
  if (zs_scatter_pays(program, count))
    zs_scatter_evaluate(eval, program, &frame, points, count);
  else
    zs_points_evaluate(eval, program, &frame, points, 0, NULL, count);
}

void zs_eval_values(zs_eval *eval, const double origin[3], size_t n, const float *x,
                    const float *y, const float *z, float *f)
{
  const zs_points points = {.at = {x, y, z}, .result = {f}, .rows = 1};
  evaluate(eval, origin, &points, n);
}

void zs_eval_gradients(zs_eval *eval, const double origin[3], size_t n, const float *x,
                       const float *y, const float *z, float *f, float *gx, float *gy, float *gz)
{
  const zs_points points = {.at = {x, y, z}, .result = {f, gx, gy, gz}, .rows = ZS_EVAL_ROWS};
  evaluate(eval, origin, &points, n);
}

double zs_eval_point(zs_eval *eval, const double point[3])
{
  return zs_program_point(eval, current(eval), point);
}

/* Boxes of the scene relative to an origin, ends rounded outward. */
static void local_boxes(unsigned n, const double (*lo)[3], const double (*hi)[3],
                        const double origin[3], zs_boxes *boxes)
{
  for (unsigned l = 0; l < ZS_LANES; l++) {
    const unsigned i = l < n ? l : n - 1;
    zs_boxes_set(boxes, l, lo[i], hi[i], origin);
  }
}

void zs_eval_bounds(zs_eval *eval, size_t n, const double (*box_lo)[3], const double (*box_hi)[3],
                    float *lo, float *hi)
{
  for (size_t at = 0; at < n; at += ZS_LANES) {
    unsigned m = n - at < ZS_LANES ? (unsigned)(n - at) : ZS_LANES;
    zs_boxes boxes;
    zs_bounds result;
    double origin[3];
    for (int k = 0; k < 3; k++) {
      double middle = (box_lo[at][k] + box_hi[at][k]) / 2;
      origin[k] = isfinite(middle) ? middle : 0;
    }
    local_boxes(m, box_lo + at, box_hi + at, origin, &boxes);
    zs_frame frame = zs_frame_at(origin);
    zs_program_bounds(eval, current(eval), &frame, &boxes, &result);
    memcpy(lo + at, result.lo, m * sizeof *lo);
    memcpy(hi + at, result.hi, m * sizeof *hi);
  }
}

bool zs_eval_restrict(zs_eval *eval, const double lo[3], const double hi[3], zs_request request)
{
  if (eval->regions == ZS_MAXIMUM_REGIONS)
    return false;
  double box_lo[1][3], box_hi[1][3];
  memcpy(box_lo[0], lo, sizeof box_lo[0]);
  memcpy(box_hi[0], hi, sizeof box_hi[0]);
  float f_lo, f_hi;
  zs_eval_bounds(eval, 1, (const double(*)[3])box_lo, (const double(*)[3])box_hi, &f_lo, &f_hi);
  const zs_program *program = current(eval);
  eval->marks[eval->regions] = zs_arena_mark_here(&eval->arena);
  eval->programs[++eval->regions] = zs_program_restrict(eval, program, 0, request, &eval->arena);
  return true;
}

void zs_eval_release(zs_eval *eval)
{
  if (eval->regions)
    zs_arena_rewind(&eval->arena, eval->marks[--eval->regions]);
}
