/* Inside a field: shared by the files of this room only. */
#ifndef ZS_FIELD_H
#define ZS_FIELD_H

#include "field/program.h"

#include <stdatomic.h>

/* Something to release with the field. */
typedef struct zs_kept {
  struct zs_kept *next;
  void *data;
  void (*release)(void *data);
} zs_kept;

struct zs_field {
  atomic_uint references;
  zs_arena arena; /* holds the program and all data without a release */
  const zs_program *program;
  size_t nodes;
  bool has_domain, has_hint;
  double domain_lo[3], domain_hi[3];
  double hint_lo[3], hint_hi[3];
  zs_kept *kept;
  zs_fit_info *fits;
  size_t fit_count;
};

/* What a restriction needs to know of the intervals of one lane; all members
 * NULL keeps every instruction. */
typedef struct zs_trace {
  const zs_choice *choices;                        /* by ordinal */
  const zs_bounds (*regional)[ZS_MAXIMUM_INPUTS];  /* by ordinal: the inputs' intervals */
  unsigned lane;
} zs_trace;

/* Working memory of zs_program_shorten, for programs of up to `count`. */
typedef struct zs_shortener {
  uint8_t *demand;
  uint32_t *renamed;
} zs_shortener;

/* The part of a list of instructions that its last one needs, as a program in
 * `arena`.  What the trace proves idle is left out; registers are assigned
 * anew.  NULL when memory is out, or when more than `limit` instructions
 * would be left. */
const zs_program *zs_program_shorten(const zs_instruction *instructions, uint32_t count,
                                     const zs_trace *trace, zs_request request, uint32_t limit,
                                     const zs_shortener *work, zs_arena *arena);

/* The instruction set to use: what the machine has, or less when ZEROSET_ISA
 * asks for less. */
zs_isa_kind zs_isa_select(void);

#endif
