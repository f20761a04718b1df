/* Direct radial sums.  Compiled once per instruction set.
 *
 * Some targets stay in registers while the sources of a tile, which fits the
 * first-level cache, stream past.  Kernel and dimension are constants inside. */
#include "rbf/phi.h"
#include "rbf/product.h"

#include <string.h>

enum {
  VECTORS = 4, /* accumulators, to hide latencies */
  TARGETS = VECTORS * ZS_WIDTH,
  TILE = 512, /* sources: 12 to 24 KB */
  MOST = 5    /* coordinates */
};

/* Some targets, coordinate by coordinate; idle lanes repeat the last one. */
static inline ZS_ALWAYS void gather(unsigned dimension, const double *targets, size_t count,
                                    zs_vector point[MOST][VECTORS])
{
  for (unsigned k = 0; k < dimension; k++) {
    double row[TARGETS];
    for (unsigned i = 0; i < TARGETS; i++)
      row[i] = targets[(i < count ? i : count - 1) * dimension + k];
    memcpy(point[k], row, sizeof row);
  }
}

/* phi of a source for some targets. */
static inline ZS_ALWAYS void evaluate(zs_rbf_radial radial, unsigned dimension,
                                      zs_vector point[MOST][VECTORS], const double *source,
                                      zs_vector phi[VECTORS])
{
  for (unsigned v = 0; v < VECTORS; v++) {
    zs_vector square = {0};
    for (unsigned k = 0; k < dimension; k++) {
      const zs_vector difference = point[k][v] - source[k];
      square += difference * difference;
    }
    phi[v] = zs_vector_phi(radial, square);
  }
}

/* What a product is: sums by targets, or by targets and sources, or the matrix. */
typedef enum form { SUMS, BOTH_SUMS, MATRIX } form;

static inline ZS_ALWAYS double total(zs_vector a)
{
  double sum = a[0];
  for (unsigned l = 1; l < ZS_WIDTH; l++)
    sum += a[l];
  return sum;
}

/* A tile of sources for some targets.  What these add to the sums of each source is left in
 * parts, one in each place of a vector of `across`, to be added up once for all targets. */
static inline ZS_ALWAYS void visit(zs_rbf_radial radial, unsigned dimension, form form,
                                   const zs_rbf_product *p, size_t target, size_t source,
                                   size_t sources, zs_vector *across)
{
  zs_vector point[MOST][VECTORS], phi[VECTORS], sum[VECTORS] = {{0}}, back[VECTORS];
  double sums[TARGETS] = {0};
  const size_t left = p->target_count - target, targets = left < TARGETS ? left : TARGETS;
  gather(dimension, p->targets + target * dimension, targets, point);
  if (form == BOTH_SUMS) {
    memcpy(sums, p->target_weights + target, targets * sizeof *sums);
    memcpy(back, sums, sizeof back);
  }
  for (size_t j = source; j < source + sources; j++) {
    const double weight = p->weights[j];
    evaluate(radial, dimension, point, p->sources + j * dimension, phi);
    for (unsigned v = 0; form == BOTH_SUMS && v < VECTORS; v++)
      across[j - source] += back[v] * phi[v];
    for (unsigned v = 0; v < VECTORS; v++)
      phi[v] *= weight;
    if (form == MATRIX)
      memcpy(p->matrix + j * p->stride + target, phi, targets * sizeof *p->matrix);
    else
      for (unsigned v = 0; v < VECTORS; v++)
        sum[v] += phi[v];
  }
  if (form == MATRIX)
    return;
  memcpy(sums, sum, sizeof sums);
  for (size_t i = 0; i < targets; i++)
    p->sums[target + i] += sums[i];
}

static inline ZS_ALWAYS void visit_all(zs_rbf_radial radial, unsigned dimension, form form,
                                       const zs_rbf_product *p)
{
  for (size_t source = 0; source < p->source_count; source += TILE) {
    const size_t left = p->source_count - source, sources = left < TILE ? left : TILE;
    zs_vector across[form == BOTH_SUMS ? TILE : 1];
    memset(across, 0, form == BOTH_SUMS ? sources * sizeof *across : 0);
    for (size_t target = 0; target < p->target_count; target += TARGETS)
      visit(radial, dimension, form, p, target, source, sources, across);
    for (size_t j = 0; form == BOTH_SUMS && j < sources; j++)
      p->source_sums[source + j] += total(across[j]);
  }
}

static inline ZS_ALWAYS void multiply(zs_rbf_radial radial, unsigned dimension,
                                      const zs_rbf_product *p)
{
  if (p->matrix)
    visit_all(radial, dimension, MATRIX, p);
  else if (p->source_sums)
    visit_all(radial, dimension, BOTH_SUMS, p);
  else
    visit_all(radial, dimension, SUMS, p);
}

#define DEFINE_PRODUCT(KERNEL) \
  static void KERNEL##_product(const zs_rbf_product *p) \
  { \
    const zs_rbf_radial radial = {ZS_RBF_##KERNEL, p->radial.rate}; \
    switch (p->dimension) { \
    case 2: \
      multiply(radial, 2, p); \
      break; \
    case 3: \
      multiply(radial, 3, p); \
      break; \
    case 4: \
      multiply(radial, 4, p); \
      break; \
    default: \
      multiply(radial, 5, p); \
    } \
  }
DEFINE_PRODUCT(R)
DEFINE_PRODUCT(R3)
DEFINE_PRODUCT(R5)
DEFINE_PRODUCT(TPS2)
DEFINE_PRODUCT(TPS4)
DEFINE_PRODUCT(GAUSSIAN)

void ZS_PASTE(zs_rbf_multiply, ZS_ISA)(const zs_rbf_product *product)
{
  static zs_rbf_multiply_kernel *const table[ZS_RBF_KERNEL_COUNT] = {
    [ZS_RBF_R] = R_product,       [ZS_RBF_R3] = R3_product,     [ZS_RBF_R5] = R5_product,
    [ZS_RBF_TPS2] = TPS2_product, [ZS_RBF_TPS4] = TPS4_product,
    [ZS_RBF_GAUSSIAN] = GAUSSIAN_product,
  };
  table[product->radial.kernel](product);
}
