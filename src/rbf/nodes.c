#include "rbf/nodes.h"

#include <math.h>

static const double PI = 3.14159265358979323846;

size_t zs_nodes_count(const zs_nodes *nodes)
{
  size_t count = 1;
  for (unsigned k = 0; k < nodes->dimension; k++)
    count *= nodes->side[k];
  return count;
}

void zs_nodes_points(const zs_nodes *nodes, double *points)
{
  const size_t count = zs_nodes_count(nodes);
  for (size_t i = 0; i < count; i++) {
    size_t rest = i;
    for (unsigned k = nodes->dimension; k-- > 0;) {
      const unsigned j = (unsigned)(rest % nodes->side[k]);
      rest /= nodes->side[k];
      points[i * nodes->dimension + k] =
        0.5 * (nodes->lo[k] + nodes->hi[k]) +
        0.5 * (nodes->hi[k] - nodes->lo[k]) * cos(PI * (j + 0.5) / nodes->side[k]);
    }
  }
}

bool zs_nodes_match(const zs_nodes *a, const zs_nodes *b)
{
  size_t most = 1;
  for (unsigned k = 0; k < a->dimension; k++)
    most *= a->side[k] > b->side[k] ? a->side[k] : b->side[k];
  return most <= ZS_NODES_ROOM;
}

const zs_nodes_kernels *zs_nodes_select(void)
{
  static const zs_nodes_kernels *const table[ZS_ISA_COUNT] = ZS_VARIANTS(zs_nodes_table, );
  return table[zs_isa_select()];
}
