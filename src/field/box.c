/* Finding a box around f >= 0 by bounds alone. */
#include "field/field.h"

#include "base/diagnostic.h"

#include <math.h>
#include <string.h>

enum {
  LARGEST = 30,   /* solids reach no further than 2^LARGEST ... */
  SMALLEST = -30, /* ... and are looked for down to 2^SMALLEST */
  SHELL_DEPTH = 3, /* how often a box of a shell is split before it counts */
  TIGHTEN_DEPTH = 6, /* octree levels when fitting the box */
  TIGHTEN_PASSES = 3
};

typedef struct search {
  zs_eval *eval;
  const zs_program *program;
} search;

/* Whether f < 0 is proven over a box; splits it `depth` times if need be.
 * `found` collects what could not be proven, when not NULL. */
static bool outside(search *s, const double lo[3], const double hi[3], int depth, zs_boxes *scratch,
                    double found_lo[3], double found_hi[3])
{
  zs_frame frame = zs_frame_at(NULL);
  zs_bounds f;
  double part_lo[8][3], part_hi[8][3];
  for (int k = 0; k < 3; k++)
    frame.origin[k] = (lo[k] + hi[k]) / 2;
  for (unsigned l = 0; l < ZS_LANES; l++) {
    unsigned part = l % 8;
    for (int k = 0; k < 3; k++) {
      bool upper = part >> k & 1;
      part_lo[part][k] = upper ? frame.origin[k] : lo[k];
      part_hi[part][k] = upper ? hi[k] : frame.origin[k];
      scratch->axis[k].lo[l] = nextafterf((float)(part_lo[part][k] - frame.origin[k]), -INFINITY);
      scratch->axis[k].hi[l] = nextafterf((float)(part_hi[part][k] - frame.origin[k]), INFINITY);
    }
  }
  zs_program_bounds(s->eval, s->program, &frame, scratch, &f);
  bool all = true;
  for (unsigned part = 0; part < 8; part++) {
    if (f.hi[part] < 0)
      continue;
    if (depth > 0) {
      if (!outside(s, part_lo[part], part_hi[part], depth - 1, scratch, found_lo, found_hi)) {
        all = false;
        if (!found_lo)
          return false;
      }
      continue;
    }
    all = false;
    if (!found_lo)
      return false;
    for (int k = 0; k < 3; k++) {
      found_lo[k] = fmin(found_lo[k], part_lo[part][k]);
      found_hi[k] = fmax(found_hi[k], part_hi[part][k]);
    }
  }
  return all;
}

/* Whether f < 0 everywhere between the cubes of half sides r and 2r: 56 boxes
 * of side r around the inner eight. */
static bool shell_outside(search *s, double r)
{
  zs_boxes scratch;
  int at[3];
  for (at[2] = -2; at[2] < 2; at[2]++)
    for (at[1] = -2; at[1] < 2; at[1]++)
      for (at[0] = -2; at[0] < 2; at[0]++) {
        bool inner = true;
        double lo[3], hi[3];
        for (int k = 0; k < 3; k++) {
          inner = inner && (at[k] == -1 || at[k] == 0);
          lo[k] = at[k] * r;
          hi[k] = (at[k] + 1) * r;
        }
        if (!inner && !outside(s, lo, hi, SHELL_DEPTH, &scratch, NULL, NULL))
          return false;
      }
  return true;
}

/* Shrink a box to what an octree cannot prove empty, with a small margin.
 * False when all of it is empty. */
static bool tighten(search *s, double lo[3], double hi[3])
{
  for (int pass = 0; pass < TIGHTEN_PASSES; pass++) {
    zs_boxes scratch;
    double found_lo[3] = {INFINITY, INFINITY, INFINITY};
    double found_hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    if (outside(s, lo, hi, TIGHTEN_DEPTH - 1, &scratch, found_lo, found_hi))
      return false;
    memcpy(lo, found_lo, sizeof found_lo);
    memcpy(hi, found_hi, sizeof found_hi);
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

static bool find(search *s, double lo[3], double hi[3], zs_diag *diag)
{
  double r = ldexp(1, LARGEST);
  if (!shell_outside(s, r))
    return fail_unbounded(diag);
  while (r > ldexp(1, SMALLEST) && shell_outside(s, r / 2))
    r /= 2;
  for (int k = 0; k < 3; k++) {
    lo[k] = -r;
    hi[k] = r;
  }
  if (!tighten(s, lo, hi))
    return fail_empty(diag);
  return true;
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
  search s = {.eval = zs_eval_new(field, diag), .program = field->program};
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
  if (found)
    grow(lo, hi);
  return found;
}
