/* Displacements of the plane that carry points along given paths: thin plates whose
 * centres move.
 *
 * While s goes from 0 to 1, anchors go from p_i to q_i along their paths m_i(s).  At every
 * s the displacement is the thin plate spline through the anchors where they are then, so
 * that they are met always (Cohen-Or, Levin, Solomovici, "Three-dimensional distance field
 * metamorphosis", 1998, equations 16 and 17).  Its weights are smooth functions of s; they
 * are solved for at Chebyshev nodes of as many intervals of s as it takes, and
 * interpolated between these to about 1e-9 of the largest.
 *
 * Few anchors, or anchors that lie nearly on a line at some s, do not say how the plane is
 * to be displaced across it.  Then eight more centres around them follow the similarity
 * that fits the anchors best: one anchor makes a translation, two a similarity. */
#ifndef ZS_RBF_FLOW_H
#define ZS_RBF_FLOW_H

#include "field/operation.h"

enum {
  ZS_FLOW_MOST = 500,  /* anchors */
  ZS_FLOW_ORDER = 12,  /* Chebyshev terms of an interval */
  ZS_FLOW_HELPERS = 8
};

/* Where an anchor goes: straight from the first of its points (x, y pairs) to the last, or
 * when there are more through the others too, in equal times from one to the next. */
typedef struct zs_flow_path {
  size_t count; /* at least 2 */
  const double *points;
} zs_flow_path;

/* Where an anchor on a path is at s, from 0 to 1. */
void zs_flow_path_place(const zs_flow_path *path, double s, double at[2]);

/* Where the anchors are, and what is interpolated there. */
typedef enum zs_flow_way {
  ZS_FLOW_COME,     /* on their paths: how far they have come, by s */
  ZS_FLOW_TO_GO,    /* on their paths: how far they have still to go, by 1 - s; on straight
                       paths the same, q_i - p_i */
  ZS_FLOW_AT_START, /* at p_i, whatever s is: q_i - p_i */
  ZS_FLOW_AT_END    /* at q_i: q_i - p_i */
} zs_flow_way;

/* The largest that a channel and its first two derivatives by s become. */
typedef struct zs_flow_reach {
  double value, first, second;
} zs_flow_reach;

/* Immutable.  Coordinates and displacements are in units of `size` about `middle`. */
typedef struct zs_flow {
  double middle[2], size;
  size_t centres; /* anchors and helpers */
  /* Functions of s: for both components weights by centre and the polynomial's three
   * coefficients, then the centres' x and their y. */
  size_t channels;
  size_t intervals;
  double *ends;  /* of the intervals: intervals + 1 numbers from 0 to 1 */
  double *table; /* by interval, ZS_FLOW_ORDER coefficients of all channels */
  /* Coefficients that are not next to nothing, in all intervals: of weights and polynomials,
   * and of places. */
  int used[2];
  zs_flow_reach *reach; /* by channel */
} zs_flow;

typedef enum zs_flow_result {
  ZS_FLOW_DONE,
  ZS_FLOW_MEET,  /* two anchors come to the same place at the same time */
  ZS_FLOW_MEMORY
} zs_flow_result;

/* Up to ZS_FLOW_MOST paths, at least one; equal ones count once.  `meeting`, unless NULL,
 * becomes the indices of two paths that come nearest to each other, and where s is then,
 * when the result is ZS_FLOW_MEET. */
typedef struct zs_flow_meeting {
  size_t path[2];
  double s;
} zs_flow_meeting;
zs_flow_result zs_flow_new(zs_flow **flow, const zs_flow_path *paths, size_t count,
                           zs_flow_way way, zs_flow_meeting *meeting);
void zs_flow_free(void *flow);

/* A flow within a box: every channel a polynomial of (s - middle) / half. */
typedef struct zs_flow_local {
  float middle, half;
  int weights, places; /* coefficients, of weights and the plane's polynomial, and of places */
  /* By powers: the polynomials' three of both components, then of each centre both weights, x
   * and y. */
  const float *table;
} zs_flow_local;

/* One component of the displacement, as data of the operation.  Both of one flow are
 * siblings. */
typedef struct zs_flow_part {
  const zs_flow *flow;
  const zs_flow_local *local; /* NULL: nothing is known of where points are */
  int component;
  int unused; /* keeps the bytes that decide equality defined */
} zs_flow_part;

/* The displacement at (x, y, s), s between 0 and 1, and unless `slope` is NULL its
 * derivatives. */
double zs_flow_value(const zs_flow *flow, int component, const double at[3], double slope[3]);

/* Inputs x, y and s, in the flow's units; s is taken to the nearest number from 0 to 1. */
extern const zs_operation zs_flow_operation;

/* ---- For the kernels ------------------------------------------------------ */

/* The channels at some s, and their derivatives by s; weights and polynomials by component. */
typedef struct zs_flow_state {
  double weight[2][ZS_FLOW_MOST + ZS_FLOW_HELPERS], polynomial[2][3];
  double x[ZS_FLOW_MOST + ZS_FLOW_HELPERS], y[ZS_FLOW_MOST + ZS_FLOW_HELPERS];
} zs_flow_state;
void zs_flow_at(const zs_flow *flow, double s, zs_flow_state *value, zs_flow_state *slope);

/* Which of the intervals holds s, which is between 0 and 1. */
size_t zs_flow_interval(const zs_flow *flow, double s);

/* The part for a box, or `data` itself where that would not be shorter, or single precision
 * not enough; and the other component's when one is known. */
const void *zs_flow_restricted(const void *data, const float lo[], const float hi[],
                               zs_arena *arena);
const void *zs_flow_restricted_like(const void *data, const void *sibling,
                                    const void *restricted_sibling, zs_arena *arena);

/* Where the results of an instruction and its siblings go, by component; NULL: not wanted. */
#define ZS_FLOW_OUTPUTS(type, name, arguments) \
  type *name[2] = {NULL, NULL}; \
  name[((const zs_flow_part *)(arguments)->data)->component] = (arguments)->out; \
  for (unsigned sibling_ = 0; sibling_ < (arguments)->siblings; sibling_++) \
    name[((const zs_flow_part *)(arguments)->sibling[sibling_].data)->component] = \
      (arguments)->sibling[sibling_].out

ZS_DECLARE_KERNELS(zs_flow_kernels)
ZS_DECLARE_KERNELS(zs_flow_local_kernels) /* values and bounds of parts for a box */

#endif
