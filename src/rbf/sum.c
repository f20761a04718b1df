#include "rbf/sum.h"

#include <stdlib.h>
#include <string.h>

/* Of the unit box's side: how far a coordinate in single precision may be off.
 * Series may leave out what f changes over that distance. */
static const double RESOLUTION = 1e-7;
/* A restriction is worth having when it absorbs this part of the centres, and
 * so many: series cost as much as some centres to make and to evaluate. */
static const double WORTHWHILE = 0.25;
enum { LEAST_ABSORBED = 64 };

static double reference(const void *data, const double in[])
{
  const zs_rbf_sum *sum = data;
  double f = 0;
  if (sum->series) {
    const double x = in[0] - sum->middle[0], y = in[1] - sum->middle[1], z = in[2] - sum->middle[2];
    f = zs_series_value(sum->layout, sum->series, x, y, z);
  } else {
    double terms[10];
    zs_rbf_monomials(3, 2, in, terms);
    for (unsigned k = 0; k < 10; k++)
      f += sum->polynomial[k] * terms[k];
  }
  for (size_t j = 0; j < sum->count; j++) {
    const zs_rbf_centre *c = &sum->centres[j];
    double x = in[0] - c->x, y = in[1] - c->y, z = in[2] - c->z;
    f += c->weight * zs_rbf_phi(sum->kernel, x * x + y * y + z * z + c->lift);
  }
  return f;
}

/* The root of the mean square slope of f at some of its centres. */
static double typical_slope(const zs_rbf_sum *sum)
{
  enum { MOST = 32 };
  const double step = 1e-4;
  const size_t stride = sum->count / MOST + 1;
  double square = 0;
  size_t samples = 0;
  for (size_t j = 0; j < sum->count; j += stride, samples++) {
    const zs_rbf_centre *c = &sum->centres[j];
    for (int k = 0; k < 3; k++) {
      double lo[3] = {c->x, c->y, c->z}, hi[3] = {c->x, c->y, c->z};
      lo[k] -= step;
      hi[k] += step;
      double slope = (reference(sum, hi) - reference(sum, lo)) / (2 * step);
      square += slope * slope;
    }
  }
  return sqrt(square / (double)samples);
}

/* A centre as seen from space; `slice` has the coordinates beyond it. */
static zs_rbf_centre centre_of(const zs_rbf *rbf, const double *slice, size_t j)
{
  const double *c = rbf->centres + rbf->dimension * j;
  zs_rbf_centre centre = {c[0], c[1], rbf->dimension > 2 ? c[2] : 0, 0, rbf->weights[j]};
  for (unsigned k = 3; k < rbf->dimension; k++)
    centre.lift += (slice[k - 3] - c[k]) * (slice[k - 3] - c[k]);
  return centre;
}

/* The polynomial of a fit as one of x, y and z. */
static void slice_polynomial(const zs_rbf *rbf, const double *slice, double polynomial[10])
{
  /* Of products of 1, x, y and z, by rows. */
  static const uint8_t index[4][4] = {{0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}};
  const unsigned dimension = rbf->dimension;
  const double *c = rbf->polynomial, *end = rbf->polynomial + rbf->terms;
  /* The variables: 1 or one of the coordinates, times a number. */
  unsigned variable[ZS_RBF_MAXIMUM_DIMENSION];
  double factor[ZS_RBF_MAXIMUM_DIMENSION];
  for (unsigned k = 0; k < dimension; k++) {
    variable[k] = k < 3 ? k + 1 : 0;
    factor[k] = k < 3 ? 1 : slice[k - 3];
  }
  memset(polynomial, 0, 10 * sizeof *polynomial);
  if (c < end)
    polynomial[0] += *c++;
  for (unsigned k = 0; k < dimension && c < end; k++)
    polynomial[variable[k]] += factor[k] * *c++;
  for (unsigned i = 0; i < dimension; i++)
    for (unsigned j = i; j < dimension && c < end; j++)
      polynomial[index[variable[i]][variable[j]]] += factor[i] * factor[j] * *c++;
}

zs_rbf_sum *zs_rbf_sum_new(const zs_rbf *rbf, const double *extra, unsigned threads)
{
  double slice[ZS_RBF_MAXIMUM_DIMENSION - 3];
  for (unsigned k = 3; k < rbf->dimension; k++)
    slice[k - 3] = (extra[k - 3] - rbf->centre[k]) / rbf->size;
  zs_rbf_sum *sum = calloc(1, sizeof *sum);
  zs_rbf_centre *centres = malloc(rbf->count * sizeof *centres);
  if (!sum || !centres) {
    free(sum);
    free(centres);
    return NULL;
  }
  for (size_t j = 0; j < rbf->count; j++)
    centres[j] = centre_of(rbf, slice, j);
  sum->kernel = rbf->kernel;
  sum->count = sum->whole_count = rbf->count;
  sum->centres = centres;
  slice_polynomial(rbf, slice, sum->polynomial);
  const double slope = typical_slope(sum);
  sum->tolerance = RESOLUTION * slope;
  sum->expand = zs_series_expand_select();
  sum->layout = zs_series_layout_new(ZS_SERIES_LONG);
  sum->tree = zs_rbf_tree_new(sum, slope, threads);
  if (!sum->layout || !sum->tree) {
    zs_rbf_sum_free(sum);
    return NULL;
  }
  return sum;
}

void zs_rbf_sum_free(void *data)
{
  zs_rbf_sum *sum = data;
  if (!sum)
    return;
  zs_rbf_tree_free((zs_rbf_tree *)sum->tree);
  free((void *)sum->layout);
  free((void *)sum->centres);
  free(sum);
}

/* ---- Restriction --------------------------------------------------------------- */

/* The ball around a box. */
typedef struct ball {
  double middle[3], radius;
} ball;

static bool ball_around(const float lo[3], const float hi[3], ball *b)
{
  double square = 0;
  for (int k = 0; k < 3; k++) {
    const double half = ((double)hi[k] - (double)lo[k]) / 2;
    b->middle[k] = (double)lo[k] + half;
    square += half * half;
  }
  b->radius = sqrt(square);
  return isfinite(square);
}

/* Whether the series of a centre about the middle is good enough in the ball. */
static bool is_far(const zs_rbf_sum *sum, const ball *b, const zs_rbf_centre *c)
{
  const double x = c->x - b->middle[0], y = c->y - b->middle[1], z = c->z - b->middle[2];
  const double r = sqrt(x * x + y * y + z * z + c->lift), allowed = sum->tolerance / (double)sum->whole_count;
  if (b->radius >= 0.5 * r)
    return false;
  return fabs(c->weight) * zs_series_remainder(sum->layout, sum->kernel, r, b->radius / r) <=
         allowed;
}

/* The part of a sum that is a polynomial already, about another middle. */
static void move_series(const zs_rbf_sum *sum, const double middle[3], double *series)
{
  const zs_series_layout *layout = sum->layout;
  double by[3];
  memset(series, 0, layout->terms * sizeof *series);
  for (int k = 0; k < 3; k++)
    by[k] = middle[k] - sum->middle[k];
  if (sum->series)
    for (unsigned n = 0; n < layout->terms; n++)
      series[layout->nested[n]] = sum->series[n];
  else
    memcpy(series, sum->polynomial, sizeof sum->polynomial);
  zs_series_shift(layout, series, by, series);
}

const void *zs_rbf_sum_restricted(const void *data, const float lo[3], const float hi[3],
                                  zs_arena *arena)
{
  const zs_rbf_sum *sum = data;
  const zs_series_layout *layout = sum->layout;
  const zs_arena_mark mark = zs_arena_mark_here(arena);
  ball b;
  if (!ball_around(lo, hi, &b))
    return data;
  zs_rbf_sum *result = ZS_ARENA_NEW(arena, zs_rbf_sum, 1);
  double *nested = ZS_ARENA_NEW(arena, double, layout->terms);
  uint32_t *far = ZS_ARENA_NEW(arena, uint32_t, sum->count);
  zs_rbf_centre *near = ZS_ARENA_NEW(arena, zs_rbf_centre, sum->count);
  if (!result || !nested || !far || !near) {
    zs_arena_rewind(arena, mark);
    return data;
  }
  size_t far_count = 0, near_count = 0;
  for (size_t j = 0; j < sum->count; j++) {
    if (is_far(sum, &b, &sum->centres[j]))
      far[far_count++] = (uint32_t)j;
    else
      near[near_count++] = sum->centres[j];
  }
  if (far_count < LEAST_ABSORBED || (double)far_count < WORTHWHILE * (double)sum->count) {
    zs_arena_rewind(arena, mark);
    return data;
  }
  double series[ZS_SERIES_LONG_TERMS];
  move_series(sum, b.middle, series);
  sum->expand(layout, sum->kernel, b.middle, sum->centres, far, far_count, series);
  for (unsigned n = 0; n < layout->terms; n++)
    nested[n] = series[layout->nested[n]];
  *result = *sum;
  memcpy(result->middle, b.middle, sizeof result->middle);
  result->series = nested;
  result->centres = near;
  result->count = near_count;
  return result;
}

/* ---- Operations ------------------------------------------------------------------ */

static const zs_kernels *const kernels[ZS_RBF_KERNEL_COUNT][ZS_ISA_COUNT] = {
  ZS_VARIANTS(zs_rbf_sum_kernels, [ZS_RBF_R]), ZS_VARIANTS(zs_rbf_sum_kernels, [ZS_RBF_R3]), ZS_VARIANTS(zs_rbf_sum_kernels, [ZS_RBF_R5]), ZS_VARIANTS(zs_rbf_sum_kernels, [ZS_RBF_TPS2]), ZS_VARIANTS(zs_rbf_sum_kernels, [ZS_RBF_TPS4])};

#define OPERATION(NAME, KERNEL) \
  [KERNEL] = {.name = NAME, .arity = 3, .kernels = kernels[KERNEL], .reference = reference, \
              .restricted = zs_rbf_sum_restricted}

static const zs_operation operations[ZS_RBF_KERNEL_COUNT] = {
  OPERATION("rbf r", ZS_RBF_R),
  OPERATION("rbf r3", ZS_RBF_R3),
  OPERATION("rbf r5", ZS_RBF_R5),
  OPERATION("rbf tps2", ZS_RBF_TPS2),
  OPERATION("rbf tps4", ZS_RBF_TPS4),
};

const zs_operation *zs_rbf_sum_operation(zs_rbf_kernel kernel)
{
  return &operations[kernel];
}
