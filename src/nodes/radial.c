#include "nodes/radial.h"

#include "nodes/variational.h"

zs_fit_info zs_radial_info(const zs_node *node, const zs_rbf *rbf)
{
  return (zs_fit_info){.element = node->kind->name,
                       .kernel = zs_rbf_kernel_names[rbf->radial.kernel],
                       .method = rbf->method,
                       .line = node->place.line,
                       .dimension = rbf->dimension,
                       .constraints = rbf->count,
                       .seconds = rbf->seconds,
                       .residual = rbf->residual,
                       .bytes = rbf->bytes};
}

zs_value zs_radial_sum_emit(zs_compiler *compiler, const zs_rbf *rbf, const zs_coordinates *at)
{
  zs_rbf_sum *sum = zs_rbf_sum_new(rbf, rbf->dimension, NULL, ZS_RBF_ACCURACY,
                                   zs_compiler_control(compiler), zs_compiler_diag(compiler));
  if (!sum || !zs_compiler_keep(compiler, sum, zs_rbf_sum_free))
    return zs_emit_constant(compiler, 0);
  return zs_variational_sum_emit(compiler, sum, rbf, at);
}

zs_value zs_radial_emit(zs_compiler *compiler, const zs_node *node, const zs_rbf_problem *problem,
                        const zs_coordinates *at)
{
  zs_rbf *rbf = zs_rbf_fit(problem, zs_compiler_control(compiler), &node->place,
                           zs_compiler_diag(compiler));
  if (!rbf)
    return zs_emit_constant(compiler, 0);
  const zs_value value = zs_radial_sum_emit(compiler, rbf, at);
  const zs_fit_info info = zs_radial_info(node, rbf);
  zs_compiler_add_fit(compiler, &info);
  zs_rbf_free(rbf);
  return value;
}
