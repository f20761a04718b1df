/* The pairs of <between>, and how shapes are carried along by them: extended interpolation of
 * Parulek and Sramek, with what is wrong in print put right: the lower shape is pulled back by
 * displacements that belong to the places where its points arrive, the upper one by those of
 * where they start. */
#include "nodes/interpolate.h"

#include <math.h>
#include <string.h>

/* ---- pair, a part ------------------------------------------------------------- */

struct pair {
  double from[2], to[2], from_end[2], to_end[2];
  zs_numbers points, points_end;
};

#define PLACE(member, name_, doc_) \
  {.name = name_, .type = ZS_VECTOR2, .offset = offsetof(struct pair, member), .initial = "", \
   .unit = "length", .doc = doc_}
#define CURVE(member, name_, doc_) \
  {.name = name_, .type = ZS_NUMBERS, .offset = offsetof(struct pair, member), .initial = "", \
   .unit = "length", .doc = doc_}

static const zs_attribute pair_attributes[] = {
  PLACE(from, "from", "a point of the shape below"),
  PLACE(to, "to", "the point of the shape above that it becomes"),
  PLACE(from_end, "from-end", "where `from` has moved when `time` is 1; absent, it stays"),
  PLACE(to_end, "to-end", "where `to` has moved when `time` is 1; absent, it stays"),
  CURVE(points, "points", "instead of `from` and `to`: x and y of the points of a curve from the "
        "one to the other, along which the point moves"),
  CURVE(points_end, "points-end", "where as many `points` have moved when `time` is 1; absent, "
        "they stay"),
};

static bool check_curve(const zs_node *node, zs_diag *diag)
{
  static const char *const others[] = {"from", "to", "from-end", "to-end"};
  const struct pair *p = node->parameters;
  for (size_t i = 0; i < ZS_COUNT_OF(others); i++)
    if (zs_node_has(node, others[i]))
      return zs_node_misuse(node, diag, "points", "'points' cannot be combined with '%s'",
                            others[i]);
  if (p->points.count % 2 != 0 || p->points.count < 4)
    return zs_node_fail(node, diag, "points", "there are %zu numbers; expected x and y of at "
                        "least 2 points", p->points.count);
  return !zs_node_has(node, "points-end") || p->points_end.count == p->points.count ||
         zs_node_fail(node, diag, "points-end", "there are %zu numbers; expected %zu, as many as "
                      "of 'points'", p->points_end.count, p->points.count);
}

static bool check_pair(const zs_node *node, zs_diag *diag)
{
  if (zs_node_has(node, "points"))
    return check_curve(node, diag);
  if (zs_node_has(node, "points-end"))
    return zs_node_misuse(node, diag, "points-end", "'points-end' is where 'points' move, and "
                          "these are missing");
  const bool from = zs_node_has(node, "from"), to = zs_node_has(node, "to");
  if (from && to)
    return true;
  return zs_node_misuse(node, diag, from ? "from" : to ? "to" : NULL,
                        from || to ? "'from' and 'to' go together; '%s' is missing"
                                   : "expected 'from' and 'to', or 'points'",
                        from ? "to" : "from");
}

const zs_kind zs_interpolate_pair = {
  .name = "pair",
  .family = ZS_FAMILY_PART,
  .summary = "a point of the shape below, and the one above that it becomes",
  .doc = "x and y are in the shapes' plane: with axis=\"x\" they are y and z, with axis=\"y\" z "
         "and x. Points need not be on the shapes: pairs say how the plane moves, and shapes go "
         "along with it. A pair given twice counts once; points of different pairs cannot come "
         "to the same place at the same height. A pair may itself move, and with it what is "
         "between the levels: while `time` goes from 0 to 1, each of its points goes straight to "
         "the one of the same name with `-end`.",
  .attributes = pair_attributes,
  .attribute_count = ZS_COUNT_OF(pair_attributes),
  .parameters_size = sizeof(struct pair),
  .children = ZS_CHILDREN_NONE,
  .check = check_pair,
};

/* ---- Warps -------------------------------------------------------------------------------- */

/* The pairs of a gap and their paths. */
typedef struct pairs {
  size_t count;
  zs_flow_path *paths;
  const zs_node **nodes;
  bool straight;
} pairs;

/* `count` numbers on their way at a time.  `end`, NULL where nothing moves. */
static void move(double *moved, const double *start, const double *end, size_t count, double time)
{
  for (size_t i = 0; i < count; i++)
    moved[i] = end ? (1 - time) * start[i] + time * end[i] : start[i];
}

/* The path of a pair; of no points when memory is out. */
static zs_flow_path path_of(zs_arena *arena, const zs_node *node, double time)
{
  const struct pair *p = node->parameters;
  const size_t count = p->points.count ? p->points.count : 4;
  double *points = ZS_ARENA_NEW(arena, double, count);
  if (!points)
    return (zs_flow_path){0};
  if (p->points.count) {
    const bool moves = zs_node_has(node, "points-end");
    move(points, p->points.values, moves ? p->points_end.values : NULL, count, time);
  } else {
    move(points, p->from, zs_node_has(node, "from-end") ? p->from_end : NULL, 2, time);
    move(points + 2, p->to, zs_node_has(node, "to-end") ? p->to_end : NULL, 2, time);
  }
  return (zs_flow_path){count / 2, points};
}

/* False when memory is out. */
static bool gather(zs_arena *arena, const zs_node *between, double time, pairs *all)
{
  const size_t most = between->child_count + 1;
  *all = (pairs){.paths = ZS_ARENA_NEW(arena, zs_flow_path, most),
                 .nodes = ZS_ARENA_NEW(arena, const zs_node *, most),
                 .straight = true};
  if (!all->paths || !all->nodes)
    return false;
  for (size_t i = 0; i < between->child_count; i++) {
    if (between->children[i]->kind != &zs_interpolate_pair)
      continue;
    const zs_flow_path path = path_of(arena, between->children[i], time);
    if (!path.count)
      return false;
    all->straight = all->straight && path.count == 2;
    all->nodes[all->count] = between->children[i];
    all->paths[all->count++] = path;
  }
  return true;
}

/* NULL after reporting. */
static const zs_flow *make_flow(zs_compiler *compiler, const pairs *all, zs_flow_way way)
{
  zs_diag *diag = zs_compiler_diag(compiler);
  zs_flow *flow;
  zs_flow_meeting meeting;
  const zs_flow_result result = zs_flow_new(&flow, all->paths, all->count, way, &meeting);
  if (result == ZS_FLOW_MEET) {
    zs_node_fail(all->nodes[meeting.path[1]], diag, NULL,
                 "the point meets that of the pair in line %u, about %.2g of the way up, but does "
                 "not keep with it", all->nodes[meeting.path[0]]->place.line, meeting.s);
    return NULL;
  }
  if (result == ZS_FLOW_MEMORY) {
    zs_fail_memory(diag);
    return NULL;
  }
  return zs_compiler_keep(compiler, flow, zs_flow_free) ? flow : NULL;
}

/* Of pairs that were found.  Should they come too near to each other, fewer will not; `flows` is
 * told which are left. */
static const zs_flow *make_found(zs_compiler *compiler, double (*ends)[4], size_t count,
                                 zs_flow_way way, zs_between_flows *flows)
{
  zs_flow_path *paths = ZS_ARENA_NEW(zs_compiler_arena(compiler), zs_flow_path, count + 1);
  zs_flow *flow = NULL;
  zs_flow_result result = ZS_FLOW_MEET;
  flows->paths = paths;
  for (size_t step = 1; paths && count && result == ZS_FLOW_MEET; step *= 2) {
    size_t used = 0;
    for (size_t i = 0; i < count; i += step)
      paths[used++] = (zs_flow_path){2, ends[i]};
    result = zs_flow_new(&flow, paths, used, way, NULL);
    flows->count = used;
  }
  if (!paths || result == ZS_FLOW_MEMORY) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return NULL;
  }
  return flow && zs_compiler_keep(compiler, flow, zs_flow_free) ? flow : NULL;
}

static void find_flows(zs_compiler *compiler, const zs_node *between,
                       const zs_node *const levels[2], zs_between_flows *flows)
{
  const bool fixed = flows->centers == ZS_CENTERS_FIXED;
  double(*ends)[4];
  size_t n;
  if (!zs_between_find_pairs(compiler, between, levels, &ends, &n))
    return;
  flows->side[0] = make_found(compiler, ends, n, fixed ? ZS_FLOW_AT_END : ZS_FLOW_COME, flows);
  flows->side[1] =
    fixed ? make_found(compiler, ends, n, ZS_FLOW_AT_START, flows) : flows->side[0];
  if (!flows->side[1])
    flows->side[0] = NULL;
}

zs_between_flows zs_between_flows_make(zs_compiler *compiler, const zs_node *between,
                                       const zs_node *const levels[2],
                                       zs_interpolate_centers centers, double time)
{
  zs_between_flows flows = {.centers = centers};
  pairs all;
  if (!between)
    return flows;
  if (zs_between_is_auto(between)) {
    find_flows(compiler, between, levels, &flows);
    return flows;
  }
  if (!gather(zs_compiler_arena(compiler), between, zs_between_time(between, time), &all)) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return flows;
  }
  if (!all.count)
    return flows;
  flows.paths = all.paths;
  flows.count = all.count;
  if (centers == ZS_CENTERS_FIXED) {
    flows.side[0] = make_flow(compiler, &all, ZS_FLOW_AT_END);
    flows.side[1] = flows.side[0] ? make_flow(compiler, &all, ZS_FLOW_AT_START) : NULL;
  } else {
    flows.side[0] = make_flow(compiler, &all, ZS_FLOW_COME);
    flows.side[1] = all.straight || !flows.side[0] ? flows.side[0]
                                                   : make_flow(compiler, &all, ZS_FLOW_TO_GO);
  }
  return flows;
}

void zs_between_flows_tell(zs_compiler *compiler, const zs_node *between,
                           const zs_node *const levels[2], const zs_between_flows *flows,
                           const zs_coordinates *along)
{
  enum { PLACES = 17 /* of a curve */ };
  if (!flows->side[0])
    return;
  zs_correspondence all = {.element = between->kind->name, .line = between->place.line,
                           .found = zs_between_is_auto(between), .count = flows->count,
                           .places = 2};
  for (int k = 0; k < 2; k++)
    all.level[k] = zs_level_height(levels[k]);
  for (size_t i = 0; i < flows->count; i++)
    all.places = flows->paths[i].count > 2 ? PLACES : all.places;
  const size_t count = all.count * all.places + 2; /* and a place on either level */
  double *places = ZS_ARENA_NEW(zs_compiler_arena(compiler), double, 3 * count);
  if (!places) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return;
  }
  for (size_t i = 0; i < all.count * all.places; i++) {
    const double s = (double)(i % all.places) / (double)(all.places - 1);
    zs_flow_path_place(&flows->paths[i / all.places], s, places + 3 * i);
    places[3 * i + 2] = (1 - s) * all.level[0] + s * all.level[1];
  }
  zs_correspondence_tell(compiler, &all, places, all.level, along);
}

zs_coordinates zs_between_warp(zs_compiler *compiler, const zs_between_flows *flows, int side,
                               zs_value motion, const zs_coordinates *at)
{
  const zs_flow *flow = flows->side[side];
  if (!flow)
    return *at;
  const double s = 1 / flow->size;
  const double inverse[12] = {s, 0, 0, -flow->middle[0] * s, 0, s, 0, -flow->middle[1] * s};
  const zs_coordinates own = zs_coordinates_affine(at, inverse);
  /* The lower shape has moved by `motion`, the upper one has the rest still to go. */
  const zs_value part = side == 0 ? motion
                                  : zs_emit(compiler, ZS_FUNCTION_SUBTRACT,
                                            zs_emit_constant(compiler, 1), motion, 0);
  const zs_value when = flows->centers == ZS_CENTERS_FIXED ? zs_emit_constant(compiler, 0) : motion;
  const zs_value x = zs_emit_coordinate(compiler, &own, 0);
  const zs_value y = zs_emit_coordinate(compiler, &own, 1);
  zs_value moved[3], way[2];
  for (int k = 0; k < 3; k++)
    moved[k] = zs_emit_coordinate(compiler, at, k);
  for (int k = 0; k < 2; k++) { /* next to each other: siblings */
    const zs_flow_part data = {.flow = flow, .component = k};
    way[k] = zs_emit_operation(compiler, &zs_flow_operation, &data, x, y, when);
  }
  for (int k = 0; k < 2; k++) {
    way[k] = zs_emit(compiler, ZS_FUNCTION_MULTIPLY, part, way[k], 0);
    moved[k] = zs_emit(compiler, side == 0 ? ZS_FUNCTION_SUBTRACT : ZS_FUNCTION_ADD, moved[k],
                       zs_emit_scaled(compiler, way[k], flow->size), 0);
  }
  return zs_coordinates_from(moved[0], moved[1], moved[2]);
}
