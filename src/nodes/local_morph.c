#include "nodes/common.h"
#include "nodes/extent.h"

#include "field/blend.h"

#include <math.h>

/* ---- part, a part ------------------------------------------------------------- */

enum { LINEAR, SMOOTHSTEP };
static const char *const paces[] = {"linear", "smoothstep", NULL};

struct part {
  double from, to;
  int pace;
};

static const zs_attribute part_attributes[] = {
  ZS_PLAIN(struct part, from, "from", "0", ZS_RANGE_ANY, "when what is inside begins to change"),
  ZS_PLAIN(struct part, to, "to", "1", ZS_RANGE_ANY, "when it has become the last shape"),
  ZS_SELECT(struct part, pace, "pace", "linear", paces,
            "`linear`: evenly; `smoothstep`: from rest to rest"),
};

static bool check_part(const zs_node *node, zs_diag *diag)
{
  const struct part *p = node->parameters;
  return zs_node_check_order(node, diag, "from", &p->from, "to", &p->to, 1);
}

static const zs_kind part = {
  .name = "part",
  .family = ZS_FAMILY_PART,
  .summary = "a solid inside of which shapes change by a schedule of its own",
  .attributes = part_attributes,
  .attribute_count = ZS_COUNT_OF(part_attributes),
  .parameters_size = sizeof(struct part),
  .children = ZS_CHILDREN_ONE,
  .check = check_part,
};
static const zs_kind *const parts[] = {&part, NULL};

/* How far the shapes of a part have changed, from 0 to 1. */
static double progress(const struct part *p, double time)
{
  const double s = fmin(fmax((time - p->from) / (p->to - p->from), 0), 1);
  return p->pace == SMOOTHSTEP ? s * s * (3 - 2 * s) : s;
}

/* ---- local-morph --------------------------------------------------------------- */

struct local_morph {
  double time;
};

static const zs_attribute attributes[] = {
  ZS_PLAIN(struct local_morph, time, "time", NULL, ZS_RANGE_ANY,
           "the time that schedules go by: a parameter here makes an animation"),
};

/* What is known of the parts. */
typedef struct partition {
  size_t count;
  const zs_node **nodes;
  double *progress, least, most; /* of each part; of all of them */
  zs_value *weights, *before;    /* not yet divided by their sum; the sum of those before */
} partition;

static bool gather(zs_compiler *compiler, const zs_node *node, partition *all)
{
  const struct local_morph *p = node->parameters;
  zs_arena *arena = zs_compiler_arena(compiler);
  *all = (partition){.nodes = ZS_ARENA_NEW(arena, const zs_node *, node->child_count),
                     .progress = ZS_ARENA_NEW(arena, double, node->child_count),
                     .least = 1,
                     .most = 0,
                     .weights = ZS_ARENA_NEW(arena, zs_value, node->child_count),
                     .before = ZS_ARENA_NEW(arena, zs_value, node->child_count)};
  if (!all->nodes || !all->progress || !all->weights || !all->before)
    return false;
  for (size_t i = 0; i < node->child_count; i++) {
    if (node->children[i]->kind != &part)
      continue;
    const double s = progress(node->children[i]->parameters, p->time);
    all->nodes[all->count] = node->children[i];
    all->progress[all->count++] = s;
    all->least = fmin(all->least, s);
    all->most = fmax(all->most, s);
  }
  if (!all->count) /* one schedule for everything */
    all->least = all->most = progress(&(struct part){0, 1, LINEAR}, p->time);
  return true;
}

/* Puts the values of the solids, kept in bounds, where their weights will be.  Returns the
 * largest of them in magnitude. */
static zs_value values(zs_compiler *compiler, const zs_coordinates *at, const partition *all)
{
  static const double FAR = 1e6, NEAR = 1e-12;
  zs_value size = zs_emit_constant(compiler, NEAR);
  for (size_t i = 0; i < all->count; i++) {
    zs_value f = zs_children_emit(compiler, all->nodes[i], at);
    f = zs_emit(compiler, ZS_FUNCTION_MINIMUM, f, zs_emit_constant(compiler, FAR), 0);
    f = zs_emit(compiler, ZS_FUNCTION_MAXIMUM, f, zs_emit_constant(compiler, -FAR), 0);
    all->weights[i] = f;
    size = zs_emit(compiler, ZS_FUNCTION_MAXIMUM, size,
                   zs_emit(compiler, ZS_FUNCTION_ABSOLUTE, f, 0, 0), 0);
  }
  return size;
}

/* The weight of a solid: the square of its depth over its distance, both as parts of a size and
 * with next to nothing added.  Outside of all solids weights go by the inverse squares of
 * distances, inside one all others have none, and where several overlap they go by the squares
 * of depths.  The fourth power of what is added is still a number. */
static zs_value weight(zs_compiler *compiler, zs_value f, zs_value size)
{
  static const double NOTHING = 1e-9;
  zs_value side[2] = {f, zs_emit_negated(compiler, f)};
  for (int k = 0; k < 2; k++) {
    side[k] = zs_emit(compiler, ZS_FUNCTION_MAXIMUM, side[k], zs_emit_constant(compiler, 0), 0);
    side[k] = zs_emit(compiler, ZS_FUNCTION_DIVIDE, side[k], size, 0);
    side[k] = zs_emit(compiler, ZS_FUNCTION_MINIMUM, side[k], zs_emit_constant(compiler, 1), 0);
    side[k] = zs_emit(compiler, ZS_FUNCTION_ADD, side[k], zs_emit_constant(compiler, NOTHING), 0);
  }
  const zs_value ratio = zs_emit(compiler, ZS_FUNCTION_DIVIDE, side[0], side[1], 0);
  return zs_emit(compiler, ZS_FUNCTION_SQUARE, ratio, 0, 0);
}

/* The progress at a point: the mean of the parts', by their weights.  Each weight is divided
 * by the sum as 1 / (1 + others / own), whose bounds stay sharp where one of them is huge. */
static zs_value mean_progress(zs_compiler *compiler, const zs_coordinates *at, partition *all)
{
  const zs_value one = zs_emit_constant(compiler, 1);
  const zs_value least = zs_emit_constant(compiler, all->least);
  if (!(all->least < all->most))
    return least;
  zs_value sum = zs_emit_constant(compiler, 0), mean = least;
  const zs_value size = values(compiler, at, all);
  for (size_t i = 0; i < all->count; i++) {
    all->before[i] = sum;
    all->weights[i] = weight(compiler, all->weights[i], size);
    sum = zs_emit(compiler, ZS_FUNCTION_ADD, sum, all->weights[i], 0);
  }
  zs_value after = zs_emit_constant(compiler, 0);
  for (size_t i = all->count; i-- > 0;) {
    const zs_value others = zs_emit(compiler, ZS_FUNCTION_ADD, all->before[i], after, 0);
    const zs_value ratio = zs_emit(compiler, ZS_FUNCTION_DIVIDE, others, all->weights[i], 0);
    const zs_value share = zs_emit(compiler, ZS_FUNCTION_DIVIDE, one,
                                   zs_emit(compiler, ZS_FUNCTION_ADD, one, ratio, 0), 0);
    mean = zs_emit(compiler, ZS_FUNCTION_ADD, mean,
                   zs_emit_scaled(compiler, share, all->progress[i] - all->least), 0);
    after = zs_emit(compiler, ZS_FUNCTION_ADD, after, all->weights[i], 0);
  }
  return zs_emit(compiler, ZS_FUNCTION_MINIMUM, mean, zs_emit_constant(compiler, all->most), 0);
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  partition all;
  if (!gather(compiler, node, &all)) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return zs_emit_constant(compiler, 0);
  }
  const size_t shapes = node->child_count - all.count;
  zs_value way = zs_emit_scaled(compiler, mean_progress(compiler, at, &all), (double)shapes - 1);
  zs_value f = 0;
  size_t count = 0;
  for (size_t i = 0; i < node->child_count; i++) {
    if (zs_node_is_part(node->children[i]))
      continue;
    const zs_value shape = zs_node_emit(compiler, node->children[i], at);
    if (count >= 2) /* the next key shape is one further on */
      way = zs_emit(compiler, ZS_FUNCTION_SUBTRACT, way, zs_emit_constant(compiler, 1), 0);
    f = count++ ? zs_emit_operation(compiler, &zs_interpolation, NULL, f, shape, way) : shape;
  }
  return f;
}

const zs_kind zs_kind_local_morph = {
  .name = "local-morph",
  .family = ZS_FAMILY_INTERPOLATION,
  .summary = "one child becomes another, sooner in one place than in another",
  .doc = "f is (1 - s) f1 + s f2, where s goes from 0 to 1 by different schedules in different "
         "places. Inside the solid of a `part` s is that of its schedule; in between it is the "
         "mean of all, weighted by the inverse squares of the distances to their solids (as far as "
         "these solids' values are distances). Where solids overlap it is the mean weighted by the "
         "squares of depths, and f jumps where their surfaces cross if they are at different "
         "stages. Without parts everything goes from time 0 to time 1. More than two children are "
         "passed in turn, in the time of each schedule.",
  .source = "after descriptions of B. Schmitt's local metamorphosis, 2005; weights by inverse "
            "distances are those of D. Shepard, A two-dimensional interpolation function for "
            "irregularly-spaced data, 1968",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct local_morph),
  .children = ZS_CHILDREN_TWO,
  .parts = parts,
  .emit = emit,
  .box = zs_box_of_union,
};
