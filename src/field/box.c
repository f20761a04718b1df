/* Finding a box around f >= 0 by bounds alone. */
#include "field/compiler.h"
#include "field/field.h"

#include "base/diagnostic.h"

#include <math.h>
#include <string.h>

enum {
  LARGEST = 30,      /* solids reach no further than 2^LARGEST ... */
  SMALLEST = -30,    /* ... and are looked for down to 2^SMALLEST */
  SHELL_DEPTH = 60,  /* how often a box of a shell is halved before it counts */
  SHELL_BUDGET = 2000, /* evaluations of bounds on one shell: longer proofs fail */
  SHELL_BOXES = 56,
  TIGHTEN_DEPTH = 18,  /* how often parts are halved when fitting the box, across all axes */
  LEAST_PASSES = 3,    /* of tightening; ... */
  MOST_PASSES = 12     /* ... more while they help: far from the origin the first box is large */
};

typedef struct search {
  zs_eval *eval;
  zs_arena arena; /* regional programs */
  unsigned budget;
  unsigned axes; /* one bit each: those along which there are bounds to be found */
  /* Tightening: a box around the parts that could not be proven empty, and one outside of
   * which all are; the side of them that is being looked for. */
  double found_lo[3], found_hi[3], left_lo[3], left_hi[3];
  unsigned axis;
  bool upper;
} search;

static bool is_searched(const search *s, unsigned axis)
{
  return s->axes >> axis & 1;
}

/* The parts of a box, halved across one axis after the other. */
typedef struct parts {
  unsigned count;
  double lo[ZS_LANES][3], hi[ZS_LANES][3];
} parts;

/* Halve a box `times` times, the first time across `axis`, but not across axes along which there
 * are no bounds.  Lanes without a part repeat one. */
static void split(const search *s, const double lo[3], const double hi[3], const double middle[3],
                  int times, int axis, parts *out, zs_boxes *boxes)
{
  out->count = 1;
  memcpy(out->lo[0], lo, sizeof out->lo[0]);
  memcpy(out->hi[0], hi, sizeof out->hi[0]);
  for (int i = 0; i < times; i++) {
    const unsigned k = (unsigned)(axis + i) % 3;
    if (!is_searched(s, k))
      continue;
    for (unsigned l = 0; l < out->count; l++) {
      const unsigned upper = out->count + l;
      memcpy(out->lo[upper], out->lo[l], sizeof out->lo[l]);
      memcpy(out->hi[upper], out->hi[l], sizeof out->hi[l]);
      out->lo[upper][k] = out->hi[l][k] = (out->lo[l][k] + out->hi[l][k]) / 2;
    }
    out->count *= 2;
  }
  for (unsigned l = 0; l < ZS_LANES; l++)
    zs_boxes_set(boxes, l, out->lo[l % out->count], out->hi[l % out->count], middle);
}

/* Whether a part may move the side that is being looked for outward. */
static bool may_extend(const search *s, const double lo[3], const double hi[3])
{
  for (int k = 0; k < 3; k++)
    if (hi[k] <= s->left_lo[k] || lo[k] >= s->left_hi[k])
      return false;
  return s->upper ? hi[s->axis] > s->found_hi[s->axis] : lo[s->axis] < s->found_lo[s->axis];
}

/* Indices of parts, those nearest the side that is being looked for first. */
static void sort(const search *s, const parts *p, unsigned order[ZS_LANES])
{
  const double sign = s->upper ? -1 : 1;
  for (unsigned i = 0; i < p->count; i++) {
    unsigned n = i;
    for (; n > 0 && sign * p->lo[order[n - 1]][s->axis] > sign * p->lo[i][s->axis]; n--)
      order[n] = order[n - 1];
    order[n] = i;
  }
}

/* Extend what is found by the outermost parts of a box, halved `depth` times more of
 * TIGHTEN_DEPTH, over which f < 0 cannot be proven. */
static void collect(search *s, const zs_program *program, const double lo[3], const double hi[3],
                    int depth)
{
  enum { TIMES = 4 }; /* sixteen parts; fewer at first, so that the rest comes out even */
  parts p;
  zs_boxes boxes;
  zs_bounds f;
  unsigned order[ZS_LANES], left = 0;
  const double middle[3] = {(lo[0] + hi[0]) / 2, (lo[1] + hi[1]) / 2, (lo[2] + hi[2]) / 2};
  zs_frame frame = zs_frame_at(middle);
  const int times = depth % TIMES ? depth % TIMES : TIMES, rest = depth - times;
  split(s, lo, hi, middle, times, (TIGHTEN_DEPTH - depth) % 3, &p, &boxes);
  zs_program_bounds(s->eval, program, &frame, &boxes, &f);
  for (unsigned i = 0; i < p.count; i++)
    left |= (unsigned)(!(f.hi[i] < 0) && may_extend(s, p.lo[i], p.hi[i])) << i;
  const zs_program *programs[ZS_LANES] = {NULL};
  zs_arena_mark mark = zs_arena_mark_here(&s->arena);
  if (rest > 0)
    zs_program_restrict_lanes(s->eval, program, left, ZS_REQUEST_SIGN, &s->arena, programs);
  sort(s, &p, order);
  for (unsigned n = 0; n < p.count; n++) {
    const unsigned i = order[n];
    if (!(left >> i & 1) || !may_extend(s, p.lo[i], p.hi[i]))
      continue;
    if (rest > 0) {
      collect(s, programs[i], p.lo[i], p.hi[i], rest);
      continue;
    }
    for (int k = 0; k < 3; k++) {
      s->found_lo[k] = fmin(s->found_lo[k], p.lo[i][k]);
      s->found_hi[k] = fmax(s->found_hi[k], p.hi[i][k]);
    }
  }
  zs_arena_rewind(&s->arena, mark);
}

/* The two halves of a box across each axis: half 2k below, 2k + 1 above.  The
 * lane behind them has all of the box. */
enum { HALVES = 6 };

typedef struct halves {
  double lo[HALVES][3], hi[HALVES][3];
  float upper[HALVES]; /* bounds of f from above, INFINITY where unknown */
  bool inside;         /* f >= 0 all over one of them */
} halves;

static void bound_halves(search *s, const zs_program *program, const double lo[3],
                         const double hi[3], zs_boxes *scratch, halves *out)
{
  zs_frame frame = zs_frame_at(NULL);
  zs_bounds f;
  for (int k = 0; k < 3; k++)
    frame.origin[k] = (lo[k] + hi[k]) / 2;
  for (unsigned k = 0; k < 3; k++) {
    const float least = nextafterf((float)(lo[k] - frame.origin[k]), -INFINITY);
    const float most = nextafterf((float)(hi[k] - frame.origin[k]), INFINITY);
    const float below = nextafterf(0, -INFINITY), above = nextafterf(0, INFINITY);
    for (unsigned l = 0; l < ZS_LANES; l++) {
      scratch->axis[k].lo[l] = l == 2 * k + 1 ? below : least;
      scratch->axis[k].hi[l] = l == 2 * k ? above : most;
    }
    for (unsigned half = 0; half < HALVES; half++) {
      out->lo[half][k] = half == 2 * k + 1 ? frame.origin[k] : lo[k];
      out->hi[half][k] = half == 2 * k ? frame.origin[k] : hi[k];
    }
  }
  zs_program_bounds(s->eval, program, &frame, scratch, &f);
  out->inside = false;
  for (unsigned half = 0; half < HALVES; half++) {
    out->upper[half] = isnan(f.hi[half]) ? INFINITY : f.hi[half];
    out->inside = out->inside || f.lo[half] >= 0;
  }
}

/* The axis across which halving a box proves the most. */
static unsigned best_axis(const search *s, const halves *h, int depth)
{
  unsigned best = (unsigned)__builtin_ctz(s->axes);
  int best_proven = -1;
  float best_upper = INFINITY;
  for (unsigned i = 0; i < 3; i++) {
    unsigned k = (i + (unsigned)depth) % 3; /* take turns where nothing decides */
    if (!is_searched(s, k))
      continue;
    const float *upper = &h->upper[2 * k];
    int proven = (upper[0] < 0) + (upper[1] < 0);
    float sum = upper[0] + upper[1];
    if (proven > best_proven || (proven == best_proven && sum < best_upper)) {
      best = k;
      best_proven = proven;
      best_upper = sum;
    }
  }
  return best;
}

/* Whether f < 0 is proven over a box by halving it where that helps.  Far from
 * a twisted rod only slices thin along its axis prove anything, which an
 * octree would take too long to reach. */
static bool far_outside(search *s, const zs_program *program, const double lo[3],
                        const double hi[3], int depth, zs_boxes *scratch)
{
  halves h;
  if (s->budget == 0)
    return false;
  s->budget--;
  bound_halves(s, program, lo, hi, scratch, &h);
  if (h.inside)
    return false;
  const unsigned axis = best_axis(s, &h, depth);
  const zs_arena_mark mark = zs_arena_mark_here(&s->arena);
  bool outside = true;
  if (h.upper[2 * axis] >= 0 || h.upper[2 * axis + 1] >= 0)
    program = zs_program_restrict(s->eval, program, HALVES, ZS_REQUEST_SIGN, &s->arena);
  for (unsigned half = 2 * axis; half < 2 * axis + 2 && outside; half++)
    outside = !(h.upper[half] >= 0) ||
              (depth > 0 && far_outside(s, program, h.lo[half], h.hi[half], depth - 1, scratch));
  zs_arena_rewind(&s->arena, mark);
  return outside;
}

/* Whether f < 0 everywhere between the cubes of half sides r and 2r: boxes of
 * side r around the inner eight, as long as solids can be along axes without bounds.  Most
 * are proven sixteen at a time. */
static bool shell_outside(search *s, double r)
{
  double lo[SHELL_BOXES][3], hi[SHELL_BOXES][3];
  float f_lo[SHELL_BOXES], f_hi[SHELL_BOXES];
  unsigned count = 0;
  for (int i = 0; i < 64; i++) {
    const int at[3] = {i % 4 - 2, i / 4 % 4 - 2, i / 16 - 2};
    bool inner = true, again = false;
    for (unsigned k = 0; k < 3; k++) {
      inner = inner && (!is_searched(s, k) || at[k] == -1 || at[k] == 0);
      again = again || (!is_searched(s, k) && at[k] != 0);
    }
    for (unsigned k = 0; k < 3 && !inner && !again; k++) {
      lo[count][k] = is_searched(s, k) ? at[k] * r : -ldexp(1, LARGEST);
      hi[count][k] = is_searched(s, k) ? (at[k] + 1) * r : ldexp(1, LARGEST);
    }
    count += !inner && !again;
  }
  zs_eval_bounds(s->eval, count, (const double(*)[3])lo, (const double(*)[3])hi, f_lo, f_hi);
  s->budget = SHELL_BUDGET;
  zs_boxes scratch;
  const zs_program *program = zs_field_program(zs_eval_field(s->eval));
  for (unsigned i = 0; i < count; i++)
    if (!(f_hi[i] < 0) && !far_outside(s, program, lo[i], hi[i], SHELL_DEPTH, &scratch))
      return false;
  return true;
}

/* Whether f < 0 is proven at once everywhere between two cubes of half sides
 * 2^inner and 2^outer: in a slab beyond each face of the inner one.  Along axes without
 * bounds the cubes are as long as solids can be. */
static bool slabs_outside(search *s, int inner, int outer)
{
  const zs_frame frame = zs_frame_at(NULL);
  const float near = nextafterf(ldexpf(1, inner), 0), far = ldexpf(1, outer);
  zs_boxes slabs;
  zs_bounds f;
  for (unsigned l = 0; l < ZS_LANES; l++)
    for (unsigned k = 0; k < 3; k++) {
      const unsigned slab = l % HALVES;
      const float side = is_searched(s, k) ? far : ldexpf(1, LARGEST);
      slabs.axis[k].lo[l] = slab == 2 * k + 1 ? near : -side;
      slabs.axis[k].hi[l] = slab == 2 * k ? -near : side;
    }
  zs_program_bounds(s->eval, zs_field_program(zs_eval_field(s->eval)), &frame, &slabs, &f);
  for (unsigned l = 0; l < HALVES; l++)
    if (is_searched(s, l / 2) && !(f.hi[l] < 0))
      return false;
  return true;
}

/* The smallest cube for which slabs prove that f < 0 between it and the one of
 * half side 2^outer, as the exponent of its own half side. */
static int shrink(search *s, int outer)
{
  int proven = outer, refused = SMALLEST - 1;
  while (proven - refused > 1) {
    const int middle = (int)floor((proven + refused) / 2.0);
    if (slabs_outside(s, middle, outer))
      proven = middle;
    else
      refused = middle;
  }
  return proven;
}

/* Half the side of a cube outside of which f < 0, or INFINITY.  A few slabs prove
 * what many shells would, but for rounding errors of their large numbers: they
 * are tried again from where they have led.  Shells prove what they cannot. */
static double find_cube(search *s)
{
  int proven = LARGEST, before;
  if (!slabs_outside(s, LARGEST, LARGEST + 1) && !shell_outside(s, ldexp(1, LARGEST)))
    return INFINITY;
  do {
    before = proven;
    proven = shrink(s, before);
  } while (proven < before);
  while (proven > SMALLEST && shell_outside(s, ldexp(1, proven - 1)))
    proven--;
  return ldexp(1, proven);
}

/* Whether some side of a box has become much shorter. */
static bool shrank(const search *s, const double lo[3], const double hi[3])
{
  for (unsigned k = 0; k < 3; k++)
    if (is_searched(s, k) && s->found_hi[k] - s->found_lo[k] < 0.75 * (hi[k] - lo[k]))
      return true;
  return false;
}

/* Shrink a box to what parts of it cannot prove empty, one side after the other.  False when
 * all of it is empty. */
static bool tighten(search *s, double lo[3], double hi[3])
{
  bool helps = true;
  for (int pass = 0; pass < LEAST_PASSES || (helps && pass < MOST_PASSES); pass++) {
    memcpy(s->left_lo, lo, sizeof s->left_lo);
    memcpy(s->left_hi, hi, sizeof s->left_hi);
    for (int k = 0; k < 3; k++) {
      s->found_lo[k] = INFINITY;
      s->found_hi[k] = -INFINITY;
    }
    for (unsigned side = 0; side < 6; side++) {
      s->axis = side / 2;
      s->upper = side % 2;
      if (!is_searched(s, s->axis))
        continue;
      collect(s, zs_field_program(zs_eval_field(s->eval)), lo, hi, TIGHTEN_DEPTH);
      if (s->found_lo[0] > s->found_hi[0])
        return false;
      if (s->upper)
        s->left_hi[s->axis] = s->found_hi[s->axis];
      else
        s->left_lo[s->axis] = s->found_lo[s->axis];
    }
    helps = shrank(s, lo, hi);
    memcpy(lo, s->found_lo, sizeof s->found_lo);
    memcpy(hi, s->found_hi, sizeof s->found_hi);
  }
  return true;
}

/* The two ways a search can end without a box. */
static bool fail_unbounded(zs_diag *diag)
{
  return zs_fail(diag, ZS_ERROR_UNABLE, NULL,
                 "the solid is unbounded, or its bounds cannot be found; give a <domain>, or "
                 "bounds on the command line");
}

static bool fail_empty(zs_diag *diag)
{
  return zs_fail(diag, ZS_ERROR_UNABLE, NULL, "the solid is empty");
}

static bool find_outer(search *s, double lo[3], double hi[3])
{
  const double r = find_cube(s);
  for (unsigned k = 0; k < 3; k++) {
    hi[k] = is_searched(s, k) ? r : ldexp(1, LARGEST);
    lo[k] = -hi[k];
  }
  return isfinite(r);
}

static bool find(search *s, double lo[3], double hi[3], zs_diag *diag)
{
  if (!find_outer(s, lo, hi))
    return fail_unbounded(diag);
  return tighten(s, lo, hi) || fail_empty(diag);
}

/* A margin keeps the surface away from the box's faces. */
static void grow(double lo[3], double hi[3])
{
  const double margin = 0.01;
  double longest = 0;
  for (int k = 0; k < 3; k++)
    longest = fmax(longest, hi[k] - lo[k]);
  for (int k = 0; k < 3; k++) {
    lo[k] -= margin * longest;
    hi[k] += margin * longest;
  }
}

bool zs_field_box(zs_field *field, double lo[3], double hi[3], zs_diag *diag)
{
  if (field->has_domain) {
    memcpy(lo, field->domain_lo, sizeof field->domain_lo);
    memcpy(hi, field->domain_hi, sizeof field->domain_hi);
    return true;
  }
  search s = {.eval = zs_eval_new(field, diag), .axes = ZS_ALL_AXES};
  if (!s.eval)
    return false;
  bool found;
  if (field->has_hint) {
    memcpy(lo, field->hint_lo, sizeof field->hint_lo);
    memcpy(hi, field->hint_hi, sizeof field->hint_hi);
    found = tighten(&s, lo, hi) || fail_empty(diag);
  } else {
    found = find(&s, lo, hi, diag);
  }
  zs_eval_free(s.eval);
  zs_arena_free(&s.arena);
  if (found)
    grow(lo, hi);
  return found;
}

/* Move one side of a box inward past slabs, of up to a thirty-second of it, over which f < 0
 * is proven at once: octrees leave as much as that. */
static void trim(search *s, double lo[3], double hi[3], unsigned axis, bool upper)
{
  const double step = (hi[axis] - lo[axis]) / (32 * ZS_LANES);
  zs_frame frame = zs_frame_at(NULL);
  zs_boxes slabs;
  zs_bounds f;
  for (int k = 0; k < 3; k++)
    frame.origin[k] = (lo[k] + hi[k]) / 2;
  frame.origin[axis] = upper ? hi[axis] : lo[axis];
  for (unsigned l = 0; l < ZS_LANES; l++)
    for (unsigned k = 0; k < 3; k++) {
      const float half = nextafterf((float)((hi[k] - lo[k]) / 2), INFINITY);
      const float thick = nextafterf((float)(step * (l + 1)), INFINITY);
      const float least = nextafterf(0, -INFINITY);
      slabs.axis[k].lo[l] = k != axis ? -half : upper ? -thick : least;
      slabs.axis[k].hi[l] = k != axis ? half : upper ? -least : thick;
    }
  zs_program_bounds(s->eval, zs_field_program(zs_eval_field(s->eval)), &frame, &slabs, &f);
  unsigned proven = 0;
  while (proven < ZS_LANES && f.hi[proven] < 0)
    proven++;
  if (upper)
    hi[axis] -= step * proven;
  else
    lo[axis] += step * proven;
}

bool zs_field_extent(zs_field *field, unsigned axes, double lo[3], double hi[3])
{
  search s = {.eval = zs_eval_new(field, NULL), .axes = axes};
  if (!s.eval)
    return false;
  const bool found = find_outer(&s, lo, hi), empty = found && !tighten(&s, lo, hi);
  for (unsigned k = 0; k < 3 && found; k++) {
    if (empty)
      lo[k] = hi[k] = 0;
    if (!empty && is_searched(&s, k)) {
      trim(&s, lo, hi, k, false);
      trim(&s, lo, hi, k, true);
    }
  }
  zs_eval_free(s.eval);
  zs_arena_free(&s.arena);
  for (unsigned k = 0; k < 3; k++)
    if (!is_searched(&s, k)) {
      lo[k] = -INFINITY;
      hi[k] = INFINITY;
    }
  return found;
}

void zs_field_set_box(zs_field *field, const double lo[3], const double hi[3])
{
  field->has_domain = true;
  memcpy(field->domain_lo, lo, sizeof field->domain_lo);
  memcpy(field->domain_hi, hi, sizeof field->domain_hi);
}

void zs_field_set_hint(zs_field *field, const double lo[3], const double hi[3])
{
  field->has_hint = true;
  memcpy(field->hint_lo, lo, sizeof field->hint_lo);
  memcpy(field->hint_hi, hi, sizeof field->hint_hi);
}
