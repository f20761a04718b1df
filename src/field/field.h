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
  bool plain; /* choices alone make programs shorter: compiled for scalar operations alone */
  bool has_domain, has_hint;
  double domain_lo[3], domain_hi[3];
  double hint_lo[3], hint_hi[3];
  zs_kept *kept;
  zs_fit_info *fits;
  size_t fit_count;
  zs_correspondence *correspondences;
  size_t correspondence_count;
};

/* Whether two instructions do the same, if perhaps to different inputs. */
bool zs_instruction_same_operation(const zs_instruction *a, const zs_instruction *b);

/* What bounds have found out about a program. */
typedef struct zs_findings {
  const zs_choice *choices, *links; /* by ordinal */
  /* By instruction: lanes in which its value is nothing but 0.  There it becomes the constant;
   * should it be -0 for some points, it loses its sign, so that there are none where this
   * matters.  Or NULL. */
  const uint16_t *zeros;
} zs_findings;

/* Shortening works on sixteen lanes together: one pass from the result back
 * lists, for every lane, the instructions that it needs and what becomes of them. */
typedef struct zs_shortener {
  uint16_t *needed;  /* by instruction: lanes that need it */
  uint32_t *renamed; /* by instruction: its new index in the lane at hand */
  uint32_t *own;     /* links of the chain at hand */
  uint32_t *steps[ZS_LANES]; /* program.c; by descending instruction */
  uint32_t step_count[ZS_LANES];
  uint32_t kept[ZS_LANES];   /* how many of the steps keep their instruction */
  uint32_t *links[ZS_LANES]; /* links kept of the chains among them, in the same order */
  uint32_t link_count[ZS_LANES];
  uint64_t hash[ZS_LANES];
  const void **data; /* by ordinal: of instructions with a regional form, in the lane at hand */
} zs_shortener;

/* For programs of up to that many instructions, links of chains, and instructions with a
 * regional form.  False when memory is out; zs_shortener_free in any case. */
bool zs_shortener_init(zs_shortener *shortener, uint32_t instructions, uint32_t links,
                       uint32_t regional);
void zs_shortener_free(zs_shortener *shortener);

/* List what the lanes (one bit each) need of a program whose last instruction
 * is the result; without `findings` (NULL) all that the result depends on. */
void zs_shortener_list(zs_shortener *shortener, const zs_instruction *instructions, uint32_t count,
                       const zs_findings *findings, unsigned lanes, zs_request request);

/* Whether two listed lanes need the same. */
bool zs_shortener_equal(const zs_shortener *shortener, unsigned lane, unsigned other);

/* Find the data that serve one listed lane, in `arena`, given the inputs' intervals of
 * instructions with a regional form, by ordinal.  Whether any is not the program's own. */
bool zs_shortener_restrict(zs_shortener *shortener, const zs_instruction *instructions,
                           unsigned lane, const zs_bounds (*regional)[ZS_MAXIMUM_INPUTS],
                           zs_arena *arena);

/* The program of one listed lane, in `arena`; NULL when memory is out.  With `restricted` it
 * has the data that were found for it just before. */
const zs_program *zs_shortener_emit(zs_shortener *shortener, const zs_instruction *instructions,
                                    unsigned lane, zs_request request, bool restricted,
                                    zs_arena *arena);

/* Find where every instruction's result matters if all that matters of the last one's is
 * its sign.  Where fewer users are left in regional programs, it still matters no further. */
void zs_find_demands(zs_instruction *instructions, uint32_t count);

/* Find for every instruction whether the sign of its 0 can change the last one's result, but for
 * the sign of a 0. */
void zs_find_signed_zeros(zs_instruction *instructions, uint32_t count);

enum {
  ZS_EVAL_ROWS = 4,    /* of a register: value and three derivatives */
  ZS_MAXIMUM_KEPT = 64 /* values kept over the layers of a lattice */
};

struct zs_eval {
  zs_field *field;
  zs_isa_kind isa;
  float *storage;  /* register_count x ZS_EVAL_ROWS x ZS_BLOCK */
  float **values;  /* where each register is in blocks without gradients ... */
  float **gradients; /* ... and with them */
  zs_bounds *bounds; /* by register */
  zs_choice *choices;
  zs_choice *links; /* of chains, by ordinal */
  uint16_t *zeros;  /* zs_findings */
  zs_bounds (*regional)[ZS_MAXIMUM_INPUTS];
  double *points; /* by instruction: results at one point */
  zs_shortener shortener;
  /* zs_eval_restrict */
  const zs_program *programs[ZS_MAXIMUM_REGIONS + 1];
  zs_arena_mark marks[ZS_MAXIMUM_REGIONS];
  unsigned regions;
  zs_arena arena;
  float *block; /* 3 coordinates and a result of ZS_EVAL_ROWS blocks each, or 3 of one
                   block each and ZS_EVAL_ROWS rows of results */
  float *kept;  /* zs_program_lattice: ZS_MAXIMUM_KEPT blocks */
  uint32_t *index; /* scatter.c: of the points of a chunk */
};

/* As zs_program_restrict_lanes, but operations with a regional form keep their data: values
 * stay what they are, to the bit. */
void zs_program_restrict_choices(zs_eval *eval, const zs_program *program, unsigned lanes,
                                 zs_request request, zs_arena *arena,
                                 const zs_program *result[ZS_LANES]);

/* ---- Points all over the place (scatter.c) -------------------------------------- */

/* Any number of points in local coordinates, and where to put f, or f and its gradient.  A
 * result may stand where a coordinate is. */
typedef struct zs_points {
  const float *at[3];
  float *result[ZS_EVAL_ROWS];
  unsigned rows; /* 1 or ZS_EVAL_ROWS */
} zs_points;

/* f at points first + index[0 .. count - 1], or first .. first + count - 1 without an index; by
 * the program as it is (eval.c). */
void zs_points_evaluate(zs_eval *eval, const zs_program *program, const zs_frame *frame,
                        const zs_points *points, size_t first, const uint32_t *index, size_t count);

/* Whether grouping so many points is likely to be faster than taking them as they come. */
bool zs_scatter_pays(const zs_program *program, size_t count);

/* The same results, to the bit, as from the program itself; ZS_SCATTER_CHUNK points are grouped
 * at a time. */
enum { ZS_SCATTER_CHUNK = 1 << 16 };
void zs_scatter_evaluate(zs_eval *eval, const zs_program *program, const zs_frame *frame,
                         const zs_points *points, size_t count);

/* Round n up to whole lanes, repeating the last point, so that no lane meets
 * stale numbers. */
unsigned zs_pad_points(unsigned n, float *x, float *y, float *z);

#endif
