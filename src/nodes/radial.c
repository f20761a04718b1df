#include "nodes/radial.h"

#include "nodes/variational.h"

static void describe(zs_compiler *compiler, const zs_node *node, const zs_rbf *rbf)
{
  const zs_fit_info info = {.element = node->kind->name,
                            .kernel = zs_rbf_kernel_names[rbf->radial.kernel],
                            .method = rbf->method,
                            .line = node->place.line,
                            .dimension = rbf->dimension,
                            .constraints = rbf->count,
                            .seconds = rbf->seconds,
                            .residual = rbf->residual,
                            .bytes = rbf->bytes};
  zs_compiler_add_fit(compiler, &info);
}

static zs_value sum_of(zs_compiler *compiler, const zs_node *node, const zs_rbf *rbf,
                       const zs_coordinates *at)
{
  zs_diag *diag = zs_compiler_diag(compiler);
  zs_rbf_sum *sum = zs_rbf_sum_new(rbf, rbf->dimension, NULL, ZS_RBF_ACCURACY,
                                   zs_compiler_control(compiler), diag);
  if (!sum)
    return zs_emit_constant(compiler, 0);
  if (!zs_compiler_keep(compiler, sum, zs_rbf_sum_free)) {
    zs_fail_memory(diag);
    return zs_emit_constant(compiler, 0);
  }
  describe(compiler, node, rbf);
  return zs_variational_sum_emit(compiler, sum, rbf, at);
}

zs_value zs_radial_emit(zs_compiler *compiler, const zs_node *node, const zs_rbf_problem *problem,
                        const zs_coordinates *at)
{
  zs_rbf *rbf = zs_rbf_fit(problem, zs_compiler_control(compiler), &node->place,
                           zs_compiler_diag(compiler));
  if (!rbf)
    return zs_emit_constant(compiler, 0);
  const zs_value value = sum_of(compiler, node, rbf, at);
  zs_rbf_free(rbf);
  return value;
}
