#include "nodes/probe.h"

/* Emitting the children in the program proper reports what is wrong with them. */
static bool probe(zs_compiler *compiler, const zs_node *node, const double *points, size_t count,
                  double *values, zs_diag *quiet)
{
  zs_compiler *own =
    zs_compiler_new(zs_compiler_control(compiler), zs_compiler_cache(compiler), quiet);
  if (!own)
    return false;
  const zs_coordinates root = zs_coordinates_root();
  const zs_value f = zs_children_emit(own, node, &root);
  zs_field *field = zs_compiler_finish(own, f, 1);
  zs_eval *eval = field && !quiet->errors ? zs_eval_new(field, quiet) : NULL;
  zs_field_unref(field);
  if (!eval)
    return false;
  for (size_t i = 0; i < count; i++)
    values[i] = zs_eval_point(eval, points + 3 * i);
  zs_eval_free(eval);
  return true;
}

bool zs_probe_children(zs_compiler *compiler, const zs_node *node, const double *points,
                       size_t count, double *values)
{
  zs_diag quiet = {0};
  if (probe(compiler, node, points, count, values, &quiet))
    return true;
  if (!zs_compiler_diag(compiler)->errors)
    zs_fail_memory(zs_compiler_diag(compiler));
  return false;
}
