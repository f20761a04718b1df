/* Space maps by pairs of points: thin plates and bumps. */
#include "nodes/common.h"
#include "nodes/extent.h"
#include "nodes/radial.h"

#include <math.h>
#include <stdlib.h>

enum { THIN_PLATE, CUBIC_BUMP, EXPONENTIAL_BUMP };
static const char *const kernels[] = {"thin-plate", "cubic-bump", "exponential-bump", NULL};

/* Moves of more than this part of the radius turn space inside out: the reciprocal of the
 * steepest slope of (1 - u^2)^3 / (1 + u^2), and of exp(-u^2). */
static const double MOST_MOVED[] = {INFINITY, 0.5486, 1.1658};

/* ---- pair, a part ---------------------------------------------------------------- */

struct pair {
  double from[3], to[3], radius;
};

static const zs_attribute pair_attributes[] = {
  ZS_POINT(struct pair, from, "from", NULL, "a point of the child"),
  ZS_POINT(struct pair, to, "to", NULL, "where it goes"),
  ZS_LENGTH(struct pair, radius, "radius", "1", ZS_RANGE_POSITIVE,
            "how far from `to` a bump reaches; a thin plate has no use for it"),
};

static const zs_kind pair = {
  .name = "pair",
  .family = ZS_FAMILY_PART,
  .summary = "a point of the child and where it goes",
  .attributes = pair_attributes,
  .attribute_count = ZS_COUNT_OF(pair_attributes),
  .parameters_size = sizeof(struct pair),
  .children = ZS_CHILDREN_NONE,
};
static const zs_kind *const parts[] = {&pair, NULL};

/* ---- space-map --------------------------------------------------------------------- */

struct space_map {
  int kernel;
};

static const zs_attribute attributes[] = {
  ZS_SELECT(struct space_map, kernel, "kernel", "thin-plate", kernels,
            "`thin-plate`: all of space follows the pairs, and bends as little as it can; "
            "`cubic-bump`: a bump of the pair's radius moves about every point; "
            "`exponential-bump`: one that has no end but fades quickly"),
};

/* The next pair from index *i on, or NULL. */
static const zs_node *next_pair(const zs_node *node, size_t *i)
{
  while (*i < node->child_count)
    if (node->children[(*i)++]->kind == &pair)
      return node->children[*i - 1];
  return NULL;
}

static double way(const struct pair *p)
{
  return hypot(hypot(p->to[0] - p->from[0], p->to[1] - p->from[1]), p->to[2] - p->from[2]);
}

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct space_map *p = node->parameters;
  const zs_node *part;
  for (size_t i = 0; (part = next_pair(node, &i));) {
    const struct pair *q = part->parameters;
    if (way(q) <= MOST_MOVED[p->kernel] * q->radius)
      continue;
    const zs_place place = zs_node_place(part, "radius");
    zs_report(diag, ZS_WARNING, ZS_ERROR_GEOMETRY, &place, NULL,
              "the point moves by %g, more than %g of the radius: space folds over there", way(q),
              MOST_MOVED[p->kernel]);
  }
  return true;
}

/* ---- Bumps --------------------------------------------------------------------------- */

/* The weight of a pair's move, by v = |x - to|^2 / radius^2. */
static zs_value bump(zs_compiler *compiler, const zs_node *node, const struct pair *q,
                     const zs_coordinates *at)
{
  const struct space_map *p = node->parameters;
  const double s = 1 / q->radius;
  const double inverse[12] = {s, 0, 0, -q->to[0] * s, 0, s, 0, -q->to[1] * s,
                              0, 0, s, -q->to[2] * s};
  const zs_coordinates own = zs_coordinates_affine(at, inverse);
  return zs_formula_emit(compiler, node,
                         p->kernel == CUBIC_BUMP
                           ? "let v = x^2 + y^2 + z^2; max(1 - v, 0)^3 / (1 + v)"
                           : "exp(-(x^2 + y^2 + z^2))",
                         &own, 0, 0);
}

static zs_coordinates bumped(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  zs_value moved[3];
  for (int k = 0; k < 3; k++)
    moved[k] = zs_emit_coordinate(compiler, at, k);
  const zs_node *part;
  for (size_t i = 0; (part = next_pair(node, &i));) {
    const struct pair *q = part->parameters;
    const zs_value weight = bump(compiler, node, q, at);
    for (int k = 0; k < 3; k++)
      if (q->to[k] != q->from[k])
        moved[k] = zs_emit(compiler, ZS_FUNCTION_ADD, moved[k],
                           zs_emit_scaled(compiler, weight, q->from[k] - q->to[k]), 0);
  }
  return zs_coordinates_from(moved[0], moved[1], moved[2]);
}

/* ---- Thin plates ----------------------------------------------------------------------- */

/* Pairs as numbers; in the plane z is left out, and nothing depends on it. */
typedef struct plate {
  unsigned dimension;
  size_t count;
  double *positions, *moves; /* where they go, and from there to where they were, by component */
} plate;

/* False when memory is out. */
static bool gather(zs_compiler *compiler, const zs_node *node, plate *all)
{
  const zs_node *part;
  *all = (plate){.dimension = 2};
  for (size_t i = 0; (part = next_pair(node, &i)); all->count++) {
    const struct pair *q = part->parameters;
    if (q->from[2] != 0 || q->to[2] != 0)
      all->dimension = 3;
  }
  zs_arena *arena = zs_compiler_arena(compiler);
  all->positions = ZS_ARENA_NEW(arena, double, 3 * all->count + 1);
  all->moves = ZS_ARENA_NEW(arena, double, 3 * all->count + 1);
  if (!all->positions || !all->moves)
    return false;
  size_t n = 0;
  for (size_t i = 0; (part = next_pair(node, &i)); n++) {
    const struct pair *q = part->parameters;
    for (unsigned k = 0; k < all->dimension; k++) {
      all->positions[n * all->dimension + k] = q->to[k];
      all->moves[k * all->count + n] = q->from[k] - q->to[k];
    }
  }
  return true;
}

static bool moves_at_all(const plate *all, unsigned component)
{
  for (size_t i = 0; i < all->count; i++)
    if (all->moves[component * all->count + i] != 0)
      return true;
  return false;
}

/* The kernels of thin plates in the plane and in space: smoother ones grow faster beyond the
 * pairs, and fold space over. */
static zs_coordinates bent(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  plate all;
  if (!gather(compiler, node, &all)) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return *at;
  }
  zs_value moved[3];
  for (unsigned k = 0; k < 3; k++) {
    moved[k] = zs_emit_coordinate(compiler, at, (int)k);
    if (k >= all.dimension || !moves_at_all(&all, k))
      continue;
    const zs_rbf_problem problem = {.dimension = all.dimension,
                                    .kernel = all.dimension == 2 ? ZS_RBF_TPS2 : ZS_RBF_R,
                                    .count = all.count,
                                    .positions = all.positions,
                                    .values = all.moves + k * all.count};
    moved[k] = zs_emit(compiler, ZS_FUNCTION_ADD, moved[k],
                       zs_radial_emit(compiler, node, &problem, at), 0);
  }
  return zs_coordinates_from(moved[0], moved[1], moved[2]);
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct space_map *p = node->parameters;
  size_t i = 0;
  if (!next_pair(node, &i))
    return zs_children_emit(compiler, node, at);
  const zs_coordinates child =
    p->kernel == THIN_PLATE ? bent(compiler, node, at) : bumped(compiler, node, at);
  return zs_children_emit(compiler, node, &child);
}

/* Bumps move points no farther than all of them together; plates anywhere. */
static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct space_map *p = node->parameters;
  const zs_node *part;
  double most = 0;
  for (size_t i = 0; (part = next_pair(node, &i));)
    most += p->kernel == THIN_PLATE ? INFINITY : way(part->parameters);
  return most < INFINITY ? zs_box_grown(children[0], most) : zs_box_everything();
}

const zs_kind zs_kind_space_map = {
  .name = "space-map",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the child with its points carried to others, and space with them",
  .doc = "The child is evaluated at x + U(x). A thin plate is the displacement U that bends least "
         "of all with U(to) = from - to for every pair: one pair moves everything, several that "
         "stay hold it where they are. If z is 0 in all of them they are pairs of the x-y plane, "
         "and every plane above is displaced the same. Of bumps U is the sum over the pairs of "
         "w (from - to), where with v = |x - to|^2 / radius^2 w is (1 - v)^3 / (1 + v) up to v = 1 "
         "(`cubic-bump`), or exp(-v) (`exponential-bump`).",
  .source = "V. Savchenko, A. Pasko, Transformation of functionally defined shapes by extended "
            "space mappings, 1998; F. Bookstein, Principal warps, 1989",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct space_map),
  .children = ZS_CHILDREN_ONE,
  .parts = parts,
  .check = check,
  .emit = emit,
  .box = box,
};
