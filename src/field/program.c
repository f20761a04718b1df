/* Shortening: from instructions and what is known of their intervals to the
 * programs that are still needed. */
#include "field/chain.h"
#include "field/field.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void *new_list(size_t count, size_t size)
{
  void *list = malloc(count * size);
  zs_memory_is_large(list, count * size);
  return list;
}

bool zs_shortener_init(zs_shortener *shortener, uint32_t instructions, uint32_t links)
{
  const size_t n = instructions, m = links ? links : 1;
  *shortener = (zs_shortener){0};
  shortener->needed = new_list(n, sizeof *shortener->needed);
  shortener->begun = new_list(n, sizeof *shortener->begun);
  shortener->stand_ins = new_list(n, sizeof *shortener->stand_ins);
  shortener->demands = new_list(n, sizeof *shortener->demands);
  shortener->renamed = new_list(n, sizeof *shortener->renamed);
  shortener->own = new_list(m, sizeof *shortener->own);
  uint32_t *kept = new_list(n, ZS_LANES * sizeof *kept);
  uint32_t *kept_links = new_list(m, ZS_LANES * sizeof *kept_links);
  uint32_t *forward = new_list(n, ZS_LANES / ZS_TEAM * sizeof *forward);
  for (unsigned l = 0; l < ZS_LANES; l++) {
    shortener->kept[l] = kept ? kept + l * n : NULL;
    shortener->links[l] = kept_links ? kept_links + l * m : NULL;
  }
  for (unsigned t = 0; forward && t < ZS_LANES / ZS_TEAM; t++)
    shortener->forward[t] = forward + t * n;
  return shortener->needed && shortener->begun && shortener->stand_ins && shortener->demands &&
         shortener->renamed && shortener->own && kept && kept_links && forward;
}

void zs_shortener_free(zs_shortener *shortener)
{
  free(shortener->needed);
  free(shortener->begun);
  free(shortener->stand_ins);
  free(shortener->forward[0]);
  free(shortener->demands);
  free(shortener->renamed);
  free(shortener->own);
  free(shortener->kept[0]);
  free(shortener->links[0]);
}

/* Keep an instruction in some lanes. */
static void keep(zs_shortener *shortener, unsigned lanes, uint32_t index)
{
  for (; lanes; lanes &= lanes - 1) {
    unsigned l = (unsigned)__builtin_ctz(lanes);
    shortener->kept[l][shortener->count[l]++] = index;
    shortener->hash[l] = (shortener->hash[l] ^ index) * UINT64_C(0x9e3779b97f4a7c15);
  }
}

static void keep_link(zs_shortener *shortener, unsigned lanes, uint32_t ordinal)
{
  for (; lanes; lanes &= lanes - 1) {
    unsigned l = (unsigned)__builtin_ctz(lanes);
    shortener->links[l][shortener->link_count[l]++] = ordinal;
    shortener->hash[l] = (shortener->hash[l] ^ ~ordinal) * UINT64_C(0x9e3779b97f4a7c15);
  }
}

/* List the links that the lanes keep of a chain.  `choices` may be NULL. */
static void list_links(zs_shortener *shortener, const zs_instruction *instruction, uint32_t index,
                       const zs_choice *choices, bool sign)
{
  const zs_chain *chain = instruction->data;
  const unsigned needed = shortener->needed[index];
  unsigned open = needed, with_links = 0;
  for (uint32_t i = chain->count; open && i-- > 0;) {
    const uint32_t ordinal = instruction->link + i;
    const zs_choice all = {.copy = {0}}, *choice = choices ? &choices[ordinal] : &all;
    const unsigned kept = open & ~(choice->copy[0] | (sign ? choice->sign[0] : 0u));
    keep_link(shortener, kept, ordinal);
    with_links |= kept;
    open &= ~(kept & (choice->copy[1] | (sign ? choice->sign[1] : 0u)));
  }
  const unsigned begun = chain->begins ? needed : needed & ~open;
  shortener->begun[index] = (uint16_t)begun;
  shortener->stand_ins[index].input[ZS_CHAIN_SO_FAR] = (uint16_t)(needed & ~with_links);
  shortener->needed[instruction->in[ZS_CHAIN_SO_FAR]] |= (uint16_t)(needed & ~begun);
  keep(shortener, with_links, index);
  for (unsigned k = 0; k < ZS_CHAIN_SO_FAR; k++)
    shortener->needed[instruction->in[k]] |= (uint16_t)with_links;
}

/* Hand an instruction's lanes on to the inputs that stand in for it in some of
 * them.  Returns the lanes in which it is replaced. */
static unsigned replace(zs_shortener *shortener, const zs_instruction *instruction, uint32_t index,
                        const zs_choice *choice, bool sign)
{
  unsigned needed = shortener->needed[index], replaced = 0;
  for (unsigned k = 0; k < instruction->operation->arity; k++) {
    const unsigned lanes = (choice->copy[k] | (sign ? choice->sign[k] : 0u)) & needed;
    shortener->stand_ins[index].input[k] = (uint16_t)lanes;
    shortener->needed[instruction->in[k]] |= (uint16_t)lanes;
    needed &= ~lanes;
    replaced |= lanes;
  }
  return replaced;
}

/* Chains of instructions that a team replaces alike are long where each lane keeps
 * a few of many operands: one step takes a lane to their end. */
static void find_forwards(zs_shortener *shortener, const zs_instruction *instructions,
                          uint32_t count, unsigned team)
{
  const unsigned lanes = ((1u << ZS_TEAM) - 1) << (team * ZS_TEAM);
  uint32_t *forward = shortener->forward[team];
  for (uint32_t i = 0; i < ZS_COORDINATES; i++)
    forward[i] = i;
  for (uint32_t i = ZS_COORDINATES; i < count; i++) {
    const unsigned needed = shortener->needed[i] & lanes;
    if (!needed)
      continue;
    forward[i] = i;
    for (unsigned k = 0; k < ZS_MAXIMUM_INPUTS; k++)
      if ((shortener->stand_ins[i].input[k] & lanes) == needed)
        forward[i] = forward[instructions[i].in[k]];
  }
}

void zs_shortener_list(zs_shortener *shortener, const zs_instruction *instructions, uint32_t count,
                       const zs_choice *choices, const zs_choice *links, unsigned lanes,
                       zs_request request)
{
  uint16_t *needed = shortener->needed;
  const bool sign = request == ZS_REQUEST_SIGN;
  memset(needed, 0, count * sizeof *needed);
  memset(shortener->count, 0, sizeof shortener->count);
  memset(shortener->link_count, 0, sizeof shortener->link_count);
  memset(shortener->hash, 0, sizeof shortener->hash);
  needed[count - 1] = (uint16_t)lanes;
  for (uint32_t i = count; i-- > ZS_COORDINATES;) {
    unsigned kept = needed[i];
    if (!kept)
      continue;
    const zs_instruction *instruction = &instructions[i];
    const zs_operation *operation = instruction->operation;
    shortener->stand_ins[i] = (zs_stand_ins){{0}};
    if (operation->chain) {
      list_links(shortener, instruction, i, links, sign);
      continue;
    }
    if (choices && operation->choice)
      kept &= ~replace(shortener, instruction, i, &choices[instruction->choice], sign);
    if (!kept)
      continue;
    keep(shortener, kept, i);
    for (unsigned k = 0; k < operation->arity; k++)
      needed[instruction->in[k]] |= (uint16_t)kept;
  }
  for (unsigned team = 0; team < ZS_LANES / ZS_TEAM; team++)
    if (lanes >> (team * ZS_TEAM) & ((1u << ZS_TEAM) - 1))
      find_forwards(shortener, instructions, count, team);
}

/* The instruction that a lane keeps in the place of a needed one. */
static uint32_t resolved(const zs_shortener *shortener, const zs_instruction *instructions,
                         unsigned lane, uint32_t index)
{
  const uint32_t *forward = shortener->forward[lane / ZS_TEAM];
  while ((index = forward[index]) >= ZS_COORDINATES) {
    const zs_stand_ins *stand_ins = &shortener->stand_ins[index];
    unsigned k = 0;
    while (k < ZS_MAXIMUM_INPUTS && !(stand_ins->input[k] >> lane & 1))
      k++;
    if (k == ZS_MAXIMUM_INPUTS)
      return index;
    index = instructions[index].in[k];
  }
  return index;
}

/* How many of a kept instruction's inputs the lane needs. */
static unsigned needed_inputs(const zs_shortener *shortener, const zs_instruction *instruction,
                              uint32_t index, unsigned lane)
{
  const bool begins = instruction->operation->chain && shortener->begun[index] >> lane & 1;
  return begins ? ZS_CHAIN_SO_FAR : instruction->operation->arity;
}

bool zs_shortener_equal(const zs_shortener *shortener, const zs_instruction *instructions,
                        unsigned lane, unsigned other)
{
  const uint32_t count = shortener->count[lane], *kept = shortener->kept[lane];
  const uint32_t link_count = shortener->link_count[lane], *links = shortener->links[lane];
  if (shortener->hash[lane] != shortener->hash[other] || count != shortener->count[other] ||
      link_count != shortener->link_count[other] ||
      memcmp(kept, shortener->kept[other], count * sizeof *kept) ||
      memcmp(links, shortener->links[other], link_count * sizeof *links))
    return false;
  for (uint32_t e = 0; e < count; e++) {
    const zs_instruction *instruction = &instructions[kept[e]];
    const unsigned inputs = needed_inputs(shortener, instruction, kept[e], lane);
    if (inputs != needed_inputs(shortener, instruction, kept[e], other))
      return false;
    for (unsigned k = 0; k < inputs; k++)
      if (resolved(shortener, instructions, lane, instruction->in[k]) !=
          resolved(shortener, instructions, other, instruction->in[k]))
        return false;
  }
  return true;
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

/* The data of a chain with the lane's links, of which the last `left` of its list are
 * not yet placed. */
static const void *chain_data(zs_shortener *shortener, const zs_instruction *instruction,
                              uint32_t index, unsigned lane, uint32_t *left, zs_arena *arena)
{
  const zs_chain *chain = instruction->data;
  const uint32_t *links = shortener->links[lane];
  uint32_t *own = shortener->own, count = 0;
  while (*left && links[*left - 1] - instruction->link < chain->count)
    own[count++] = links[--*left] - instruction->link;
  const bool begins = shortener->begun[index] >> lane & 1;
  if (count == chain->count && begins == chain->begins)
    return chain;
  return zs_chain_shortened(chain, begins, own, count, arena);
}

/* Linear scan from the end: a register is taken at a value's last use and is
 * free again above its definition.  `idle` has room for every register. */
static uint32_t assign_registers(const zs_instruction *instructions, uint32_t count,
                                 uint32_t *registers, uint32_t *idle)
{
  const uint32_t none = UINT32_MAX;
  uint32_t used = ZS_COORDINATES, idle_count = 0;
  for (uint32_t i = 0; i < count; i++)
    registers[i] = i < ZS_COORDINATES ? i : none;
  for (uint32_t i = count; i-- > ZS_COORDINATES;) {
    if (registers[i] == none) /* the result */
      registers[i] = used++;
    idle[idle_count++] = registers[i];
    for (unsigned k = 0; k < instructions[i].operation->arity; k++) {
      uint32_t in = instructions[i].in[k];
      if (registers[in] == none)
        registers[in] = idle_count ? idle[--idle_count] : used++;
    }
  }
  return used;
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

/* Where each value matters for the sign of the result, from those that use it.
 * Along a chain of the same operation the demand does not grow: what an operand
 * has to be away from the surface to be without influence, it is away from there
 * at every link. */
static void find_demands(const zs_instruction *instructions, uint32_t count, zs_demand *demands)
{
  const zs_demand nowhere = {-INFINITY, -INFINITY}, everywhere = {INFINITY, INFINITY};
  for (uint32_t i = 0; i < count; i++)
    demands[i] = nowhere;
  demands[count - 1] = (zs_demand){0, 0};
  for (uint32_t i = count; i-- > ZS_COORDINATES;) {
    const zs_instruction *instruction = &instructions[i];
    const zs_operation *operation = instruction->operation;
    const zs_demand inputs =
      operation->demand ? operation->demand(instruction->data, demands[i]) : everywhere;
    for (unsigned k = 0; k < operation->arity; k++) {
      const uint32_t in = instruction->in[k];
      if (operation->chain && k != ZS_CHAIN_SO_FAR) { /* a coordinate */
        demands[in] = everywhere;
        continue;
      }
      const bool chained = operation->demand && operation->arity > 1 &&
                           zs_joints_equal(instruction, &instructions[in]);
      raise_demand(&demands[in], chained ? demands[i] : inputs);
    }
  }
}

const zs_program *zs_shortener_emit(zs_shortener *shortener, const zs_instruction *instructions,
                                    unsigned lane, zs_request request,
                                    const zs_bounds (*regional)[ZS_MAXIMUM_INPUTS],
                                    zs_arena *arena)
{
  const uint32_t *kept = shortener->kept[lane], count = shortener->count[lane] + ZS_COORDINATES;
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
  for (uint32_t e = shortener->count[lane]; e-- > 0;) {
    const zs_instruction *instruction = &instructions[kept[e]];
    const zs_operation *operation = instruction->operation;
    zs_instruction *copy = &out[next];
    copy->operation = operation;
    copy->data = instruction->data;
    if (operation->restricted && regional)
      copy->data = restricted_data(instruction, lane, regional[instruction->regional], arena);
    else if (operation->chain)
      copy->data = chain_data(shortener, instruction, kept[e], lane, &links_left, arena);
    if (operation->chain && !copy->data)
      return NULL;
    const unsigned inputs = needed_inputs(shortener, instruction, kept[e], lane);
    for (unsigned k = 0; k < inputs; k++)
      copy->in[k] = renamed[resolved(shortener, instructions, lane, instruction->in[k])];
    for (unsigned k = inputs; k < ZS_MAXIMUM_INPUTS; k++)
      copy->in[k] = 0;
    copy->choice = program->choice_count;
    copy->regional = program->regional_count;
    copy->link = program->link_count;
    program->link_count += operation->chain ? ((const zs_chain *)copy->data)->count : 0;
    program->choice_count += operation->choice;
    program->regional_count += operation->restricted != NULL;
    renamed[kept[e]] = next++;
  }
  program->instructions = out;
  program->count = count;
  if (program->choice_count) {
    zs_demand *demands = zs_arena_reserve(arena, program->choice_count, sizeof *demands);
    if (!demands)
      return NULL;
    find_demands(out, count, shortener->demands);
    for (uint32_t i = ZS_COORDINATES; i < count; i++)
      if (out[i].operation->choice)
        demands[out[i].choice] = shortener->demands[i];
    program->demands = demands;
  }
  /* The names are not needed any more: their room serves the registers. */
  program->register_count = assign_registers(out, count, registers, renamed);
  program->registers = registers;
  program->request = request;
  return program;
}
