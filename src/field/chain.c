/* Finding chains, and their definition in double precision. */
#include "field/chain.h"

#include "field/field.h"
#include "field/scalar.h"

#include <stdlib.h>
#include <string.h>

/* ---- Operations --------------------------------------------------------------- */

/* The operation that joins two values by a profile. */
static const zs_operation *joint_operation(zs_chain_profile profile, double side)
{
  static const zs_operation *const smooth[ZS_CHAIN_COUNT] = {
    [ZS_CHAIN_QUADRATIC] = &zs_smooth_quadratic,
    [ZS_CHAIN_CUBIC] = &zs_smooth_cubic,
    [ZS_CHAIN_CIRCULAR] = &zs_smooth_circular,
    [ZS_CHAIN_CHAMFER] = &zs_smooth_chamfer,
  };
  if (profile != ZS_CHAIN_EXTREMUM)
    return smooth[profile];
  return zs_scalar_operation(side > 0 ? ZS_FUNCTION_MAXIMUM : ZS_FUNCTION_MINIMUM,
                             ZS_FORM_REGISTERS);
}

static double link_value(const zs_chain *chain, const zs_link *link, const double in[])
{
  const zs_operation *operation = zs_primitive_operation(link->shape, chain->root);
  const double value = operation->reference(link->primitive, in);
  return link->negated ? -value : value;
}

static double reference(const zs_chain *chain, const double in[], zs_chain_profile profile)
{
  const zs_operation *joint = joint_operation(profile, chain->blend.side);
  double f = in[ZS_CHAIN_SO_FAR];
  for (uint32_t i = 0; i < chain->count; i++) {
    const double link = link_value(chain, &chain->links[i], in), operands[2] = {f, link};
    f = i || !chain->begins ? joint->reference(&chain->blend, operands) : link;
  }
  return f;
}

static unsigned used(const void *data)
{
  const zs_chain *chain = data;
  unsigned inputs = chain->begins ? 0 : 1u << ZS_CHAIN_SO_FAR;
  for (uint32_t i = 0; i < chain->count; i++) {
    const zs_link *link = &chain->links[i];
    inputs |= zs_primitive_operation(link->shape, chain->root)->used(link->primitive);
  }
  return inputs;
}

static zs_demand demand(const zs_chain *chain, zs_demand result, zs_chain_profile profile)
{
  return joint_operation(profile, chain->blend.side)->demand(&chain->blend, result);
}

#define DEFINITION(PROFILE, NAME) \
  static double NAME##_reference(const void *data, const double in[]) \
  { \
    return reference(data, in, PROFILE); \
  } \
  static zs_demand NAME##_demand(const void *data, zs_demand result) \
  { \
    return demand(data, result, PROFILE); \
  }
DEFINITION(ZS_CHAIN_EXTREMUM, extremum)
DEFINITION(ZS_CHAIN_QUADRATIC, quadratic)
DEFINITION(ZS_CHAIN_CUBIC, cubic)
DEFINITION(ZS_CHAIN_CIRCULAR, circular)
DEFINITION(ZS_CHAIN_CHAMFER, chamfer)

#define LIST(PROFILE) [PROFILE] = ZS_VARIANTS(zs_chain_kernels, [PROFILE])
static const zs_kernels *const kernels[ZS_CHAIN_COUNT][ZS_ISA_COUNT] = {
  LIST(ZS_CHAIN_EXTREMUM), LIST(ZS_CHAIN_QUADRATIC), LIST(ZS_CHAIN_CUBIC),
  LIST(ZS_CHAIN_CIRCULAR), LIST(ZS_CHAIN_CHAMFER),
};

#define OPERATION(PROFILE, NAME) \
  [PROFILE] = {.name = #NAME " chain", .arity = 4, .chain = true, \
               .demand = NAME##_demand, .used = used, .kernels = kernels[PROFILE], \
               .reference = NAME##_reference},
static const zs_operation operations[ZS_CHAIN_COUNT] = {
  OPERATION(ZS_CHAIN_EXTREMUM, extremum)
  OPERATION(ZS_CHAIN_QUADRATIC, quadratic)
  OPERATION(ZS_CHAIN_CUBIC, cubic)
  OPERATION(ZS_CHAIN_CIRCULAR, circular)
  OPERATION(ZS_CHAIN_CHAMFER, chamfer)
};

/* ---- Joints -------------------------------------------------------------------- */

typedef struct joint {
  zs_chain_profile profile;
  zs_blend blend;
} joint;

/* The joint that an instruction is, or consists of.  False when it is none that
 * chains have. */
static bool joint_of(const zs_instruction *instruction, joint *j)
{
  const zs_operation *operation = instruction->operation;
  for (unsigned p = 0; p < ZS_CHAIN_COUNT; p++) {
    const zs_chain_profile profile = (zs_chain_profile)p;
    const bool is_union = operation == joint_operation(profile, ZS_BLEND_UNION);
    const bool chain = operation == &operations[p];
    if (!chain && !is_union && operation != joint_operation(profile, ZS_BLEND_INTERSECTION))
      continue;
    j->profile = profile;
    if (chain)
      j->blend = ((const zs_chain *)instruction->data)->blend;
    else if (profile == ZS_CHAIN_EXTREMUM)
      j->blend = (zs_blend){.side = is_union ? ZS_BLEND_UNION : ZS_BLEND_INTERSECTION};
    else
      j->blend = *(const zs_blend *)instruction->data;
    return true;
  }
  return false;
}

static bool same_joint(const joint *a, const joint *b)
{
  return a->profile == b->profile && !memcmp(&a->blend, &b->blend, sizeof a->blend);
}

bool zs_joints_equal(const zs_instruction *a, const zs_instruction *b)
{
  joint j, k;
  if (joint_of(a, &j))
    return joint_of(b, &k) && same_joint(&j, &k);
  return zs_instruction_same_operation(a, b);
}

/* ---- Forming chains --------------------------------------------------------------- */

static const uint32_t NONE = UINT32_MAX;

typedef struct former {
  zs_instruction *instructions;
  uint32_t *uses;  /* by instruction, by those that the result needs */
  uint32_t *slots; /* joints of the chain at hand, from its end */
  zs_link *links;  /* of the same, from its end */
  uint32_t slot_count, link_count;
  uint32_t links_placed; /* of all chains */
  const zs_instruction *first; /* a primitive of the same: the coordinates of all */
  bool root;                   /* they are the frame's */
  zs_arena *arena;
} former;

static void count_uses(former *w, uint32_t result)
{
  w->uses[result] = 1;
  for (uint32_t i = result + 1; i-- > ZS_COORDINATES;)
    for (unsigned k = 0; w->uses[i] && k < w->instructions[i].operation->arity; k++)
      w->uses[w->instructions[i].in[k]]++;
}

/* Take a value as a further link.  False when it cannot be one. */
static bool take_link(former *w, uint32_t value)
{
  const zs_operation *negate = zs_scalar_operation(ZS_FUNCTION_NEGATE, ZS_FORM_REGISTERS);
  const zs_instruction *instruction = &w->instructions[value];
  if (value < ZS_COORDINATES || w->uses[value] != 1)
    return false;
  const bool negated = instruction->operation == negate;
  if (negated) {
    value = instruction->in[0];
    instruction = &w->instructions[value];
  }
  zs_primitive_shape shape;
  bool root;
  if (value < ZS_COORDINATES || w->uses[value] != 1 ||
      !zs_primitive_of(instruction->operation, &shape, &root))
    return false;
  if (!w->link_count) {
    w->first = instruction;
    w->root = root;
  } else if (root != w->root || memcmp(instruction->in, w->first->in, sizeof instruction->in)) {
    return false;
  }
  w->links[w->link_count++] =
    (zs_link){.primitive = instruction->data, .shape = shape, .negated = negated};
  return true;
}

/* Follow the same joint down from `last`.  Returns the value that the chain goes on
 * from; NONE when it begins with its first link. */
static uint32_t follow(former *w, uint32_t last, const joint *j)
{
  uint32_t at = last;
  w->slot_count = w->link_count = 0;
  for (;;) {
    const uint32_t *in = w->instructions[at].in;
    uint32_t next = in[0];
    if (!take_link(w, in[1])) {
      next = in[1];
      if (!take_link(w, in[0]))
        return at;
    }
    w->slots[w->slot_count++] = at;
    joint inner;
    const bool goes_on = next >= ZS_COORDINATES && w->uses[next] == 1 &&
                         joint_of(&w->instructions[next], &inner) && same_joint(j, &inner);
    if (!goes_on)
      return take_link(w, next) ? NONE : next;
    at = next;
  }
}

static zs_chain *new_chain(zs_arena *arena, uint32_t count)
{
  return zs_arena_reserve(arena, 1, sizeof(zs_chain) + (size_t)count * sizeof(zs_link));
}

static unsigned link_inputs(const former *w, const zs_link *link)
{
  return zs_primitive_operation(link->shape, w->root)->used(link->primitive);
}

enum { ANY_INPUTS = 1 << 3 /* more than three inputs' bits make */ };

/* Put a chain of the links that use the given inputs in the place of a joint. */
static bool place_chain(former *w, uint32_t slot, const joint *j, uint32_t so_far,
                        unsigned inputs)
{
  zs_chain *chain = new_chain(w->arena, w->link_count);
  if (!chain)
    return false;
  *chain = (zs_chain){.blend = j->blend, .root = w->root, .begins = so_far == NONE};
  for (uint32_t i = w->link_count; i-- > 0;)
    if (inputs == ANY_INPUTS || link_inputs(w, &w->links[i]) == inputs)
      chain->links[chain->count++] = w->links[i];
  const uint32_t *at = w->first->in;
  const zs_instruction made = {.operation = &operations[j->profile],
                               .data = chain,
                               .ordinal = w->links_placed,
                               .in = {at[0], at[1], at[2], so_far == NONE ? at[0] : so_far}};
  w->instructions[slot] = made;
  w->links_placed += chain->count;
  return true;
}

/* The order of a maximum is of no account: links that use the same inputs make a
 * chain of their own, which is computed less often where the others do not vary. */
static bool place_chains(former *w, const joint *j, uint32_t so_far)
{
  uint32_t counts[ANY_INPUTS] = {0}, groups = 0;
  for (uint32_t i = 0; i < w->link_count; i++)
    groups += !counts[link_inputs(w, &w->links[i])]++;
  if (j->profile != ZS_CHAIN_EXTREMUM || groups > w->slot_count)
    return place_chain(w, w->slots[0], j, so_far, ANY_INPUTS);
  for (unsigned inputs = 0; inputs < ANY_INPUTS; inputs++) {
    if (!counts[inputs])
      continue;
    const uint32_t slot = w->slots[--groups];
    if (!place_chain(w, slot, j, so_far, inputs))
      return false;
    so_far = slot;
  }
  return true;
}

static bool form(former *w, uint32_t result)
{
  enum { LEAST = 2 /* links that are worth a chain */ };
  count_uses(w, result);
  for (uint32_t i = result + 1; i-- > ZS_COORDINATES;) {
    joint j;
    if (!w->uses[i] || !joint_of(&w->instructions[i], &j))
      continue;
    const uint32_t so_far = follow(w, i, &j);
    if (w->link_count < LEAST)
      continue;
    for (uint32_t k = 0; k < w->slot_count; k++)
      w->uses[w->slots[k]] = 0;
    if (!place_chains(w, &j, so_far))
      return false;
  }
  return true;
}

bool zs_chains_form(zs_instruction *instructions, uint32_t result, zs_arena *arena,
                    uint32_t *links)
{
  const size_t count = (size_t)result + 1;
  former w = {.instructions = instructions, .arena = arena};
  w.uses = calloc(count, sizeof *w.uses);
  w.slots = malloc(count * sizeof *w.slots);
  w.links = malloc(count * sizeof *w.links);
  const bool done = w.uses && w.slots && w.links && form(&w, result);
  *links = w.links_placed;
  free(w.uses);
  free(w.slots);
  free(w.links);
  return done;
}

const zs_chain *zs_chain_shortened(const zs_chain *chain, bool begins, const uint32_t *links,
                                   uint32_t count, zs_arena *arena)
{
  zs_chain *shorter = new_chain(arena, count);
  if (!shorter)
    return NULL;
  *shorter =
    (zs_chain){.blend = chain->blend, .root = chain->root, .begins = begins, .count = count};
  for (uint32_t i = 0; i < count; i++)
    shorter->links[i] = chain->links[links[i]];
  return shorter;
}
