/* Pairs of <variational>: two shapes carried to half between them, so that what
 * belongs together meets, and the shapes between them carried back. */
#include "nodes/variational.h"

#include "nodes/radial.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct pair {
  double from[3], to[3];
};

static const zs_attribute attributes[] = {
  ZS_POINT(struct pair, from, "from", NULL, "a point of the first shape"),
  ZS_POINT(struct pair, to, "to", NULL, "the point of the second shape that it becomes"),
};

const zs_kind zs_variational_pair = {
  .name = "pair",
  .family = ZS_FAMILY_PART,
  .summary = "a point of the first of two shapes, and the one of the second that it becomes",
  .doc = "Both shapes are carried to half between the points of each pair, and fitted there; what "
         "lies between them is carried back in proportion. Elsewhere the displacement is what "
         "bends least: give pairs on all sides of a solid, or it may become flat. z of 2D shapes "
         "is left out.",
  .source = "Turk, O'Brien, \"Shape transformation using variational implicit functions\" (1999), "
            "appendix",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct pair),
  .children = ZS_CHILDREN_NONE,
};

void zs_variational_warp_clear(zs_variational_warp *warp)
{
  for (int shape = 0; shape < 2; shape++)
    for (int k = 0; k < 3; k++)
      zs_rbf_free(warp->half[shape][k]);
  free(warp->pairs);
  *warp = (zs_variational_warp){0};
}

/* The kernels of thin plates, in the plane and in space.  Others that are smoother
 * at the pairs grow faster beyond them, and fold space over. */
static zs_rbf_kernel kernel_for(unsigned dimension)
{
  return dimension == 2 ? ZS_RBF_TPS2 : ZS_RBF_R;
}

static size_t count_pairs(const zs_node *node)
{
  size_t count = 0;
  for (size_t i = 0; i < node->child_count; i++)
    count += node->children[i]->kind == &zs_variational_pair;
  return count;
}

static void gather(zs_variational_warp *warp, const zs_node *node)
{
  for (size_t i = 0; i < node->child_count; i++) {
    if (node->children[i]->kind != &zs_variational_pair)
      continue;
    const struct pair *p = node->children[i]->parameters;
    memcpy(warp->pairs + 6 * warp->pair_count, p->from, sizeof p->from);
    memcpy(warp->pairs + 6 * warp->pair_count++ + 3, p->to, sizeof p->to);
  }
}

/* Fit one component of half the way from one shape to the other.  `positions` and
 * `ways` have room for all pairs. */
static zs_rbf *fit_half(const zs_variational_warp *warp, const zs_node *node, int shape,
                        unsigned component, double *positions, double *ways,
                        const zs_control *control, zs_diag *diag)
{
  for (size_t i = 0; i < warp->pair_count; i++) {
    const double *from = warp->pairs + 6 * i + (shape ? 3 : 0);
    const double *to = warp->pairs + 6 * i + (shape ? 0 : 3);
    memcpy(positions + i * warp->dimension, from, warp->dimension * sizeof *positions);
    ways[i] = (to[component] - from[component]) / 2;
  }
  const zs_rbf_problem problem = {.dimension = warp->dimension,
                                  .kernel = kernel_for(warp->dimension),
                                  .count = warp->pair_count,
                                  .positions = positions,
                                  .values = ways};
  return zs_rbf_fit(&problem, control, &node->place, diag);
}

bool zs_variational_warp_make(zs_variational_warp *warp, const zs_node *node, unsigned dimension,
                              const zs_control *control, zs_diag *diag)
{
  *warp = (zs_variational_warp){0};
  const size_t count = count_pairs(node);
  if (count == 0)
    return true;
  warp->dimension = dimension;
  warp->pairs = malloc(6 * count * sizeof *warp->pairs);
  double *positions = malloc(count * dimension * sizeof *positions);
  double *ways = malloc(count * sizeof *ways);
  bool done = warp->pairs && positions && ways;
  if (done)
    gather(warp, node);
  else
    zs_fail_memory(diag);
  for (int shape = 0; done && shape < 2; shape++)
    for (unsigned k = 0; done && k < dimension; k++) {
      warp->half[shape][k] = fit_half(warp, node, shape, k, positions, ways, control, diag);
      done = warp->half[shape][k] != NULL;
    }
  free(positions);
  free(ways);
  if (!done)
    zs_variational_warp_clear(warp);
  return done;
}

void zs_variational_warp_apply(const zs_variational_warp *warp, int shape, double *positions,
                               size_t count)
{
  for (size_t i = 0; warp->dimension && i < count; i++) {
    double *p = positions + i * warp->dimension, moved[3];
    for (unsigned k = 0; k < warp->dimension; k++)
      moved[k] = p[k] + zs_rbf_value(warp->half[shape][k], p);
    memcpy(p, moved, warp->dimension * sizeof *p);
  }
}

zs_coordinates zs_variational_warp_emit(zs_compiler *compiler, const zs_variational_warp *warp,
                                        double time, const zs_coordinates *at)
{
  const int shape = time > 0.5;
  const double part = fabs(1 - 2 * time);
  if (!warp->dimension || part == 0)
    return *at;
  zs_value moved[3];
  for (unsigned k = 0; k < 3; k++) {
    moved[k] = zs_emit_coordinate(compiler, at, (int)k);
    if (k < warp->dimension) {
      zs_value way = zs_radial_sum_emit(compiler, warp->half[shape][k], at);
      moved[k] = zs_emit(compiler, ZS_FUNCTION_ADD, moved[k],
                         zs_emit_scaled(compiler, way, part), 0);
    }
  }
  return zs_coordinates_from(moved[0], moved[1], moved[2]);
}
