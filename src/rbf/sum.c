#include "rbf/sum.h"

#include <stdlib.h>
#include <string.h>

enum { FEW = 48 }; /* centres that are added up in less time than their cell is found */

static double reference(const void *data, const double in[])
{
  const zs_rbf_sum *sum = data;
  return sum->restricted ? zs_rbf_cells_value(sum->cells, &sum->terms, in)
                         : zs_rbf_terms_value(&sum->terms, in);
}

/* A centre as seen from space; `slice` has the coordinates beyond it. */
static zs_rbf_centre centre_of(const zs_rbf *rbf, unsigned space, const double *slice, size_t j)
{
  const double *c = rbf->centres + rbf->dimension * j;
  zs_rbf_centre centre = {c[0], c[1], space > 2 ? c[2] : 0, 0, rbf->weights[j]};
  for (unsigned k = space; k < rbf->dimension; k++)
    centre.lift += (slice[k - space] - c[k]) * (slice[k - space] - c[k]);
  return centre;
}

/* The polynomial of a fit as one of x, y and z. */
static void slice_polynomial(const zs_rbf *rbf, unsigned space, const double *slice,
                             double polynomial[10])
{
  /* Of products of 1, x, y and z, by rows. */
  static const uint8_t index[4][4] = {{0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}};
  const unsigned dimension = rbf->dimension;
  const double *c = rbf->polynomial, *end = rbf->polynomial + rbf->terms;
  /* The variables: 1 or one of the coordinates, times a number. */
  unsigned variable[ZS_RBF_MAXIMUM_DIMENSION];
  double factor[ZS_RBF_MAXIMUM_DIMENSION];
  for (unsigned k = 0; k < dimension; k++) {
    variable[k] = k < space ? k + 1 : 0;
    factor[k] = k < space ? 1 : slice[k - space];
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

/* What cells may be off by: a part of what f varies over some of the centres, but
 * not less than what rounding makes of the sum. */
static double tolerance_of(const zs_rbf_terms *terms, double accuracy)
{
  const size_t stride = terms->count / (ZS_BLOCK - 1) + 1;
  double point[3][ZS_BLOCK], f[ZS_BLOCK], squares = 0, lo = INFINITY, hi = -INFINITY;
  unsigned n = 0;
  for (size_t j = 0; j < terms->count; j += stride, n++) {
    point[0][n] = terms->centres[j].x;
    point[1][n] = terms->centres[j].y;
    point[2][n] = terms->centres[j].z;
  }
  zs_rbf_terms_values(terms, n, point, f);
  for (unsigned i = 0; i < n; i++) {
    lo = fmin(lo, f[i]);
    hi = fmax(hi, f[i]);
  }
  for (size_t j = 0; j < terms->count; j++)
    squares += terms->centres[j].weight * terms->centres[j].weight;
  return fmax(accuracy * (hi - lo), 1e-16 * (sqrt(squares) + fmax(fabs(lo), fabs(hi))));
}

zs_rbf_sum *zs_rbf_sum_new(const zs_rbf *rbf, unsigned space, const double *extra,
                           double accuracy, const zs_control *control, zs_diag *diag)
{
  double slice[ZS_RBF_MAXIMUM_DIMENSION - 2];
  for (unsigned k = space; k < rbf->dimension; k++)
    slice[k - space] = (extra[k - space] - rbf->centre[k]) / rbf->size;
  zs_rbf_sum *sum = calloc(1, sizeof *sum), *inside = calloc(1, sizeof *inside);
  zs_rbf_centre *centres = malloc(rbf->count * sizeof *centres);
  if (!sum || !inside || !centres) {
    free(sum);
    free(inside);
    free(centres);
    zs_fail_memory(diag);
    return NULL;
  }
  for (size_t j = 0; j < rbf->count; j++)
    centres[j] = centre_of(rbf, space, slice, j);
  *sum = (zs_rbf_sum){.kernel = rbf->radial.kernel, .inside = inside};
  sum->terms = (zs_rbf_terms){
    .radial = rbf->radial, .flat = space == 2, .count = rbf->count, .centres = centres};
  slice_polynomial(rbf, space, slice, sum->terms.polynomial);
  sum->tolerance = tolerance_of(&sum->terms, accuracy);
  sum->cells = zs_rbf_cells_new(&sum->terms, sum->tolerance, control, diag);
  if (sum->cells)
    sum->tree = zs_rbf_tree_new(sum, control, diag);
  if (!sum->tree) {
    zs_rbf_sum_free(sum);
    return NULL;
  }
  *inside = *sum;
  inside->restricted = true;
  return sum;
}

void zs_rbf_sum_free(void *data)
{
  zs_rbf_sum *sum = data;
  if (!sum)
    return;
  zs_rbf_tree_free((zs_rbf_tree *)sum->tree);
  zs_rbf_cells_free((zs_rbf_cells *)sum->cells);
  free(sum->terms.centres);
  free((void *)sum->inside);
  free(sum);
}

const void *zs_rbf_sum_restricted(const void *data, const float lo[3], const float hi[3],
                                  zs_arena *arena)
{
  (void)arena;
  const zs_rbf_sum *sum = data;
  if (sum->terms.count <= FEW)
    return data;
  const double half = sum->cells->half;
  for (int k = 0; k < 3; k++)
    if (!((double)lo[k] >= -half && (double)hi[k] <= half))
      return data;
  return sum->restricted ? sum : sum->inside;
}

/* ---- Operations ------------------------------------------------------------------ */

static const zs_kernels *const kernels[ZS_RBF_KERNEL_COUNT][ZS_ISA_COUNT] = {
  ZS_VARIANTS(zs_rbf_sum_kernels, [ZS_RBF_R]), ZS_VARIANTS(zs_rbf_sum_kernels, [ZS_RBF_R3]),
  ZS_VARIANTS(zs_rbf_sum_kernels, [ZS_RBF_R5]), ZS_VARIANTS(zs_rbf_sum_kernels, [ZS_RBF_TPS2]),
  ZS_VARIANTS(zs_rbf_sum_kernels, [ZS_RBF_TPS4]),
  ZS_VARIANTS(zs_rbf_sum_kernels, [ZS_RBF_GAUSSIAN])};

#define OPERATION(NAME, KERNEL) \
  [KERNEL] = {.name = NAME, .arity = 3, .kernels = kernels[KERNEL], .reference = reference, \
              .restricted = zs_rbf_sum_restricted}

static const zs_operation operations[ZS_RBF_KERNEL_COUNT] = {
  OPERATION("rbf r", ZS_RBF_R),
  OPERATION("rbf r3", ZS_RBF_R3),
  OPERATION("rbf r5", ZS_RBF_R5),
  OPERATION("rbf tps2", ZS_RBF_TPS2),
  OPERATION("rbf tps4", ZS_RBF_TPS4),
  OPERATION("rbf gaussian", ZS_RBF_GAUSSIAN),
};

const zs_operation *zs_rbf_sum_operation(zs_rbf_kernel kernel)
{
  return &operations[kernel];
}
