#include "rbf/kernel.h"

const char *const zs_rbf_kernel_names[] = {"r", "r3", "r5", "tps2", "tps4", "gaussian", 0};

zs_rbf_kernel zs_rbf_default_kernel(unsigned dimension)
{
  /* In even dimensions the variational kernels have logarithms; in five, r
   * would be variational too, but leaves kinks at the centres. */
  return dimension % 2 ? ZS_RBF_R3 : ZS_RBF_TPS2;
}

unsigned zs_rbf_order(zs_rbf_kernel kernel)
{
  static const unsigned order[] = {1, 2, 3, 2, 3, 0};
  return order[kernel];
}

double zs_rbf_sign(zs_rbf_kernel kernel)
{
  static const double sign[] = {-1, 1, -1, 1, -1, 1};
  return sign[kernel];
}

double zs_rbf_power(zs_rbf_kernel kernel)
{
  static const double power[] = {1, 3, 5, 2, 4, 0};
  return power[kernel];
}
