#include "output/polygonize_roots.h"

#include <math.h>

/* Calls of fminf and fmaxf cost more than what they do: no NaN gets here. */
static float smaller(float a, float b)
{
  return a < b ? a : b;
}

static float larger(float a, float b)
{
  return a > b ? a : b;
}

/* How far from its middle a bracket may be looked at in the first round: so that
 * halving this in every round is no slower than bisection by a few rounds. */
static float first_reach(float tolerance)
{
  return ldexpf(tolerance, (int)ceilf(log2f(0.5f / tolerance)) + 3);
}

void zs_roots_add(zs_roots *r, const float inner[3], const float outer[3], float f_inner,
                  float f_outer, float tolerance, float least)
{
  unsigned i = r->pending++;
  float square = 0;
  for (int k = 0; k < 3; k++) {
    r->item[ZS_ROOT_FROM + k][i] = inner[k];
    r->item[ZS_ROOT_ALONG + k][i] = outer[k] - inner[k];
    square += (outer[k] - inner[k]) * (outer[k] - inner[k]);
  }
  float length = sqrtf(square);
  r->item[ZS_ROOT_LOW][i] = 0;
  r->item[ZS_ROOT_WIDTH][i] = 1;
  r->item[ZS_ROOT_F_LOW][i] = f_inner;
  r->item[ZS_ROOT_F_HIGH][i] = f_outer;
  r->item[ZS_ROOT_SIDE][i] = 0;
  r->item[ZS_ROOT_TOLERANCE][i] = smaller(0.25f, tolerance / 2 / length);
  r->item[ZS_ROOT_REACH][i] = first_reach(r->item[ZS_ROOT_TOLERANCE][i]);
  r->item[ZS_ROOT_LEAST][i] = smaller(0.25f, least / length);
  r->line[i] = (uint16_t)r->count++;
}

/* Where the straight line between the ends of a bracket is 0; the middle when
 * the values are no help. */
static float line_root(const zs_roots *r, unsigned i)
{
  float part = r->item[ZS_ROOT_F_LOW][i] / (r->item[ZS_ROOT_F_LOW][i] - r->item[ZS_ROOT_F_HIGH][i]);
  return r->item[ZS_ROOT_LOW][i] +
         r->item[ZS_ROOT_WIDTH][i] * (part >= 0 && part <= 1 ? part : 0.5f);
}

/* The next place to look at: the straight line's root, a little beyond so that
 * the bracket closes from the other side too, but never so far from the middle
 * that bisection would have been quicker by then.  (I. Oliveira, R. Takahashi:
 * "An enhancement of the bisection method average performance preserving minmax
 * optimality", 2020, with its projection step.) */
static float next_place(const zs_roots *r, unsigned i)
{
  const float low = r->item[ZS_ROOT_LOW][i], width = r->item[ZS_ROOT_WIDTH][i];
  const float tolerance = r->item[ZS_ROOT_TOLERANCE][i];
  float t = line_root(r, i) + r->item[ZS_ROOT_SIDE][i] * 0.9f * tolerance;
  float middle = low + width / 2;
  float reach = larger(0, r->item[ZS_ROOT_REACH][i] - width / 2);
  t = smaller(larger(t, middle - reach), middle + reach);
  float gap = smaller(tolerance / 4, width / 2);
  return smaller(larger(t, low + gap), low + width - gap);
}

static void narrow(zs_roots *r, unsigned i, float f)
{
  float t = r->t[i], high = r->item[ZS_ROOT_LOW][i] + r->item[ZS_ROOT_WIDTH][i];
  r->item[ZS_ROOT_REACH][i] /= 2;
  if (f >= 0) {
    r->item[ZS_ROOT_LOW][i] = t;
    r->item[ZS_ROOT_WIDTH][i] = high - t;
    r->item[ZS_ROOT_F_LOW][i] = f;
    r->item[ZS_ROOT_SIDE][i] = 1;
  } else {
    r->item[ZS_ROOT_WIDTH][i] = t - r->item[ZS_ROOT_LOW][i];
    r->item[ZS_ROOT_F_HIGH][i] = f;
    r->item[ZS_ROOT_SIDE][i] = -1;
  }
}

/* A line is solved; the last pending one takes its place. */
static void finish(zs_roots *r, unsigned i)
{
  float least = r->item[ZS_ROOT_LEAST][i], t = smaller(larger(line_root(r, i), least), 1 - least);
  float inside = larger(0, t - 4 * r->item[ZS_ROOT_TOLERANCE][i]);
  for (int k = 0; k < 3; k++) {
    float from = r->item[ZS_ROOT_FROM + k][i], along = r->item[ZS_ROOT_ALONG + k][i];
    r->found[k][r->line[i]] = from + t * along;
    r->inside[k][r->line[i]] = from + inside * along;
  }
  unsigned last = --r->pending;
  for (int k = 0; k < ZS_ROOT_ITEMS; k++)
    r->item[k][i] = r->item[k][last];
  r->line[i] = r->line[last];
}

/* Brackets close for any f, continuous or not: every round narrows them, and
 * once their reach is used up they are halved. */
uint64_t zs_roots_solve(zs_roots *r, zs_eval *eval, const zs_program *program,
                        const zs_frame *frame)
{
  uint64_t evaluations = 0;
  while (r->pending) {
    for (unsigned i = 0; i < r->pending; i++) {
      r->t[i] = next_place(r, i);
      for (int k = 0; k < 3; k++)
        r->at[k][i] = r->item[ZS_ROOT_FROM + k][i] + r->t[i] * r->item[ZS_ROOT_ALONG + k][i];
    }
    zs_program_values(eval, program, frame, r->pending, r->at[0], r->at[1], r->at[2], r->f);
    evaluations += r->pending;
    for (unsigned i = 0; i < r->pending; i++)
      narrow(r, i, r->f[i]);
    for (unsigned i = r->pending; i-- > 0;)
      if (r->item[ZS_ROOT_WIDTH][i] <= 2 * r->item[ZS_ROOT_TOLERANCE][i])
        finish(r, i);
  }
  return evaluations;
}
