/* Programs and their evaluation: what back ends work with. */
#ifndef ZS_PROGRAM_H
#define ZS_PROGRAM_H

#include "field/operation.h"

#include <float.h>
#include <math.h>
#include <string.h>

typedef struct zs_instruction {
  const zs_operation *operation;
  const void *data;
  uint32_t in[ZS_MAXIMUM_INPUTS]; /* earlier instructions */
  /* Among the instructions with a choice, or those with a regional form; a chain's is that
   * of its first link among those of all chains. */
  uint32_t ordinal;
  zs_demand demand; /* where the result matters */
  bool signed_zero; /* whether the sign of a result of 0 does, as that of divisors */
} zs_instruction;

/* The first three instructions of every program stand for the coordinates: the
 * caller's arrays are their registers. */
enum { ZS_COORDINATES = 3 };

/* Whether two instructions that stand next to each other are siblings (operation.h). */
static inline bool zs_instructions_are_siblings(const zs_instruction *a, const zs_instruction *b)
{
  return a->operation->are_siblings && a->operation == b->operation &&
         !memcmp(a->in, b->in, sizeof a->in) && a->operation->are_siblings(a->data, b->data);
}

/* Immutable.  A regional program is valid for points of its box only, and for
 * requests no stronger than its own. */
typedef struct zs_program {
  const zs_instruction *instructions; /* the last one is the result */
  const uint32_t *registers;          /* the register each one writes */
  uint32_t count, register_count, choice_count, regional_count, link_count;
  zs_request request;
} zs_program;

/* How many of the instructions behind one are its siblings. */
static inline unsigned zs_program_siblings(const zs_program *program, uint32_t index)
{
  const zs_instruction *first = &program->instructions[index];
  const uint32_t behind = program->count - 1 - index;
  unsigned count = 0;
  while (count < ZS_MAXIMUM_SIBLINGS && count < behind &&
         zs_instructions_are_siblings(first, first + count + 1))
    count++;
  return count;
}

/* How many steps a program takes for a block: instructions, and links of chains. */
static inline uint32_t zs_program_length(const zs_program *program)
{
  return program->count - ZS_COORDINATES + program->link_count;
}

/* How many choices a program has that bounds can make. */
static inline uint32_t zs_program_choices(const zs_program *program)
{
  return program->choice_count + program->link_count;
}

/* Sixteen boxes in a frame's local coordinates, closed. */
typedef struct zs_boxes {
  zs_bounds axis[3];
} zs_boxes;

/* Set a lane's box, relative to an origin, by a little more than what rounding moves it and points
 * in it by. */
static inline void zs_boxes_set(zs_boxes *boxes, unsigned lane, const double lo[3],
                                const double hi[3], const double origin[3])
{
  for (int k = 0; k < 3; k++) {
    const double from = lo[k] - origin[k], to = hi[k] - origin[k];
    boxes->axis[k].lo[lane] = (float)(from - (2 * FLT_EPSILON * fabs(from) + FLT_MIN));
    boxes->axis[k].hi[lane] = (float)(to + (2 * FLT_EPSILON * fabs(to) + FLT_MIN));
  }
}

/* The whole program of a field. */
const zs_program *zs_field_program(const zs_field *field);

/* The field an evaluator works for. */
zs_field *zs_eval_field(const zs_eval *eval);

/* The instruction set whose kernels an evaluator runs. */
zs_isa_kind zs_eval_isa(const zs_eval *eval);

/* f at n <= ZS_BLOCK points in local coordinates.  Input and output arrays are
 * aligned to 64 bytes and have room for ZS_BLOCK floats; up to the next
 * multiple of ZS_LANES they are read, written and may be changed. */
void zs_program_values(zs_eval *eval, const zs_program *program, const zs_frame *frame, unsigned n,
                       float *x, float *y, float *z, float *f);

/* f and its gradient at n <= ZS_BLOCK points: `gradient`
 * has 4 rows of ZS_BLOCK floats: f, df/dx, df/dy, df/dz.  Only for
 * axis-parallel frames (zs_frame_at). */
void zs_program_gradients(zs_eval *eval, const zs_program *program, const zs_frame *frame,
                          unsigned n, float *x, float *y, float *z, float *gradient);

/* f at one point of the scene in double precision. */
double zs_program_point(zs_eval *eval, const zs_program *program, const double point[3]);

/* Enclosures of f over sixteen boxes; the evaluator remembers the choices and
 * the intervals until its next call. */
void zs_program_bounds(zs_eval *eval, const zs_program *program, const zs_frame *frame,
                       const zs_boxes *boxes, zs_bounds *result);

/* Programs for boxes of the latest zs_program_bounds call with the same program:
 * result[l] for every lane l whose bit is set in `lanes`.  Lanes that need the
 * same share one; where shortening would not pay, or memory is out, the result
 * is `program` itself.  New programs live in `arena`. */
void zs_program_restrict_lanes(zs_eval *eval, const zs_program *program, unsigned lanes,
                               zs_request request, zs_arena *arena,
                               const zs_program *result[ZS_LANES]);

/* The same for one lane. */
const zs_program *zs_program_restrict(zs_eval *eval, const zs_program *program, unsigned lane,
                                      zs_request request, zs_arena *arena);

/* ---- Lattices ---------------------------------------------------------- */

enum { ZS_LATTICE_SIDE = 16 };

/* Points (at[0][i], at[1][j], at[2][k]) in a frame, in ascending order. */
typedef struct zs_lattice {
  zs_frame frame;
  unsigned count[3]; /* 1 .. ZS_LATTICE_SIDE */
  float at[3][ZS_LATTICE_SIDE];
} zs_lattice;

/* f at the points of a lattice: f[(k * ZS_LATTICE_SIDE + j) * ZS_LATTICE_SIDE + i].
 * For signs, points whose sign bounds know get a bound of f in its place.  With
 * `prune` false every point is evaluated with the whole program.  Returns how
 * many points were evaluated. */
unsigned zs_program_lattice(zs_eval *eval, const zs_program *program, const zs_lattice *lattice,
                            zs_request request, bool prune, float *f);

/* ---- The walk ---------------------------------------------------------- */

/* A hierarchical walk over a lattice of bricks: bounds decide what they can,
 * and every brick that is left gets the shortest program that serves it. */
typedef struct zs_walk {
  zs_field *field;
  double lo[3];       /* corner of brick (0, 0, 0) */
  double size[3];     /* of one brick */
  double margin[3];   /* programs and bounds serve bricks that are so much larger on every side */
  uint32_t count[3];  /* bricks per axis, at least 1 */
  zs_request request;
  const zs_control *control; /* may be NULL */
  const char *stage;         /* for progress */
  double progress_from, progress_to; /* the part of 0..1 that this walk is */
  void *visitor;
  /* NULL, or one arena per thread: programs then last as long as these. */
  zs_arena *programs;
  /* f has one sign over the closed bricks lo <= i < hi: inside when f >= 0
   * everywhere, outside when f < 0 everywhere.  NULL: not wanted.  Called from
   * many threads, for disjoint bricks; never with control->brute. */
  void (*uniform)(void *visitor, const uint32_t lo[3], const uint32_t hi[3], bool inside);
  /* Brick `index` may hold the surface.  Called from many threads, at most once
   * per brick.  `eval` is the thread's own; without `programs`, `program` ends
   * with the call. */
  void (*brick)(void *visitor, unsigned thread, const uint32_t index[3], zs_eval *eval,
                const zs_program *program);
} zs_walk;

/* False after reporting: out of memory or cancelled. */
bool zs_walk_run(const zs_walk *walk, zs_diag *diag);

/* Threads that a job will use: control->threads, as far as there may be so many, or one per
 * processor.  OpenMP keeps what it knows of them on the stack, which 100 000 overflow. */
enum { ZS_MOST_THREADS = 1024 };
unsigned zs_control_threads(const zs_control *control);

/* Whether a job may take so much working memory at once: control->memory_limit, if there is one. */
bool zs_control_allows(const zs_control *control, double bytes);

/* Seconds of a monotonic clock. */
double zs_seconds(void);

#endif
