/* Operations: the vocabulary of compiled programs.
 *
 * A program is a list of instructions in evaluation order, each one operation
 * on values computed before it.  An operation works on blocks of points in
 * single precision, on blocks with gradients, on sixteen boxes at once, and on
 * one point in double precision, which is its definition. */
#ifndef ZS_OPERATION_H
#define ZS_OPERATION_H

#include "base/arena.h"
#include "zeroset.h"

#include <stdint.h>

enum {
  ZS_BLOCK = 256,          /* points of a block */
  ZS_LANES = 16,           /* boxes evaluated together */
  ZS_MAXIMUM_INPUTS = 4,
  ZS_MAXIMUM_SIBLINGS = 2, /* of an instruction, besides itself */
  ZS_MAXIMUM_CHOICES = 3   /* inputs that an operation chooses among */
};

/* Coordinates that programs are evaluated in.  A point with local coordinates
 * (u, v, w) lies at
 *   origin + u axes[0] + v axes[1] + w axes[2]        or, in perspective,
 *   origin + w (axes[2] + u axes[0] + v axes[1]).
 * The origin is near the points, so that single precision suffices. */
typedef struct zs_frame {
  double origin[3];
  double axes[3][3];
  bool parallel; /* the axes are those of the scene */
  bool perspective;
} zs_frame;

/* The frame of axis-parallel coordinates about an origin (NULL: zero). */
zs_frame zs_frame_at(const double origin[3]);

/* Intervals, one per lane; lo > hi never; NaN in both means unknown. */
typedef struct zs_bounds {
  _Alignas(64) float lo[ZS_LANES];
  _Alignas(64) float hi[ZS_LANES];
} zs_bounds;

/* Where a value matters when all that counts is whether f >= 0: from -below to
 * above.  Beyond, any other value on the same side does as well.  A value that
 * matters everywhere has infinities. */
typedef struct zs_demand {
  float below, above;
} zs_demand;

/* Whether nothing but the sign matters. */
static inline bool zs_demand_is_sign(zs_demand demand)
{
  return demand.below == 0 && demand.above == 0;
}

/* What an operation with a choice found out, one bit per lane. */
typedef struct zs_choice {
  uint16_t copy[ZS_MAXIMUM_CHOICES]; /* the result equals input i, to the bit */
  uint16_t sign[ZS_MAXIMUM_CHOICES]; /* input i does as well, where only the sign of f counts */
  uint16_t simpler;                  /* for_sign of the operation does as well there */
} zs_choice;

/* What one instruction works on: `n` points, a multiple of ZS_LANES.  Pointers
 * are aligned to 64 bytes; the output may be one of the inputs.  There may be more than
 * ZS_BLOCK points, but not with gradients, nor for operations with a regional form.
 * With gradients every pointer leads to four rows of ZS_BLOCK floats: the value, and
 * its derivatives by the frame's three coordinates. */
typedef struct zs_block_arguments {
  const void *data;
  const zs_frame *frame;
  unsigned n;
  const float *in[ZS_MAXIMUM_INPUTS];
  float *out;
  /* Results of siblings of the instruction, to be found along with its own. */
  unsigned siblings;
  struct {
    const void *data;
    float *out;
  } sibling[ZS_MAXIMUM_SIBLINGS];
} zs_block_arguments;

typedef struct zs_bounds_arguments {
  const void *data;
  const zs_frame *frame;
  const zs_bounds *in[ZS_MAXIMUM_INPUTS];
  zs_bounds *out;
  zs_choice *choice; /* zeroed; NULL for operations without a choice */
  zs_choice *links;  /* of a chain: by link, between the value so far and the link */
  zs_demand demand;  /* of the result */
  unsigned siblings; /* as of a block */
  struct {
    const void *data;
    zs_bounds *out;
  } sibling[ZS_MAXIMUM_SIBLINGS];
} zs_bounds_arguments;

/* Hot loops, built once per instruction set. */
typedef struct zs_kernels {
  void (*value)(const zs_block_arguments *arguments);
  void (*gradient)(const zs_block_arguments *arguments);
  void (*bounds)(const zs_bounds_arguments *arguments);
} zs_kernels;

typedef enum zs_isa_kind {
  ZS_ISA_BASELINE,
  ZS_ISA_AVX2,
  ZS_ISA_AVX512,
  ZS_ISA_COUNT
} zs_isa_kind;

/* The instruction set to use: what the machine has, or less when ZEROSET_ISA
 * asks for less. */
zs_isa_kind zs_isa_select(void);

typedef struct zs_operation {
  const char *name; /* in listings */
  unsigned arity;
  bool choice; /* bounds can fill in a zs_choice */
  bool chain;  /* `data` is a zs_chain (chain.h), whose links are the choices */
  /* Inputs, one bit each, of an operation of two that make the result the other one, to the bit,
   * where they are 0. */
  unsigned neutral;
  /* Inputs, one bit each, that make results differ by more than the sign of 0 when their own 0
   * changes its sign. */
  unsigned signed_zeros;
  bool even; /* the result is the same to the bit whatever the sign of a 0 */
  /* Where the inputs matter if the result matters where `result` says; NULL:
   * everywhere. */
  zs_demand (*demand)(const void *data, zs_demand result);
  /* Bytes of `data` that decide equality of two instructions; 0 when the
   * pointer does, or when there is no data. */
  size_t data_size;
  /* An operation of the same inputs, without data, that has the same sign where these are
   * numbers: it stands in for this one where only signs count.  Optional. */
  const struct zs_operation *(*for_sign)(const void *data);
  /* The inputs that the value depends on, one bit each, in a frame whose axes are
   * those of the scene; NULL: all of them. */
  unsigned (*used)(const void *data);
  const zs_kernels *const *kernels; /* [ZS_ISA_COUNT] */
  /* The definition, in double precision at one point. */
  double (*reference)(const void *data, const double in[ZS_MAXIMUM_INPUTS]);
  /* Cheaper data valid while the inputs stay within the given intervals, from
   * `arena`, or `data` itself when it would not be much cheaper.  Optional. */
  const void *(*restricted)(const void *data, const float lo[ZS_MAXIMUM_INPUTS],
                            const float hi[ZS_MAXIMUM_INPUTS], zs_arena *arena);
  /* Whether instructions with such data, next to each other and with the same inputs, are
   * cheaper together: the components of one vector, as a rule.  They are siblings then, and the
   * kernels find all their results when they are called for the first.  Optional, for operations
   * that use all their inputs. */
  bool (*are_siblings)(const void *data, const void *other);
  /* With both: `data` restricted as a sibling was, to the same box. */
  const void *(*restricted_like)(const void *data, const void *sibling,
                                 const void *restricted_sibling, zs_arena *arena);
} zs_operation;

/* Declare the kernel tables of an operation family in NAME.kernel.c, which is
 * compiled once per instruction set with ZS_ISA defined to a suffix:
 *   in the header:      ZS_DECLARE_KERNELS(zs_polygon_kernels)
 *   in NAME.kernel.c:   const zs_kernels ZS_KERNELS(zs_polygon_kernels) = {value, gradient, bounds};
 *   in NAME.c:          ZS_DEFINE_KERNEL_TABLE(zs_polygon_kernels)
 *                       .kernels = zs_polygon_kernels_table */
#define ZS_PASTE_(a, b) a##_##b
#define ZS_PASTE(a, b) ZS_PASTE_(a, b)
#define ZS_KERNELS(name) ZS_PASTE(name, ZS_ISA)
#define ZS_DECLARE_KERNELS(name) ZS_DECLARE_VARIANTS(zs_kernels, name)
#define ZS_DEFINE_KERNEL_TABLE(name) \
  static const zs_kernels *const name##_table[ZS_ISA_COUNT] = ZS_VARIANTS(name, );

/* The same for anything that a *.kernel.c defines: a declaration, and a list of
 * addresses by instruction set; `member` picks one of an array. */
#if defined ZS_WITH_X86_KERNELS
#define ZS_DECLARE_VARIANTS(type, name) \
  extern const type name##_baseline, name##_avx2, name##_avx512;
#define ZS_VARIANTS(name, member) \
  {&name##_baseline member, &name##_avx2 member, &name##_avx512 member}
#else
#define ZS_DECLARE_VARIANTS(type, name) extern const type name##_baseline;
#define ZS_VARIANTS(name, member) \
  {&name##_baseline member, &name##_baseline member, &name##_baseline member}
#endif

#endif
