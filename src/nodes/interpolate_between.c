/* <between> and its pairs: extended interpolation of Parulek and Sramek, with what is wrong
 * in print put right: the lower shape is pulled back by displacements that belong to the
 * places where its points arrive, the upper one by those of where they start. */
#include "nodes/interpolate.h"

#include <math.h>
#include <string.h>

/* ---- pair, a part ------------------------------------------------------------- */

struct pair {
  double from[2], to[2];
  zs_numbers points;
};

#define PLACE(member, name_, doc_) \
  {.name = name_, .type = ZS_VECTOR2, .offset = offsetof(struct pair, member), .initial = "", \
   .unit = "length", .doc = doc_}

static const zs_attribute pair_attributes[] = {
  PLACE(from, "from", "a point of the shape below"),
  PLACE(to, "to", "the point of the shape above that it becomes"),
  {.name = "points", .type = ZS_NUMBERS, .offset = offsetof(struct pair, points), .initial = "",
   .unit = "length",
   .doc = "instead of `from` and `to`: x and y of the points of a curve from the one to the "
          "other, along which the point moves"},
};

static bool check_pair(const zs_node *node, zs_diag *diag)
{
  const struct pair *p = node->parameters;
  const bool from = zs_node_has(node, "from"), to = zs_node_has(node, "to");
  if (zs_node_has(node, "points")) {
    if (from || to)
      return zs_node_misuse(node, diag, "points", "'points' cannot be combined with '%s'",
                            from ? "from" : "to");
    return (p->points.count % 2 == 0 && p->points.count >= 4) ||
           zs_node_fail(node, diag, "points", "there are %zu numbers; expected x and y of at "
                        "least 2 points", p->points.count);
  }
  if (from && to)
    return true;
  return zs_node_misuse(node, diag, from ? "from" : to ? "to" : NULL,
                        from || to ? "'from' and 'to' go together; '%s' is missing"
                                   : "expected 'from' and 'to', or 'points'",
                        from ? "to" : "from");
}

static const zs_kind pair = {
  .name = "pair",
  .family = ZS_FAMILY_PART,
  .summary = "a point of the shape below, and the one above that it becomes",
  .doc = "x and y are in the shapes' plane: with axis=\"x\" they are y and z, with axis=\"y\" z "
         "and x.",
  .attributes = pair_attributes,
  .attribute_count = ZS_COUNT_OF(pair_attributes),
  .parameters_size = sizeof(struct pair),
  .children = ZS_CHILDREN_NONE,
  .check = check_pair,
};

/* ---- between, a part ------------------------------------------------------------ */

struct between {
  double ha, hb, fill, wc, wd;
  const char *weight;
  int correspondence;
};

enum { GIVEN, AUTO };
static const char *const correspondences[] = {"pairs", "auto", NULL};

/* A power of more than nothing whose slope stays finite. */
#define EXPONENT(member, name_, initial_, doc_) \
  {.name = name_, .type = ZS_NUMBER, .offset = offsetof(struct between, member), \
   .initial = initial_, .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 0.01, .maximum = 100, \
   .doc = doc_}

static const zs_attribute attributes[] = {
  EXPONENT(ha, "ha", "1", "with `hb`, how the shapes move: at the part t of the way between the "
           "levels they have moved by h = 1 - (1 - t^ha)^hb"),
  EXPONENT(hb, "hb", "1", "see `ha`"),
  ZS_LENGTH(struct between, fill, "fill", "0", ZS_RANGE_ANY,
            "what is added to f half-way, so that gaps close (or with a negative number open)"),
  EXPONENT(wc, "wc", "2", "with `wd`, where filling goes: `fill` (1 - |2 t - 1|^wc)^wd is added"),
  EXPONENT(wd, "wd", "1", "see `wc`"),
  {.name = "weight", .type = ZS_TEXT, .offset = offsetof(struct between, weight),
   .initial = "linear", .unit = "",
   .doc = "how much the shape above counts at t: `linear`, `smoothstep`, or pairs of t and "
          "weight from `0 0` to `1 1`, such as `0 0, 0.3 0.1, 1 1`, joined by a monotone spline"},
  ZS_SELECT(struct between, correspondence, "correspondence", "pairs", correspondences,
            "`pairs`: what belongs together is what the pairs say; `auto`: it is found by a "
            "registration of the two shapes"),
};

static const zs_kind *const parts[] = {&pair, NULL};

/* ---- Weights ------------------------------------------------------------------------ */

enum { MOST_KNOTS = 64 };

/* A weight as a spline: two knots are a straight line. */
typedef struct spline {
  size_t count;
  double t[MOST_KNOTS], w[MOST_KNOTS], slope[MOST_KNOTS];
} spline;

/* Numbers separated by blanks and commas; -1: there is something else, or too much. */
static int read_numbers(const char *text, double *numbers, int most)
{
  int count = 0;
  for (text += strspn(text, " \t\r\n,"); *text; text += strspn(text, " \t\r\n,")) {
    const size_t length = count < most ? zs_number_parse(text, strlen(text), &numbers[count]) : 0;
    if (length == 0 || !isfinite(numbers[count]))
      return -1;
    text += length;
    count++;
  }
  return count;
}

/* Slopes that keep the spline monotone between its knots: the harmonic means of Fritsch and
 * Butland (1984), and at the ends those of the straight line. */
static void find_slopes(spline *s)
{
  for (size_t i = 0; i < s->count; i++) {
    const size_t a = i > 0 ? i - 1 : 0, b = i + 1 < s->count ? i : i - 1;
    const double before = (s->w[a + 1] - s->w[a]) / (s->t[a + 1] - s->t[a]);
    const double after = (s->w[b + 1] - s->w[b]) / (s->t[b + 1] - s->t[b]);
    if (a == b)
      s->slope[i] = before;
    else
      s->slope[i] = before * after > 0 ? 2 * before * after / (before + after) : 0;
  }
}

static bool read_spline(const char *text, spline *s)
{
  if (!strcmp(text, "linear")) {
    *s = (spline){.count = 2, .t = {0, 1}, .w = {0, 1}, .slope = {1, 1}};
    return true;
  }
  if (!strcmp(text, "smoothstep")) {
    *s = (spline){.count = 2, .t = {0, 1}, .w = {0, 1}};
    return true;
  }
  double numbers[2 * MOST_KNOTS];
  const int count = read_numbers(text, numbers, 2 * MOST_KNOTS);
  if (count < 4 || count % 2)
    return false;
  s->count = (size_t)count / 2;
  for (size_t i = 0; i < s->count; i++) {
    s->t[i] = numbers[2 * i];
    s->w[i] = numbers[2 * i + 1];
    if (i > 0 && !(s->t[i] > s->t[i - 1]))
      return false;
  }
  find_slopes(s);
  const size_t last = s->count - 1;
  return s->t[0] == 0 && s->w[0] == 0 && s->t[last] == 1 && s->w[last] == 1;
}

/* ---- Checks ---------------------------------------------------------------------------- */

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct between *p = node->parameters;
  spline s;
  if (!read_spline(p->weight, &s))
    return zs_node_fail(node, diag, "weight", "'%.60s' is no weight; expected 'linear', "
                        "'smoothstep', or ascending pairs of t and weight from 0 0 to 1 1",
                        p->weight);
  size_t pairs = 0;
  for (size_t i = 0; i < node->child_count; i++)
    pairs += node->children[i]->kind == &pair;
  if (pairs && p->correspondence == AUTO)
    return zs_node_misuse(node, diag, "correspondence",
                          "pairs cannot be combined with correspondence=\"auto\"");
  return pairs <= ZS_FLOW_MOST ||
         zs_node_misuse(node, diag, NULL, "there are %zu pairs; expected at most %d", pairs,
                        ZS_FLOW_MOST);
}

bool zs_between_check_smooth(const zs_node *between, zs_diag *diag)
{
  const struct between *p = between->parameters;
  if (zs_node_has(between, "weight"))
    return zs_node_misuse(between, diag, "weight",
                          "'weight' cannot be combined with continuity=\"c1\", which says how "
                          "shapes follow each other");
  return p->fill == 0 || p->wd > 1 ||
         zs_node_misuse(between, diag, zs_node_has(between, "wd") ? "wd" : "fill",
                        "filling begins with a crease when 'wd' is %g; with continuity=\"c1\" "
                        "expected more than 1", p->wd);
}

const zs_kind zs_interpolate_between = {
  .name = "between",
  .family = ZS_FAMILY_PART,
  .summary = "how the shape below becomes the one above",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct between),
  .children = ZS_CHILDREN_NONE,
  .parts = parts,
  .check = check,
};

/* ---- Functions of t --------------------------------------------------------------------- */

static zs_value constant(zs_compiler *compiler, double number)
{
  return zs_emit_constant(compiler, number);
}

static zs_value one_minus(zs_compiler *compiler, zs_value a)
{
  return zs_emit(compiler, ZS_FUNCTION_SUBTRACT, constant(compiler, 1), a, 0);
}

/* a^exponent for 0 <= a <= 1, which is 0 and 1 there too.  Exponents below 1 would begin
 * with an endless slope; they begin a little later instead. */
static zs_value power(zs_compiler *compiler, zs_value a, double exponent)
{
  const double least = exponent < 1 ? 1e-6 : 0, from = pow(least, exponent);
  if (exponent == 1)
    return a;
  if (exponent < 1)
    a = zs_emit(compiler, ZS_FUNCTION_MAXIMUM, a, constant(compiler, least), 0);
  zs_value p = zs_emit(compiler, ZS_FUNCTION_POWER, a, constant(compiler, exponent), 0);
  if (exponent > 1)
    return p;
  p = zs_emit(compiler, ZS_FUNCTION_SUBTRACT, p, constant(compiler, (double)(float)from), 0);
  p = zs_emit_scaled(compiler, p, 1 / (1 - from));
  p = zs_emit(compiler, ZS_FUNCTION_MAXIMUM, p, constant(compiler, 0), 0);
  return zs_emit(compiler, ZS_FUNCTION_MINIMUM, p, constant(compiler, 1), 0);
}

zs_value zs_between_motion(zs_compiler *compiler, const zs_node *between, zs_value t)
{
  const struct between *p = between->parameters;
  if (p->hb == 1)
    return power(compiler, t, p->ha);
  zs_value rest = power(compiler, one_minus(compiler, power(compiler, t, p->ha)), p->hb);
  return one_minus(compiler, rest);
}

/* Sum of the cubics of all pieces, each of which stays at its end beyond it. */
zs_value zs_between_weight(zs_compiler *compiler, const zs_node *between, zs_value t)
{
  spline s;
  if (!between || !read_spline(((const struct between *)between->parameters)->weight, &s) ||
      (s.count == 2 && s.slope[0] == 1))
    return t;
  zs_value sum = constant(compiler, 0);
  for (size_t i = 0; i + 1 < s.count; i++) {
    const double h = s.t[i + 1] - s.t[i], rise = s.w[i + 1] - s.w[i];
    const double a = h * s.slope[i], b = h * s.slope[i + 1];
    zs_value u = zs_emit(compiler, ZS_FUNCTION_SUBTRACT, t, constant(compiler, s.t[i]), 0);
    u = zs_emit_scaled(compiler, u, 1 / h);
    u = zs_emit(compiler, ZS_FUNCTION_MAXIMUM, u, constant(compiler, 0), 0);
    u = zs_emit(compiler, ZS_FUNCTION_MINIMUM, u, constant(compiler, 1), 0);
    /* ((a + b - 2 rise) u + 3 rise - 2 a - b) u + a) u */
    zs_value v = zs_emit_scaled(compiler, u, a + b - 2 * rise);
    v = zs_emit(compiler, ZS_FUNCTION_ADD, v, constant(compiler, 3 * rise - 2 * a - b), 0);
    v = zs_emit(compiler, ZS_FUNCTION_MULTIPLY, v, u, 0);
    v = zs_emit(compiler, ZS_FUNCTION_ADD, v, constant(compiler, a), 0);
    v = zs_emit(compiler, ZS_FUNCTION_MULTIPLY, v, u, 0);
    sum = zs_emit(compiler, ZS_FUNCTION_ADD, sum, v, 0);
  }
  /* Rounding must not leave the levels short of their shapes. */
  zs_value end = zs_emit(compiler, ZS_FUNCTION_LESS_EQUAL, constant(compiler, 1), t, 0);
  return zs_emit(compiler, ZS_FUNCTION_SELECT, end, constant(compiler, 1), sum);
}

zs_value zs_between_filling(zs_compiler *compiler, const zs_node *between, zs_value t)
{
  const struct between *p = between->parameters;
  zs_value from_middle = zs_emit_scaled(compiler, t, 2);
  from_middle =
    zs_emit(compiler, ZS_FUNCTION_SUBTRACT, from_middle, constant(compiler, 1), 0);
  from_middle = zs_emit(compiler, ZS_FUNCTION_ABSOLUTE, from_middle, 0, 0);
  zs_value w = one_minus(compiler, power(compiler, from_middle, p->wc));
  return zs_emit_scaled(compiler, power(compiler, w, p->wd), p->fill);
}

/* ---- Warps -------------------------------------------------------------------------------- */

/* The pairs of a gap and their paths. */
typedef struct pairs {
  size_t count;
  zs_flow_path *paths;
  const zs_node **nodes;
  bool straight;
} pairs;

/* False when memory is out. */
static bool gather(zs_arena *arena, const zs_node *between, pairs *all)
{
  const size_t most = between->child_count + 1;
  double *ends = ZS_ARENA_NEW(arena, double, 4 * most);
  *all = (pairs){.paths = ZS_ARENA_NEW(arena, zs_flow_path, most),
                 .nodes = ZS_ARENA_NEW(arena, const zs_node *, most),
                 .straight = true};
  if (!ends || !all->paths || !all->nodes)
    return false;
  for (size_t i = 0; i < between->child_count; i++, ends += 4) {
    const zs_node *part = between->children[i];
    const struct pair *p = part->parameters;
    if (part->kind != &pair)
      continue;
    memcpy(ends, p->from, sizeof p->from);
    memcpy(ends + 2, p->to, sizeof p->to);
    all->nodes[all->count] = part;
    all->paths[all->count++] = p->points.count
                                 ? (zs_flow_path){p->points.count / 2, p->points.values}
                                 : (zs_flow_path){2, ends};
    all->straight = all->straight && p->points.count <= 4;
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

/* Pairs that are found.  Should they come too near to each other, fewer will not. */
static const zs_flow *find_flow(zs_compiler *compiler, const zs_node *const levels[2],
                                zs_flow_way way)
{
  double(*ends)[4];
  size_t count = zs_between_find_pairs(compiler, levels, &ends);
  zs_flow_path *paths = ZS_ARENA_NEW(zs_compiler_arena(compiler), zs_flow_path, count + 1);
  zs_flow *flow = NULL;
  zs_flow_result result = ZS_FLOW_MEET;
  for (size_t step = 1; paths && count && result == ZS_FLOW_MEET; step *= 2) {
    size_t used = 0;
    for (size_t i = 0; i < count; i += step)
      paths[used++] = (zs_flow_path){2, ends[i]};
    result = zs_flow_new(&flow, paths, used, way, NULL);
  }
  if (!paths || result == ZS_FLOW_MEMORY) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return NULL;
  }
  return flow && zs_compiler_keep(compiler, flow, zs_flow_free) ? flow : NULL;
}

zs_between_flows zs_between_flows_make(zs_compiler *compiler, const zs_node *between,
                                       const zs_node *const levels[2],
                                       zs_interpolate_centers centers)
{
  zs_between_flows flows = {.centers = centers};
  pairs all;
  if (!between)
    return flows;
  if (((const struct between *)between->parameters)->correspondence == AUTO) {
    const bool fixed = centers == ZS_CENTERS_FIXED;
    flows.side[0] = find_flow(compiler, levels, fixed ? ZS_FLOW_AT_END : ZS_FLOW_COME);
    flows.side[1] = fixed ? find_flow(compiler, levels, ZS_FLOW_AT_START) : flows.side[0];
    if (!flows.side[1])
      flows.side[0] = NULL;
    return flows;
  }
  if (!gather(zs_compiler_arena(compiler), between, &all)) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return flows;
  }
  if (!all.count)
    return flows;
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
  const zs_value part = side == 0 ? motion : one_minus(compiler, motion);
  const zs_value when = flows->centers == ZS_CENTERS_FIXED ? constant(compiler, 0) : motion;
  zs_value moved[3];
  for (int k = 0; k < 3; k++) {
    moved[k] = zs_emit_coordinate(compiler, at, k);
    if (k == 2)
      continue;
    const zs_flow_part data = {.flow = flow, .component = k};
    zs_value way = zs_emit_operation(compiler, &zs_flow_operation, &data,
                                     zs_emit_coordinate(compiler, &own, 0),
                                     zs_emit_coordinate(compiler, &own, 1), when);
    way = zs_emit(compiler, ZS_FUNCTION_MULTIPLY, part, way, 0);
    moved[k] = zs_emit(compiler, side == 0 ? ZS_FUNCTION_SUBTRACT : ZS_FUNCTION_ADD, moved[k],
                       zs_emit_scaled(compiler, way, flow->size), 0);
  }
  return zs_coordinates_from(moved[0], moved[1], moved[2]);
}
