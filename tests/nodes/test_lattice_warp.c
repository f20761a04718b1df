#define _POSIX_C_SOURCE 200809L /* setenv */

/* lattice-warp: space carried along by control points. */
#include "../random.h"
#include "laws.h"
#include "scene_text.h"

#include "nodes/extent.h"

static const char *const isas[] = {"baseline", "avx2", "avx512"};

/* A child whose value tells the place. */
static zs_node *telltale(zs_arena *arena)
{
  return set_formula(arena, node_named(arena, "formula"), "formula", "x + 7 * y - 30 * z");
}

static double told(const double p[3])
{
  return p[0] + 7 * p[1] - 30 * p[2];
}

/* ---- Lattices -------------------------------------------------------------------- */

enum { MOST_SIDE = 6 };

/* A lattice and its moves, as numbers of the test's own. */
typedef struct lattice {
  double min[3], max[3], by[MOST_SIDE][MOST_SIDE][MOST_SIDE][3];
  int size[3];
} lattice;

static double spacing(const lattice *l, int k)
{
  return (l->max[k] - l->min[k]) / (l->size[k] - 1);
}

static void random_lattice(lattice *l, uint64_t *state)
{
  memset(l, 0, sizeof *l);
  for (int k = 0; k < 3; k++) {
    l->size[k] = 2 + (int)random_below(state, MOST_SIDE - 1);
    l->min[k] = random_between(state, -1.5, -0.5);
    l->max[k] = random_between(state, 0.5, 1.5);
  }
}

/* Moves of up to a part of the spacing: below some 0.3 nothing folds. */
static void random_moves(lattice *l, double most, uint64_t *state)
{
  for (int i = 0; i < l->size[0]; i++)
    for (int j = 0; j < l->size[1]; j++)
      for (int k = 0; k < l->size[2]; k++)
        for (int c = 0; c < 3; c++)
          l->by[i][j][k][c] = random_between(state, -most, most) * spacing(l, c);
}

static zs_node *node_of(zs_arena *arena, const lattice *l, const char *method)
{
  zs_node *node = choose(node_named(arena, "lattice-warp"), "method", method);
  set_vector(set_vector(node, "min", l->min), "max", l->max);
  set(set3(node, "size", l->size[0], l->size[1], l->size[2]), "resolution", 8);
  for (int i = 0; i < l->size[0]; i++)
    for (int j = 0; j < l->size[1]; j++)
      for (int k = 0; k < l->size[2]; k++) {
        const double *by = l->by[i][j][k];
        if (by[0] == 0 && by[1] == 0 && by[2] == 0)
          continue;
        zs_node *move = node_of_kind(arena, node->kind->parts[0]);
        adopt(arena, node, set_vector(set3(move, "control", i, j, k), "by", by));
      }
  return node;
}

static zs_node *add_drag(zs_arena *arena, zs_node *node, const double from[3], const double to[3],
                         double radius)
{
  zs_node *drag = node_of_kind(arena, node->kind->parts[1]);
  set_vector(set_vector(drag, "from", from), "to", to);
  return adopt(arena, node, isnan(radius) ? drag : set(drag, "radius", radius));
}

/* The cubic B-spline by truncated powers. */
static double spline(double x)
{
  static const double binomial[] = {1, -4, 6, -4, 1};
  double sum = 0;
  for (int k = 0; k <= 4; k++)
    sum += binomial[k] * pow(fmax(x + 2 - k, 0), 3) / 6;
  return fabs(x) < 2 ? sum : 0;
}

static double weight_of(const lattice *l, const int at[3], const double x[3])
{
  double w = 1;
  for (int k = 0; k < 3; k++)
    w *= spline((x[k] - l->min[k]) / spacing(l, k) - at[k]);
  return w;
}

/* x + D(x), all control points summed. */
static void forward(const lattice *l, const double x[3], double y[3])
{
  memcpy(y, x, 3 * sizeof *y);
  for (int i = 0; i < l->size[0]; i++)
    for (int j = 0; j < l->size[1]; j++)
      for (int k = 0; k < l->size[2]; k++) {
        const double w = weight_of(l, (const int[3]){i, j, k}, x);
        for (int c = 0; c < 3; c++)
          y[c] += w * l->by[i][j][k][c];
      }
}

static void random_point(double p[3], double reach, uint64_t *state)
{
  for (int k = 0; k < 3; k++)
    p[k] = random_between(state, -reach, reach);
}

/* ---- The map ---------------------------------------------------------------------- */

/* The sum of B-splines, backward and forward, in and around the lattice. */
static void maps_are_their_splines(void **unused)
{
  (void)unused;
  uint64_t state = 3;
  for (int t = 0; t < 20; t++) {
    zs_arena arena = {0}, *A = &arena;
    lattice l;
    random_lattice(&l, &state);
    random_moves(&l, 0.25, &state);
    zs_eval *pull = compiled(wrap(A, node_of(A, &l, "inverse"), telltale(A)));
    zs_eval *push = compiled(wrap(A, node_of(A, &l, "push-forward"), telltale(A)));
    for (int n = 0; n < 100; n++) {
      double x[3], y[3];
      random_point(x, n % 2 ? 1.2 : 6, &state);
      forward(&l, x, y);
      assert_true(fabs(zs_eval_point(pull, x) - told(y)) < 1e-10);
      assert_true(fabs(zs_eval_point(push, y) - told(x)) < 1e-8);
    }
    zs_eval_free(pull);
    zs_eval_free(push);
    zs_arena_free(&arena);
  }
}

/* Nothing moves: the same program as the child's. */
static void no_moves_are_no_map(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  lattice l = {.min = {-1, -1, -1}, .max = {1, 1, 1}, .size = {4, 4, 4}};
  zs_node *solid = node_named(A, "torus");
  check_law(EQUAL, "no moves", wrap(A, node_of(A, &l, "inverse"), solid), solid);
  check_law(EQUAL, "no moves", wrap(A, node_of(A, &l, "push-forward"), solid), solid);
  zs_node *still = add_drag(A, node_of(A, &l, "push-forward"), (double[3]){0.2, 0, 0},
                            (double[3]){0.2, 0, 0}, NAN);
  check_law(EQUAL, "a drag to where it is", wrap(A, still, solid), solid);
  zs_arena_free(&arena);
}

/* Control points that are moved by an affine map move what is between them by it. */
static void affine_moves_are_affine(void **unused)
{
  (void)unused;
  uint64_t state = 4;
  for (int t = 0; t < 20; t++) {
    zs_arena arena = {0}, *A = &arena;
    lattice l;
    double m[3][4];
    random_lattice(&l, &state);
    for (int c = 0; c < 3; c++) {
      l.size[c] = MOST_SIDE;
      for (int k = 0; k < 4; k++)
        m[c][k] = random_between(&state, -0.15, 0.15);
    }
    for (int i = 0; i < MOST_SIDE; i++)
      for (int j = 0; j < MOST_SIDE; j++)
        for (int k = 0; k < MOST_SIDE; k++) {
          const int at[3] = {i, j, k};
          double p[3];
          for (int c = 0; c < 3; c++)
            p[c] = l.min[c] + at[c] * spacing(&l, c);
          for (int c = 0; c < 3; c++)
            l.by[i][j][k][c] = m[c][0] * p[0] + m[c][1] * p[1] + m[c][2] * p[2] + m[c][3];
        }
    zs_eval *pull = compiled(wrap(A, node_of(A, &l, "inverse"), telltale(A)));
    zs_eval *push = compiled(wrap(A, node_of(A, &l, "push-forward"), telltale(A)));
    for (int n = 0; n < 100; n++) {
      double x[3], y[3];
      for (int c = 0; c < 3; c++)
        x[c] = random_between(&state, l.min[c] + spacing(&l, c), l.max[c] - spacing(&l, c));
      for (int c = 0; c < 3; c++)
        y[c] = x[c] + m[c][0] * x[0] + m[c][1] * x[1] + m[c][2] * x[2] + m[c][3];
      assert_true(fabs(zs_eval_point(pull, x) - told(y)) < 1e-10);
      assert_true(fabs(zs_eval_point(push, y) - told(x)) < 1e-8);
    }
    zs_eval_free(pull);
    zs_eval_free(push);
    zs_arena_free(&arena);
  }
}

/* One method undoes the other, whichever comes first. */
static void methods_undo_each_other(void **unused)
{
  (void)unused;
  uint64_t state = 5;
  for (int t = 0; t < 12; t++) {
    zs_arena arena = {0}, *A = &arena;
    lattice l;
    random_lattice(&l, &state);
    random_moves(&l, 0.28, &state);
    zs_eval *a = compiled(wrap(A, node_of(A, &l, "inverse"),
                               wrap(A, node_of(A, &l, "push-forward"), telltale(A))));
    zs_eval *b = compiled(wrap(A, node_of(A, &l, "push-forward"),
                               wrap(A, node_of(A, &l, "inverse"), telltale(A))));
    for (int n = 0; n < 100; n++) {
      double x[3];
      random_point(x, 3, &state);
      assert_true(fabs(zs_eval_point(a, x) - told(x)) < 1e-7);
      assert_true(fabs(zs_eval_point(b, x) - told(x)) < 1e-7);
    }
    zs_eval_free(a);
    zs_eval_free(b);
    zs_arena_free(&arena);
  }
}

/* Two spacings away space is as it was, and on the way there nothing jumps. */
static void joins_smoothly(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  lattice l = {.min = {-1, -1, -1}, .max = {1, 1, 1}, .size = {3, 3, 3}};
  uint64_t state = 6;
  random_moves(&l, 0.25, &state);
  zs_eval *pull = compiled(wrap(A, node_of(A, &l, "inverse"), telltale(A)));
  zs_eval *push = compiled(wrap(A, node_of(A, &l, "push-forward"), telltale(A)));
  for (int n = 0; n < 400; n++) {
    double p[3];
    random_point(p, 3.5, &state);
    p[n % 3] = (n % 2 ? 1 : -1) * random_between(&state, 3, 1000);
    assert_true(zs_eval_point(pull, p) == told(p) && zs_eval_point(push, p) == told(p));
    p[n % 3] = n % 2 ? 2.999 : -2.999; /* D is a cube of the way from the end */
    assert_true(fabs(zs_eval_point(pull, p) - told(p)) < 1e-7);
    assert_true(fabs(zs_eval_point(push, p) - told(p)) < 1e-7);
  }
  zs_eval_free(pull);
  zs_eval_free(push);
  zs_arena_free(&arena);
}

/* ---- Drags -------------------------------------------------------------------------- */

/* All points land, with both methods, with moves besides, several at once. */
static void drags_land(void **unused)
{
  (void)unused;
  uint64_t state = 7;
  for (int t = 0; t < 60; t++) {
    zs_arena arena = {0}, *A = &arena;
    lattice l;
    random_lattice(&l, &state);
    for (int k = 0; k < 3; k++)
      l.size[k] = 4 + (int)random_below(&state, 3);
    if (t % 3 == 0)
      random_moves(&l, 0.05, &state);
    zs_node *node = node_of(A, &l, t % 2 ? "inverse" : "push-forward");
    const int count = 1 + (int)random_below(&state, 4);
    double from[4][3], to[4][3];
    for (int i = 0; i < count; i++) { /* a corner of the lattice each */
      for (int k = 0; k < 3; k++) {
        from[i][k] = (i >> (k % 2) & 1 ? l.max[k] : l.min[k]) * random_between(&state, 0.6, 1);
        to[i][k] = from[i][k] + random_between(&state, -0.15, 0.15) * spacing(&l, k);
      }
      add_drag(A, node, from[i], to[i], random_below(&state, 2) ? NAN : 2);
    }
    assert_true(node->kind->check(node, NULL));
    zs_eval *eval = compiled(wrap(A, node, telltale(A)));
    for (int i = 0; i < count; i++)
      if (fabs(zs_eval_point(eval, to[i]) - told(from[i])) > 1e-9)
        fail_msg("%d of %d, lattice %d: %.12g for %.12g", i, count, t, zs_eval_point(eval, to[i]),
                 told(from[i]));
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
}

/* Of one drag the moves are in the weights of the basis functions: of all ways to meet it the
 * least squares.  With a radius only control points within it move. */
static void moves_are_the_least(void **unused)
{
  (void)unused;
  uint64_t state = 8;
  for (int t = 0; t < 40; t++) {
    zs_arena arena = {0}, *A = &arena;
    lattice l;
    random_lattice(&l, &state);
    double from[3], way[3], to[3], square = 0;
    for (int k = 0; k < 3; k++) {
      from[k] = random_between(&state, l.min[k], l.max[k]);
      way[k] = random_between(&state, -0.1, 0.1) * spacing(&l, k);
      to[k] = from[k] + way[k];
    }
    const double radius = t % 2 ? 1.4 : NAN;
    zs_node *node = add_drag(A, node_of(A, &l, "push-forward"), from, to, radius);
    if (node->kind->check(node, NULL)) {
      for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < l.size[0]; i++)
          for (int j = 0; j < l.size[1]; j++)
            for (int k = 0; k < l.size[2]; k++) {
              const int at[3] = {i, j, k};
              const double w = weight_of(&l, at, from);
              double away = 0;
              for (int c = 0; c < 3; c++)
                away = hypot(away, l.min[c] + at[c] * spacing(&l, c) - from[c]);
              if (away > radius)
                continue;
              square += pass ? 0 : w * w;
              for (int c = 0; c < 3 && pass; c++)
                l.by[i][j][k][c] = way[c] * w / square;
            }
      zs_eval *eval = compiled(wrap(A, node, telltale(A)));
      for (int n = 0; n < 50; n++) {
        double x[3], y[3];
        random_point(x, 2, &state);
        forward(&l, x, y);
        assert_true(fabs(zs_eval_point(eval, y) - told(x)) < 1e-8);
      }
      zs_eval_free(eval);
    } else {
      assert_true(t % 2); /* nothing within the radius */
    }
    zs_arena_free(&arena);
  }
}

/* A drag that says the same twice is met; one that says something else is refused. */
static void repeated_drags(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  lattice l = {.min = {-1, -1, -1}, .max = {1, 1, 1}, .size = {4, 4, 4}};
  const double p[3] = {0.1, 0.2, 0.3}, q[3] = {0.2, 0.2, 0.3}, r[3] = {0.2, 0.25, 0.3};
  zs_node *twice = node_of(A, &l, "push-forward");
  for (int i = 0; i < 5; i++)
    add_drag(A, twice, p, q, NAN);
  assert_true(twice->kind->check(twice, NULL));
  zs_eval *eval = compiled(wrap(A, twice, telltale(A)));
  assert_true(fabs(zs_eval_point(eval, q) - told(p)) < 1e-9);
  zs_eval_free(eval);
  expect_refused(add_drag(A, add_drag(A, node_of(A, &l, "push-forward"), p, q, NAN), p, r, NAN));
  zs_arena_free(&arena);
}

/* ---- Blocks, gradients, bounds --------------------------------------------------------- */

static void check_block(zs_eval *eval, uint64_t *state)
{
  enum { COUNT = 200 };
  float x[COUNT], y[COUNT], z[COUNT], f[COUNT], v[COUNT], g[3][COUNT];
  for (int i = 0; i < COUNT; i++) {
    x[i] = (float)random_between(state, -2.5, 2.5);
    y[i] = (float)random_between(state, -2.5, 2.5);
    z[i] = (float)random_between(state, -2.5, 2.5);
  }
  zs_eval_values(eval, NULL, COUNT, x, y, z, v);
  zs_eval_gradients(eval, NULL, COUNT, x, y, z, f, g[0], g[1], g[2]);
  for (int i = 0; i < COUNT; i++) {
    const double p[3] = {x[i], y[i], z[i]}, h = 1e-5, expected = zs_eval_point(eval, p);
    if (fabs(v[i] - expected) > 1e-4 || fabs(f[i] - expected) > 1e-4)
      fail_msg("at %g %g %g: %.9g, %.9g for %.9g (%s)", p[0], p[1], p[2], v[i], f[i], expected,
               zs_isa());
    for (int k = 0; k < 3; k++) {
      double a[3] = {x[i], y[i], z[i]}, b[3] = {x[i], y[i], z[i]};
      a[k] += h;
      b[k] -= h;
      const double difference = (zs_eval_point(eval, a) - zs_eval_point(eval, b)) / (2 * h);
      if (fabs(g[k][i] - difference) > 1e-3 * (1 + fabs(difference)))
        fail_msg("at %g %g %g: derivative %g for %g (%s)", p[0], p[1], p[2], g[k][i], difference,
                 zs_isa());
    }
  }
}

/* Enclosures hold what is in their boxes, and come nearer as these get smaller. */
static void check_bounds(zs_eval *eval, bool converging, uint64_t *state)
{
  for (int n = 0; n < 40; n++) {
    double lo[1][3], hi[1][3];
    const double size = exp(random_between(state, log(1e-3), log(4)));
    for (int k = 0; k < 3; k++) {
      lo[0][k] = random_between(state, -3, 2);
      hi[0][k] = lo[0][k] + size * random_between(state, 0.5, 1);
    }
    float least, most;
    zs_eval_bounds(eval, 1, (const double(*)[3])lo, (const double(*)[3])hi, &least, &most);
    assert_true(least <= most);
    if (converging && size < 0.01)
      assert_true(most - least < 0.01 * 38 * 6);
    for (int i = 0; i < 60; i++) {
      double p[3];
      for (int k = 0; k < 3; k++)
        p[k] = random_below(state, 4) ? random_between(state, lo[0][k], hi[0][k])
               : random_below(state, 2) ? lo[0][k] : hi[0][k];
      const double f = zs_eval_point(eval, p);
      if (!(f >= least && f <= most))
        fail_msg("%.9g at %g %g %g is outside of %.9g .. %.9g", f, p[0], p[1], p[2], least, most);
    }
  }
}

static void blocks_agree(void **unused)
{
  (void)unused;
  uint64_t state = 9;
  for (int t = 0; t < 12; t++) {
    zs_arena arena = {0}, *A = &arena;
    lattice l;
    random_lattice(&l, &state);
    random_moves(&l, 0.15, &state);
    setenv("ZEROSET_ISA", isas[t % 3], 1);
    zs_eval *eval =
      compiled(wrap(A, node_of(A, &l, t % 2 ? "inverse" : "push-forward"), telltale(A)));
    check_block(eval, &state);
    check_bounds(eval, true, &state);
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
  unsetenv("ZEROSET_ISA");
}

/* Where space folds over there is no inverse, but values are numbers within their bounds. */
static void folds_have_values(void **unused)
{
  (void)unused;
  uint64_t state = 10;
  for (int t = 0; t < 12; t++) {
    zs_arena arena = {0}, *A = &arena;
    lattice l;
    random_lattice(&l, &state);
    random_moves(&l, 2.5, &state);
    zs_eval *eval = compiled(wrap(A, node_of(A, &l, "push-forward"), telltale(A)));
    check_bounds(eval, false, &state);
    for (int i = 0; i < 100; i++) {
      double p[3];
      random_point(p, 3, &state);
      float x = (float)p[0], y = (float)p[1], z = (float)p[2], f, g[3];
      zs_eval_gradients(eval, NULL, 1, &x, &y, &z, &f, &g[0], &g[1], &g[2]);
      assert_true(isfinite(f) && isfinite(g[0]) && isfinite(g[1]) && isfinite(g[2]));
    }
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
}

/* ---- Solids ------------------------------------------------------------------------------ */

/* The solid is in its box, of which its own program finds one. */
static void boxes_hold_solids(void **unused)
{
  (void)unused;
  uint64_t state = 11;
  for (int t = 0; t < 20; t++) {
    zs_arena arena = {0}, *A = &arena;
    lattice l;
    random_lattice(&l, &state);
    random_moves(&l, 0.3, &state);
    zs_node *solid = set3(node_named(A, "box"), "size", 1.6, 1.2, 2);
    zs_node *node = wrap(A, node_of(A, &l, t % 2 ? "inverse" : "push-forward"), solid);
    const zs_box child = {{-0.8, -0.6, -1}, {0.8, 0.6, 1}}, box = node->kind->box(node, &child, 1);
    const zs_box found = zs_node_extent(node, NULL, NULL);
    assert_true(zs_box_is_finite(&box) && zs_box_is_finite(&found));
    zs_eval *eval = compiled(node);
    int inside = 0;
    for (int n = 0; n < 1000; n++) {
      double p[3];
      random_point(p, 2.5, &state);
      if (zs_eval_point(eval, p) < 0)
        continue;
      inside++;
      for (int k = 0; k < 3; k++)
        assert_true(p[k] >= box.lo[k] && p[k] <= box.hi[k] && p[k] >= found.lo[k] &&
                    p[k] <= found.hi[k]);
    }
    assert_true(inside > 5);
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
}

/* ---- Scenes --------------------------------------------------------------------------------- */

/* As the language's own example has it. */
static void scenes_are_read(void **unused)
{
  (void)unused;
  static const char *const scene =
    "<lattice-warp min='0 0 0' max='1 1 1' size='9 9 9' method='%s'>"
    "<drag from='0.5 0.5 0.9' to='0.5 0.55 0.95' radius='0.3'/><move control='4 4 8' by='0 0 0.02'/>"
    "<sphere radius='0.3' at='0.5 0.5 0.5'/><sphere radius='0.1' at='0.5 0.5 0.9'/></lattice-warp>";
  for (int t = 0; t < 2; t++) {
    char text[500];
    snprintf(text, sizeof text, scene, t ? "push-forward" : "inverse");
    assert_true(fabs(value_in(text, 0.5, 0.55, 0.95) - 0.1) < 1e-12);
    assert_true(value_in(text, 0.5, 0.5, 0.5) > 0.25);
  }
}

static void folds_are_pointed_out(void **unused)
{
  (void)unused;
  static const struct {
    const char *by;
    unsigned warnings;
  } cases[] = {{"0.3 0 0", 0}, {"0 0 -0.4", 0}, {"3.2 0 0", 0}, {"3.6 0 0", 1}, {"0 -9 0", 1}};
  for (size_t i = 0; i < ZS_COUNT_OF(cases); i++) {
    char text[300];
    snprintf(text, sizeof text, "<lattice-warp min='0 0 0' max='4 4 4' size='5'>"
             "<move control='2 2 2' by='%s'/><sphere/></lattice-warp>", cases[i].by);
    seen s = {.message = ""};
    zs_diag diag = {.report = keep, .context = &s};
    zs_scene *scene = parse(text, &diag);
    assert_non_null(scene);
    if (diag.warnings != cases[i].warnings)
      fail_msg("by %s: %u warnings: %s", cases[i].by, diag.warnings, s.message);
    assert_true(!cases[i].warnings || strstr(s.message, "folds over at"));
    zs_scene_free(scene);
  }
}

static void expect_error(const char *attributes, const char *parts, const char *message)
{
  char text[500];
  snprintf(text, sizeof text, "<lattice-warp %s>%s<sphere/></lattice-warp>", attributes, parts);
  const seen s = refusal(text);
  if (!strstr(s.message, message) || s.line != 2)
    fail_msg("%s: line %u: %s", text, s.line, s.message);
}

static void bad_input_is_refused(void **unused)
{
  (void)unused;
  static const char *const good = "min='0 0 0' max='1 1 1' size='4'";
  expect_error("max='1 1 1'", "", "missing");
  expect_error("min='0 0 0' max='1 0 1'", "", "0 is not greater than 'min'");
  expect_error("min='0 0 0' max='1 1 1e-320'", "", "");
  expect_error("min='-1e308 0 0' max='1e308 1 1'", "", "too far");
  expect_error("min='0 0 0' max='1 1 1' size='4 1 4'", "", "1 is not a whole number from 2 to 64");
  expect_error("min='0 0 0' max='1 1 1' size='4 4 65'", "", "65");
  expect_error("min='0 0 0' max='1 1 1' size='3.5'", "", "3.5");
  expect_error("min='0 0 0' max='1 1 1' size='1e300'", "", "1e+300");
  expect_error("min='0 0 0' max='1 1 1' method='forward'", "", "forward");
  expect_error("min='0 0 0' max='1 1 1' resolution='0'", "", "0");
  expect_error(good, "<move control='0 4 0' by='0 0 0'/>", "no control point 4 along y");
  expect_error(good, "<move control='0.5 0 0' by='0 0 0'/>", "no control point 0.5 along x");
  expect_error(good, "<move control='-1 0 0' by='0 0 0'/>", "-1");
  expect_error(good, "<move control='1e18 0 0' by='0 0 0'/>", "1e+18");
  expect_error(good, "<move control='0 0 0'/>", "missing");
  expect_error(good, "<drag from='0 0 0'/>", "missing");
  expect_error(good, "<drag from='0 0 0' to='9 0 0'/>", "two spacings or more away");
  expect_error(good, "<drag from='0 0 0' to='1e300 0 0'/>", "two spacings or more away");
  expect_error(good, "<drag from='0.5 0.5 0.5' to='0.5 0.5 0.5' radius='0.1'/>", "less than the");
  expect_error(good, "<drag from='0.5 0.5 0.5' to='0.5 0.5 0.5' radius='0'/>", "0");
  expect_error(good, "<drag from='0 0 0.5' to='0 0 0.4'/><drag from='0 0 0.5' to='0 0 0.4'/>"
               "<drag from='0.1 0 0.5' to='0 0 0.4'/>", "contradict");
  expect_error(good, "<pair from='0 0 0' to='0 0 0.4'/>", "only allowed in");
}

/* A grid of starting points that takes more than is allowed is refused. */
static void memory_is_limited(void **unused)
{
  (void)unused;
  static const char *const text =
    "<lattice-warp min='0 0 0' max='1 1 1' size='4' method='push-forward' resolution='%d'>"
    "<move control='1 1 1' by='0.1 0 0'/><sphere/></lattice-warp>";
  for (int t = 0; t < 2; t++) {
    char scene_text[300];
    seen s = {.message = ""};
    zs_diag diag = {.report = keep, .context = &s};
    const zs_control control = {.memory_limit = 1000000};
    snprintf(scene_text, sizeof scene_text, text, t ? 60 : 30);
    zs_scene *scene = parse(scene_text, &diag);
    assert_non_null(scene);
    zs_field *field = zs_scene_compile(scene, NULL, &control, &diag);
    assert_true((field == NULL) == t);
    assert_true(!t || strstr(s.message, "more than is allowed"));
    zs_field_unref(field);
    zs_scene_free(scene);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(maps_are_their_splines), cmocka_unit_test(no_moves_are_no_map),
    cmocka_unit_test(affine_moves_are_affine), cmocka_unit_test(methods_undo_each_other),
    cmocka_unit_test(joins_smoothly),         cmocka_unit_test(drags_land),
    cmocka_unit_test(moves_are_the_least),    cmocka_unit_test(repeated_drags),
    cmocka_unit_test(blocks_agree),           cmocka_unit_test(folds_have_values),
    cmocka_unit_test(boxes_hold_solids),      cmocka_unit_test(scenes_are_read),
    cmocka_unit_test(folds_are_pointed_out),  cmocka_unit_test(bad_input_is_refused),
    cmocka_unit_test(memory_is_limited),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
