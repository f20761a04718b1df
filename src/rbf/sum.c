#include "rbf/sum.h"

#include <stdlib.h>
#include <string.h>

zs_rbf_sum *zs_rbf_sum_new(const zs_rbf *rbf, unsigned threads)
{
  zs_rbf_sum *sum = calloc(1, sizeof *sum);
  zs_rbf_centre *centres = malloc(rbf->count * sizeof *centres);
  if (!sum || !centres) {
    free(sum);
    free(centres);
    return NULL;
  }
  for (size_t j = 0; j < rbf->count; j++) {
    const double *c = rbf->centres + 3 * j;
    centres[j] = (zs_rbf_centre){c[0], c[1], c[2], rbf->weights[j]};
  }
  sum->kernel = rbf->kernel;
  sum->count = rbf->count;
  sum->centres = centres;
  memcpy(sum->polynomial, rbf->polynomial, rbf->terms * sizeof *sum->polynomial);
  sum->tree = zs_rbf_tree_new(sum->kernel, centres, sum->count, sum->polynomial, threads);
  if (!sum->tree) {
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
  zs_rbf_tree_free(sum->tree);
  free((void *)sum->centres);
  free(sum);
}

static double reference(const void *data, const double in[])
{
  const zs_rbf_sum *sum = data;
  double terms[10], f = 0;
  zs_rbf_monomials(3, 2, in, terms);
  for (unsigned k = 0; k < 10; k++)
    f += sum->polynomial[k] * terms[k];
  for (size_t j = 0; j < sum->count; j++) {
    const zs_rbf_centre *c = &sum->centres[j];
    double x = in[0] - c->x, y = in[1] - c->y, z = in[2] - c->z;
    f += c->weight * zs_rbf_phi(sum->kernel, x * x + y * y + z * z);
  }
  return f;
}

#if defined ZS_WITH_X86_KERNELS
#define TABLE(KERNEL) \
  {&zs_rbf_sum_kernels_baseline[KERNEL], &zs_rbf_sum_kernels_avx2[KERNEL], \
   &zs_rbf_sum_kernels_avx512[KERNEL]}
#else
#define TABLE(KERNEL) \
  {&zs_rbf_sum_kernels_baseline[KERNEL], &zs_rbf_sum_kernels_baseline[KERNEL], \
   &zs_rbf_sum_kernels_baseline[KERNEL]}
#endif

static const zs_kernels *const kernels[ZS_RBF_KERNEL_COUNT][ZS_ISA_COUNT] = {
  TABLE(ZS_RBF_R), TABLE(ZS_RBF_R3), TABLE(ZS_RBF_R5), TABLE(ZS_RBF_TPS2), TABLE(ZS_RBF_TPS4)};

static const zs_operation operations[ZS_RBF_KERNEL_COUNT] = {
  {.name = "rbf r", .arity = 3, .kernels = kernels[ZS_RBF_R], .reference = reference},
  {.name = "rbf r3", .arity = 3, .kernels = kernels[ZS_RBF_R3], .reference = reference},
  {.name = "rbf r5", .arity = 3, .kernels = kernels[ZS_RBF_R5], .reference = reference},
  {.name = "rbf tps2", .arity = 3, .kernels = kernels[ZS_RBF_TPS2], .reference = reference},
  {.name = "rbf tps4", .arity = 3, .kernels = kernels[ZS_RBF_TPS4], .reference = reference},
};

const zs_operation *zs_rbf_sum_operation(zs_rbf_kernel kernel)
{
  return &operations[kernel];
}
