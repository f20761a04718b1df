#include "nodes/probe.h"

/* Emitting the children in the program proper reports what is wrong with them. */
static bool probe(zs_compiler *compiler, const zs_node *node, const double *points, size_t count,
                  double *values, zs_diag *quiet)
{
  zs_field *field = zs_children_field(compiler, node, quiet);
  zs_eval *eval = field ? zs_eval_new(field, quiet) : NULL;
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
