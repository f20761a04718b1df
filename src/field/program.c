/* Shortening: from instructions and what is known of their intervals to the
 * program that is still needed. */
#include "field/field.h"
#include "field/scalar.h"

#include <string.h>

/* What is asked of an instruction's result. */
enum { IDLE, SIGN_ONLY, FULL };

/* The input that stands for the whole instruction in this lane, or -1. */
static int stand_in(const zs_instruction *instruction, const zs_trace *trace, unsigned demand)
{
  if (!trace->choices || !instruction->operation->choice)
    return -1;
  const zs_choice *choice = &trace->choices[instruction->choice];
  for (unsigned k = 0; k < instruction->operation->arity; k++) {
    unsigned lanes = choice->copy[k];
    if (demand == SIGN_ONLY)
      lanes |= choice->sign[k];
    if (lanes >> trace->lane & 1)
      return (int)k;
  }
  return -1;
}

static void ask(uint8_t *demand, uint32_t of, uint8_t what)
{
  if (demand[of] < what)
    demand[of] = what;
}

/* From the result backwards: who is needed, and for what.  `renamed` gets the
 * stand-in of those that have one, itself for the others.  Returns how many
 * instructions are left. */
static uint32_t mark(const zs_instruction *instructions, uint32_t count, const zs_trace *trace,
                     zs_request request, const zs_shortener *work)
{
  uint8_t *demand = work->demand;
  uint32_t left = ZS_COORDINATES;
  memset(demand, IDLE, count);
  demand[count - 1] = request == ZS_REQUEST_SIGN ? SIGN_ONLY : FULL;
  for (uint32_t i = count; i-- > ZS_COORDINATES;) {
    if (demand[i] == IDLE)
      continue;
    const zs_instruction *instruction = &instructions[i];
    int k = stand_in(instruction, trace, demand[i]);
    if (k >= 0) {
      work->renamed[i] = instruction->in[k];
      ask(demand, instruction->in[k], demand[i]);
      continue;
    }
    work->renamed[i] = i;
    left++;
    uint8_t what = instruction->operation->sign_transparent ? demand[i] : FULL;
    for (unsigned j = 0; j < instruction->operation->arity; j++)
      ask(demand, instruction->in[j], what);
  }
  return left;
}

/* Data that is valid where the trace's lane is. */
static const void *restricted_data(const zs_instruction *instruction, const zs_trace *trace,
                                   zs_arena *arena)
{
  const zs_operation *operation = instruction->operation;
  if (!trace->regional || !operation->restricted)
    return instruction->data;
  float lo[ZS_MAXIMUM_INPUTS] = {0}, hi[ZS_MAXIMUM_INPUTS] = {0};
  for (unsigned k = 0; k < operation->arity; k++) {
    const zs_bounds *in = &trace->regional[instruction->regional][k];
    lo[k] = in->lo[trace->lane];
    hi[k] = in->hi[trace->lane];
    if (!(lo[k] <= hi[k]))
      return instruction->data;
  }
  return operation->restricted(instruction->data, lo, hi, arena);
}

/* Copy what is needed, in order; afterwards `renamed` leads from old indices to
 * new ones. */
static void copy(zs_program *program, zs_instruction *out, const zs_instruction *instructions,
                 uint32_t count, const zs_trace *trace, const zs_shortener *work, zs_arena *arena)
{
  uint32_t *renamed = work->renamed, next = ZS_COORDINATES;
  for (uint32_t i = 0; i < ZS_COORDINATES; i++) {
    out[i] = instructions[i];
    renamed[i] = i;
  }
  for (uint32_t i = ZS_COORDINATES; i < count; i++) {
    if (work->demand[i] == IDLE)
      continue;
    if (renamed[i] != i) {
      renamed[i] = renamed[renamed[i]];
      continue;
    }
    zs_instruction instruction = instructions[i];
    for (unsigned k = 0; k < instruction.operation->arity; k++)
      instruction.in[k] = renamed[instruction.in[k]];
    instruction.data = restricted_data(&instructions[i], trace, arena);
    if (instruction.operation->choice)
      instruction.choice = program->choice_count++;
    if (instruction.operation->restricted)
      instruction.regional = program->regional_count++;
    renamed[i] = next;
    out[next++] = instruction;
  }
}

/* Linear scan from the end: a register is taken at a value's last use and free
 * again above its definition.  `free_list` holds registers that are free. */
static uint32_t assign_registers(const zs_instruction *instructions, uint32_t count,
                                 uint32_t *registers, uint32_t *free_list)
{
  const uint32_t none = UINT32_MAX;
  uint32_t used = ZS_COORDINATES, free_count = 0;
  for (uint32_t i = 0; i < count; i++)
    registers[i] = i < ZS_COORDINATES ? i : none;
  for (uint32_t i = count; i-- > ZS_COORDINATES;) {
    if (registers[i] == none) /* the result */
      registers[i] = free_count ? free_list[--free_count] : used++;
    free_list[free_count++] = registers[i];
    for (unsigned k = 0; k < instructions[i].operation->arity; k++) {
      uint32_t in = instructions[i].in[k];
      if (registers[in] == none)
        registers[in] = free_count ? free_list[--free_count] : used++;
    }
  }
  return used;
}

const zs_program *zs_program_shorten(const zs_instruction *instructions, uint32_t count,
                                     const zs_trace *trace, zs_request request, uint32_t limit,
                                     const zs_shortener *work, zs_arena *arena)
{
  uint32_t left = mark(instructions, count, trace, request, work);
  if (left > limit)
    return NULL;
  zs_program *program = ZS_ARENA_NEW(arena, zs_program, 1);
  zs_instruction *out = ZS_ARENA_NEW(arena, zs_instruction, left);
  uint32_t *registers = ZS_ARENA_NEW(arena, uint32_t, left);
  if (!program || !out || !registers)
    return NULL;
  copy(program, out, instructions, count, trace, work, arena);
  program->instructions = out;
  program->count = left;
  /* The old names are not needed any more. */
  program->register_count = assign_registers(out, left, registers, work->renamed);
  program->registers = registers;
  program->request = request;
  return program;
}
