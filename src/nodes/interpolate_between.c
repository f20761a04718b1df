/* <between>: weights, filling and motion of one gap. */
#include "nodes/interpolate.h"

#include <math.h>
#include <string.h>

/* ---- between, a part ------------------------------------------------------------ */

struct between {
  double ha, hb, fill, wc, wd, time;
  zs_bounded_blend blend;
  double b0;
  const char *weight;
  int correspondence;
};

enum { GIVEN, AUTO };
static const char *const correspondences[] = {"pairs", "auto", NULL};
static const char *const automatic[] = {"auto", NULL};

/* A power of more than nothing whose slope stays finite. */
#define EXPONENT(member, name_, initial_, doc_) \
  {.name = name_, .type = ZS_NUMBER, .offset = offsetof(struct between, member), \
   .initial = initial_, .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 0.01, .maximum = 100, \
   .doc = doc_}

/* A length of a space-time blend, by default a part of the gap's. */
#define BLEND(member, name_, range_, doc_) \
  {.name = name_, .type = ZS_NUMBER, .offset = offsetof(struct between, blend.member), \
   .initial = "auto", .choices = automatic, .unit = "length", .range = range_, .doc = doc_}

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
  {.name = "time", .type = ZS_NUMBER, .offset = offsetof(struct between, time), .initial = "",
   .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 0, .maximum = 1,
   .doc = "how far pairs have moved to their `from-end` and `to-end`; absent, as far as "
          "`interpolate` says"},
  BLEND(a0, "a0", ZS_RANGE_ANY, "of method=\"space-time\": what is added to f half-way, where both "
        "shapes' half-cylinders are 0; `auto`: a tenth of the distance between the levels"),
  BLEND(a1, "a1", ZS_RANGE_POSITIVE, "how far the blend reaches along the values of the shape "
        "below; `auto`: a twentieth of the distance"),
  BLEND(a2, "a2", ZS_RANGE_POSITIVE, "the same of the shape above"),
  BLEND(a3, "a3", ZS_RANGE_POSITIVE, "how far from the levels the blend is held back: the smaller, "
        "the sooner shapes change; `auto`: a twentieth of the distance"),
  ZS_LENGTH(struct between, b0, "b0", "0", ZS_RANGE_ANY,
            "of method=\"space-time\": what is added where each half-cylinder ends; below 0 it "
            "fades before"),
};

static const zs_kind *const parts[] = {&zs_interpolate_pair, NULL};

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

bool zs_between_check_method(const zs_node *between, bool space_time, zs_diag *diag)
{
  static const char *const blending[] = {"a0", "a1", "a2", "a3", "b0"};
  for (size_t i = 0; !space_time && i < ZS_COUNT_OF(blending); i++)
    if (zs_node_has(between, blending[i]))
      return zs_node_misuse(between, diag, blending[i],
                            "'%s' has a meaning with method=\"space-time\" only", blending[i]);
  return !space_time || !zs_node_has(between, "weight") ||
         zs_node_misuse(between, diag, "weight",
                        "'weight' cannot be combined with method=\"space-time\", which adds "
                        "shapes up otherwise");
}

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
    pairs += node->children[i]->kind == &zs_interpolate_pair;
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

/* ---- Space-time blends --------------------------------------------------------------- */

/* In the proportions of the paper: of a time of 20, the half-cylinders leave out 1. */
zs_space_time zs_between_space_time(const zs_node *between, double length)
{
  static const double RISE = 0.1, REACH = 0.05, LEFT_OUT = 0.05;
  zs_space_time blend = {.min = 0, .end = (1 - LEFT_OUT) / 2 * length,
                         .start = (1 + LEFT_OUT) / 2 * length, .max = length,
                         .blend = {RISE * length, REACH * length, REACH * length, REACH * length}};
  if (!between)
    return blend;
  const struct between *p = between->parameters;
  const double given[] = {p->blend.a0, p->blend.a1, p->blend.a2, p->blend.a3};
  double *const used[] = {&blend.blend.a0, &blend.blend.a1, &blend.blend.a2, &blend.blend.a3};
  for (size_t i = 0; i < ZS_COUNT_OF(given); i++)
    if (!isnan(given[i]))
      *used[i] = given[i];
  blend.smoothing = p->b0;
  return blend;
}

/* ---- Pairs ----------------------------------------------------------------------------- */

bool zs_between_is_auto(const zs_node *between)
{
  return ((const struct between *)between->parameters)->correspondence == AUTO;
}

double zs_between_time(const zs_node *between, double common)
{
  const double own = ((const struct between *)between->parameters)->time;
  return isnan(own) ? common : own;
}
