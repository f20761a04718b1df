/* Shortening: from instructions and what is known of their intervals to the
 * programs that are still needed. */
#include "base/memory.h"
#include "field/chain.h"
#include "field/field.h"
#include "field/scalar.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A step of a lane's list: an instruction, and what becomes of it. */
typedef enum fate {
  REPLACED,                       /* by input 0; by input k: REPLACED + k */
  ZERO = ZS_MAXIMUM_INPUTS,       /* kept as a constant */
  KEPT,
  BEGUN,   /* a chain that is kept, without what was before it */
  SIMPLER, /* kept as its operation's form for signs */
  FATE_BITS = 3
} fate;

static uint32_t make_step(uint32_t index, unsigned fate)
{
  return index << FATE_BITS | fate;
}

static uint32_t step_index(uint32_t step)
{
  return step >> FATE_BITS;
}

static unsigned step_fate(uint32_t step)
{
  return step & ((1u << FATE_BITS) - 1);
}

bool zs_shortener_init(zs_shortener *shortener, uint32_t instructions, uint32_t links,
                       uint32_t regional)
{
  const size_t n = instructions, m = links ? links : 1, k = regional ? regional : 1;
  *shortener = (zs_shortener){0};
  if (n >> (32 - FATE_BITS))
    return false;
  shortener->needed = zs_memory_new(n, sizeof *shortener->needed);
  shortener->renamed = zs_memory_new(n + 1, sizeof *shortener->renamed);
  shortener->own = zs_memory_new(m, sizeof *shortener->own);
  shortener->data = zs_memory_new(k, sizeof *shortener->data);
  uint32_t *steps = zs_memory_new(n, ZS_LANES * sizeof *steps);
  uint32_t *lane_links = zs_memory_new(m, ZS_LANES * sizeof *lane_links);
  for (unsigned l = 0; l < ZS_LANES; l++) {
    shortener->steps[l] = steps ? steps + l * n : NULL;
    shortener->links[l] = lane_links ? lane_links + l * m : NULL;
  }
  return shortener->needed && shortener->renamed && shortener->own && shortener->data && steps &&
         lane_links;
}

void zs_shortener_free(zs_shortener *shortener)
{
  free(shortener->needed);
  free(shortener->renamed);
  free(shortener->own);
  free(shortener->data);
  free(shortener->steps[0]);
  free(shortener->links[0]);
}

static uint64_t mixed(uint64_t hash, uint32_t word)
{
  return (hash ^ word) * UINT64_C(0x9e3779b97f4a7c15);
}

/* Put an instruction on the lists of some lanes. */
static void add_step(zs_shortener *shortener, unsigned lanes, uint32_t index, unsigned fate)
{
  const uint32_t step = make_step(index, fate);
  for (; lanes; lanes &= lanes - 1) {
    const unsigned l = (unsigned)__builtin_ctz(lanes);
    shortener->steps[l][shortener->step_count[l]++] = step;
    shortener->kept[l] += fate >= ZERO;
    shortener->hash[l] = mixed(shortener->hash[l], step);
  }
}

static void keep_link(zs_shortener *shortener, unsigned lanes, uint32_t ordinal)
{
  for (; lanes; lanes &= lanes - 1) {
    const unsigned l = (unsigned)__builtin_ctz(lanes);
    shortener->links[l][shortener->link_count[l]++] = ordinal;
    shortener->hash[l] = mixed(shortener->hash[l], ~ordinal);
  }
}

/* List the links that some lanes keep of a chain.  `choices` may be NULL. */
static void list_links(zs_shortener *shortener, const zs_instruction *instruction, uint32_t index,
                       unsigned needed, const zs_choice *choices, bool sign)
{
  const zs_chain *chain = instruction->data;
  unsigned open = needed, with_links = 0;
  for (uint32_t i = chain->count; open && i-- > 0;) {
    const uint32_t ordinal = instruction->ordinal + i;
    const zs_choice all = {.copy = {0}}, *choice = choices ? &choices[ordinal] : &all;
    const unsigned kept = open & ~(choice->copy[0] | (sign ? choice->sign[0] : 0u));
    keep_link(shortener, kept, ordinal);
    with_links |= kept;
    open &= ~(kept & (choice->copy[1] | (sign ? choice->sign[1] : 0u)));
  }
  const unsigned begun = chain->begins ? needed : needed & ~open;
  add_step(shortener, needed & ~with_links, index, REPLACED + ZS_CHAIN_SO_FAR);
  add_step(shortener, with_links & ~begun, index, KEPT);
  add_step(shortener, with_links & begun, index, BEGUN);
  shortener->needed[instruction->in[ZS_CHAIN_SO_FAR]] |= (uint16_t)(needed & ~begun);
  for (unsigned k = 0; k < ZS_CHAIN_SO_FAR; k++)
    shortener->needed[instruction->in[k]] |= (uint16_t)with_links;
}

/* Hand some lanes of an instruction on to the input that stands in for it there. */
static void replace(zs_shortener *shortener, const zs_instruction *instruction, uint32_t index,
                    unsigned input, unsigned lanes)
{
  add_step(shortener, lanes, index, REPLACED + input);
  shortener->needed[instruction->in[input]] |= (uint16_t)lanes;
}

/* The same for the inputs that the operation has chosen.  Returns the lanes without. */
static unsigned replace_chosen(zs_shortener *shortener, const zs_instruction *instruction,
                               uint32_t index, unsigned needed, const zs_choice *choice, bool sign)
{
  for (unsigned k = 0; k < instruction->operation->arity; k++) {
    const unsigned lanes = (choice->copy[k] | (sign ? choice->sign[k] : 0u)) & needed;
    replace(shortener, instruction, index, k, lanes);
    needed &= ~lanes;
  }
  return needed;
}

/* The same for the inputs whose fellow is neutral. */
static unsigned replace_neutral(zs_shortener *shortener, const zs_instruction *instruction,
                                uint32_t index, unsigned needed, const uint16_t *zeros)
{
  for (unsigned k = 0; k < 2; k++) {
    if (!(instruction->operation->neutral >> k & 1))
      continue;
    const unsigned lanes = zeros[instruction->in[k]] & needed;
    replace(shortener, instruction, index, 1 - k, lanes);
    needed &= ~lanes;
  }
  return needed;
}

void zs_shortener_list(zs_shortener *shortener, const zs_instruction *instructions, uint32_t count,
                       const zs_findings *findings, unsigned lanes, zs_request request)
{
  uint16_t *needed = shortener->needed;
  const bool sign = request == ZS_REQUEST_SIGN;
  const uint16_t *zeros = findings ? findings->zeros : NULL;
  memset(needed, 0, count * sizeof *needed);
  memset(shortener->step_count, 0, sizeof shortener->step_count);
  memset(shortener->kept, 0, sizeof shortener->kept);
  memset(shortener->link_count, 0, sizeof shortener->link_count);
  memset(shortener->hash, 0, sizeof shortener->hash);
  needed[count - 1] = (uint16_t)lanes;
  for (uint32_t i = count; i-- > ZS_COORDINATES;) {
    unsigned kept = needed[i];
    if (!kept)
      continue;
    const zs_instruction *instruction = &instructions[i];
    const zs_operation *operation = instruction->operation;
    if (zeros && zeros[i]) {
      add_step(shortener, kept & zeros[i], i, ZERO);
      kept &= ~(unsigned)zeros[i];
    }
    if (operation->chain) {
      list_links(shortener, instruction, i, kept, findings ? findings->links : NULL, sign);
      continue;
    }
    const zs_choice *choice =
      findings && operation->choice ? &findings->choices[instruction->ordinal] : NULL;
    if (choice)
      kept = replace_chosen(shortener, instruction, i, kept, choice, sign);
    if (zeros && operation->neutral)
      kept = replace_neutral(shortener, instruction, i, kept, zeros);
    if (!kept)
      continue;
    const unsigned simpler = choice && sign && operation->for_sign ? kept & choice->simpler : 0;
    add_step(shortener, kept & ~simpler, i, KEPT);
    add_step(shortener, simpler, i, SIMPLER);
    for (unsigned k = 0; k < operation->arity; k++)
      needed[instruction->in[k]] |= (uint16_t)kept;
  }
}

bool zs_shortener_equal(const zs_shortener *shortener, unsigned lane, unsigned other)
{
  const uint32_t count = shortener->step_count[lane], links = shortener->link_count[lane];
  return shortener->hash[lane] == shortener->hash[other] &&
         count == shortener->step_count[other] && links == shortener->link_count[other] &&
         !memcmp(shortener->steps[lane], shortener->steps[other], count * sizeof(uint32_t)) &&
         !memcmp(shortener->links[lane], shortener->links[other], links * sizeof(uint32_t));
}

/* Data that is valid where the lane's box is. */
static const void *restricted_data(const zs_instruction *instruction, unsigned lane,
                                   const zs_bounds in[ZS_MAXIMUM_INPUTS], zs_arena *arena)
{
  float lo[ZS_MAXIMUM_INPUTS] = {0}, hi[ZS_MAXIMUM_INPUTS] = {0};
  for (unsigned k = 0; k < instruction->operation->arity; k++) {
    lo[k] = in[k].lo[lane];
    hi[k] = in[k].hi[lane];
    if (!(lo[k] <= hi[k]))
      return instruction->data;
  }
  return instruction->operation->restricted(instruction->data, lo, hi, arena);
}

static bool is_regional(const zs_operation *operation)
{
  return operation->restricted && !operation->chain && !operation->choice;
}

/* Siblings are restricted alike, to stay siblings. */
bool zs_shortener_restrict(zs_shortener *shortener, const zs_instruction *instructions,
                           unsigned lane, const zs_bounds (*regional)[ZS_MAXIMUM_INPUTS],
                           zs_arena *arena)
{
  bool changed = false;
  const zs_instruction *last = NULL; /* of those with a regional form */
  for (uint32_t e = 0; e < shortener->step_count[lane]; e++) {
    const uint32_t step = shortener->steps[lane][e];
    const zs_instruction *instruction = &instructions[step_index(step)];
    if (step_fate(step) < KEPT || !is_regional(instruction->operation))
      continue;
    const zs_operation *operation = instruction->operation;
    const void *data =
      last == instruction + 1 && zs_instructions_are_siblings(instruction, last)
        ? operation->restricted_like(instruction->data, last->data,
                                     shortener->data[last->ordinal], arena)
        : restricted_data(instruction, lane, regional[instruction->ordinal], arena);
    shortener->data[instruction->ordinal] = data;
    changed = changed || data != instruction->data;
    last = instruction;
  }
  return changed;
}

/* The data of a chain with the lane's links, of which the last `left` of its list are
 * not yet placed. */
static const void *chain_data(zs_shortener *shortener, const zs_instruction *instruction,
                              bool begins, unsigned lane, uint32_t *left, zs_arena *arena)
{
  const zs_chain *chain = instruction->data;
  const uint32_t *links = shortener->links[lane];
  uint32_t *own = shortener->own, count = 0;
  while (*left && links[*left - 1] - instruction->ordinal < chain->count)
    own[count++] = links[--*left] - instruction->ordinal;
  if (count == chain->count && begins == chain->begins)
    return chain;
  return zs_chain_shortened(chain, begins, own, count, arena);
}

/* Linear scan from the end: a register is taken at a value's last use and is
 * free again above its definition.  `idle` has room for every register and one more. */
static uint32_t assign_registers(const zs_instruction *instructions, uint32_t count,
                                 uint32_t *registers, uint32_t *idle)
{
  enum { USUAL = 2 /* inputs; those that an operation does not have are coordinates */ };
  const uint32_t none = UINT32_MAX;
  uint32_t fresh = ZS_COORDINATES, idle_count = 1;
  for (uint32_t i = 0; i < count; i++)
    registers[i] = i < ZS_COORDINATES ? i : none;
  idle[0] = fresh;
  if (count > ZS_COORDINATES) {
    registers[count - 1] = fresh++;
    idle[0] = fresh;
  }
  for (uint32_t i = count; i-- > ZS_COORDINATES;) {
    const zs_instruction *instruction = &instructions[i];
    idle[idle_count++] = registers[i];
    const unsigned arity = instruction->operation->arity;
    for (unsigned k = 0; k < USUAL || k < arity; k++) {
      /* Without a branch, which no processor would foresee. */
      uint32_t *in = &registers[instruction->in[k]];
      const uint32_t now = *in, next = idle[idle_count - 1];
      *in = now == none ? next : now;
      idle_count -= now == none;
      if (!idle_count) {
        idle[0] = ++fresh;
        idle_count = 1;
      }
    }
  }
  return fresh;
}

bool zs_instruction_same_operation(const zs_instruction *a, const zs_instruction *b)
{
  return a->operation == b->operation &&
         (a->data == b->data ||
          (a->operation->data_size && !memcmp(a->data, b->data, a->operation->data_size)));
}

static void raise_demand(zs_demand *demand, zs_demand by)
{
  demand->below = by.below > demand->below ? by.below : demand->below;
  demand->above = by.above > demand->above ? by.above : demand->above;
}

/* Along a chain of the same operation the demand does not grow: what an operand has to
 * be away from the surface to be without influence, it is away from there at every
 * link. */
void zs_find_demands(zs_instruction *instructions, uint32_t count)
{
  const zs_demand nowhere = {-INFINITY, -INFINITY}, everywhere = {INFINITY, INFINITY};
  for (uint32_t i = 0; i < count; i++)
    instructions[i].demand = nowhere;
  instructions[count - 1].demand = (zs_demand){0, 0};
  for (uint32_t i = count; i-- > ZS_COORDINATES;) {
    const zs_instruction *instruction = &instructions[i];
    const zs_operation *operation = instruction->operation;
    const zs_demand result = instruction->demand;
    if (result.below == nowhere.below) /* without use */
      continue;
    const zs_demand inputs =
      operation->demand ? operation->demand(instruction->data, result) : everywhere;
    for (unsigned k = 0; k < operation->arity; k++) {
      zs_instruction *in = &instructions[instruction->in[k]];
      if (operation->chain && k != ZS_CHAIN_SO_FAR) { /* a coordinate */
        in->demand = everywhere;
        continue;
      }
      const bool chained =
        operation->demand && operation->arity > 1 && zs_joints_equal(instruction, in);
      raise_demand(&in->demand, chained ? result : inputs);
    }
  }
}

void zs_find_signed_zeros(zs_instruction *instructions, uint32_t count)
{
  for (uint32_t i = 0; i < count; i++)
    instructions[i].signed_zero = false;
  for (uint32_t i = count; i-- > ZS_COORDINATES;) {
    const zs_instruction *instruction = &instructions[i];
    const zs_operation *operation = instruction->operation;
    const bool passes = instruction->signed_zero && !operation->even;
    for (unsigned k = 0; k < operation->arity; k++)
      if (passes || operation->signed_zeros >> k & 1)
        instructions[instruction->in[k]].signed_zero = true;
  }
}

const zs_program *zs_shortener_emit(zs_shortener *shortener, const zs_instruction *instructions,
                                    unsigned lane, zs_request request, bool restricted,
                                    zs_arena *arena)
{
  static const double zero = 0;
  const uint32_t *steps = shortener->steps[lane], count = shortener->kept[lane] + ZS_COORDINATES;
  uint32_t *renamed = shortener->renamed, next = ZS_COORDINATES;
  uint32_t links_left = shortener->link_count[lane];
  zs_program *program = ZS_ARENA_NEW(arena, zs_program, 1);
  zs_instruction *out = zs_arena_reserve(arena, count, sizeof *out);
  uint32_t *registers = zs_arena_reserve(arena, count, sizeof *registers);
  if (!program || !out || !registers)
    return NULL;
  for (uint32_t i = 0; i < ZS_COORDINATES; i++) {
    out[i] = instructions[i];
    renamed[i] = i;
  }
  for (uint32_t e = shortener->step_count[lane]; e-- > 0;) {
    const uint32_t index = step_index(steps[e]);
    const unsigned fate = step_fate(steps[e]);
    const zs_instruction *instruction = &instructions[index];
    if (fate < ZERO) {
      renamed[index] = renamed[instruction->in[fate - REPLACED]];
      continue;
    }
    zs_instruction *copy = &out[next];
    copy->operation = instruction->operation;
    copy->data = instruction->data;
    if (fate == ZERO) {
      copy->operation = &zs_constant;
      copy->data = &zero;
    } else if (fate == SIMPLER) {
      copy->operation = instruction->operation->for_sign(instruction->data);
      copy->data = NULL;
    }
    const zs_operation *operation = copy->operation;
    copy->demand = instruction->demand;
    copy->signed_zero = instruction->signed_zero;
    copy->ordinal = 0;
    /* Inputs that an operation does not have are named 0, a coordinate. */
#pragma GCC unroll 4
    for (unsigned k = 0; k < ZS_MAXIMUM_INPUTS; k++)
      copy->in[k] = fate == ZERO ? 0 : renamed[instruction->in[k]];
    if (operation->chain) {
      const zs_chain *chain =
        chain_data(shortener, instruction, fate == BEGUN, lane, &links_left, arena);
      if (!chain)
        return NULL;
      copy->data = chain;
      if (fate == BEGUN)
        copy->in[ZS_CHAIN_SO_FAR] = 0;
      copy->ordinal = program->link_count;
      program->link_count += chain->count;
    } else if (operation->choice) {
      copy->ordinal = program->choice_count++;
    } else if (operation->restricted) {
      if (restricted)
        copy->data = shortener->data[instruction->ordinal];
      copy->ordinal = program->regional_count++;
    }
    renamed[index] = next++;
  }
  program->instructions = out;
  program->count = count;
  /* The names are not needed any more: their room serves the registers. */
  program->register_count = assign_registers(out, count, registers, renamed);
  program->registers = registers;
  program->request = request;
  return program;
}
