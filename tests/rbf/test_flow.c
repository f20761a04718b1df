/* Flows: anchors are met at every s; few anchors and anchors on a line; bounds. */
#define _POSIX_C_SOURCE 200809L /* setenv */

#include "../random.h"

#include "field/compiler.h"
#include "field/program.h"
#include "rbf/flow.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MOST_PATHS = 40, MOST_POINTS = 5 };

typedef struct scene {
  size_t count;
  zs_flow_path paths[MOST_PATHS];
  double points[MOST_PATHS][2 * MOST_POINTS];
} scene;

static scene *straight(const double (*ends)[4], size_t count)
{
  scene *s = calloc(1, sizeof *s);
  assert_non_null(s);
  s->count = count;
  for (size_t i = 0; i < count; i++) {
    memcpy(s->points[i], ends[i], sizeof ends[i]);
    s->paths[i] = (zs_flow_path){2, s->points[i]};
  }
  return s;
}

/* Anchors on a jittered lattice, so that they do not come near to each other. */
static scene *lattice(size_t count, size_t points, uint64_t *state)
{
  scene *s = calloc(1, sizeof *s);
  assert_non_null(s);
  s->count = count;
  for (size_t i = 0; i < count; i++) {
    for (size_t k = 0; k < points; k++) {
      const double turn = 0.3 * (double)k, x = 10.0 * (double)(i % 6), y = 10.0 * (double)(i / 6);
      s->points[i][2 * k] = x * cos(turn) - y * sin(turn) + random_between(state, -2, 2);
      s->points[i][2 * k + 1] = x * sin(turn) + y * cos(turn) + random_between(state, -2, 2);
    }
    s->paths[i] = (zs_flow_path){points, s->points[i]};
  }
  return s;
}

static zs_flow *make(const scene *s, zs_flow_way way)
{
  zs_flow *flow;
  assert_int_equal(zs_flow_new(&flow, s->paths, s->count, way, NULL), ZS_FLOW_DONE);
  assert_non_null(flow);
  return flow;
}

/* The displacement in the caller's units. */
static void displacement(const zs_flow *flow, const double p[2], double s, double by[2])
{
  const double at[3] = {(p[0] - flow->middle[0]) / flow->size,
                        (p[1] - flow->middle[1]) / flow->size, s};
  for (int c = 0; c < 2; c++)
    by[c] = flow->size * zs_flow_value(flow, c, at, NULL);
}

/* Straight paths: the displacement of each anchor, wherever it is, is all of its way. */
static void check_anchors(const scene *s)
{
  zs_flow *flow = make(s, ZS_FLOW_COME);
  for (size_t i = 0; i < s->count; i++)
    for (int k = 0; k <= 100; k++) {
      const double t = k / 100.0, *p = s->points[i];
      const double at[2] = {(1 - t) * p[0] + t * p[2], (1 - t) * p[1] + t * p[3]};
      double by[2];
      displacement(flow, at, t, by);
      for (int c = 0; c < 2; c++)
        if (!(fabs(by[c] - (p[2 + c] - p[c])) < 1e-6 * flow->size))
          fail_msg("anchor %zu of %zu at %g: %g instead of %g", i, s->count, t, by[c],
                   p[2 + c] - p[c]);
    }
  zs_flow_free(flow);
}

static void test_anchors(void **unused)
{
  (void)unused;
  uint64_t state = 2;
  for (size_t count = 1; count <= 36; count += count < 6 ? 1 : 10) {
    scene *s = lattice(count, 2, &state);
    check_anchors(s);
    free(s);
  }
}

/* A point with another one on its heels; points on a line that becomes a curve; a triangle
 * that is turned over on its way, and so is a line for a moment. */
static void test_hard_anchors(void **unused)
{
  (void)unused;
  static const double near[][4] = {{0, 0, 9, 1}, {0.01, 0, 9.01, 1.005}, {-5, 4, -4, 3}};
  static const double line[][4] = {
    {0, 0, 0, 3}, {1, 0, 1, 1}, {2, 0, 2, 0}, {3, 0, 3, 1}, {4, 0, 4, 3}};
  static const double turned[][4] = {{0, 0, 0, 0}, {4, 0, 4, 0}, {2, 2, 2, -2}};
  static const double same[][4] = {{0, 0, 1, 1}, {0, 0, 1, 1}, {3, 0, 3, 1}, {0, 3, 1, 4}};
  scene *s[] = {straight(near, 3), straight(line, 5), straight(turned, 3), straight(same, 4)};
  for (int i = 0; i < 4; i++) {
    check_anchors(s[i]);
    free(s[i]);
  }
}

/* One anchor translates; two turn and scale all of the plane about them. */
static void test_few(void **unused)
{
  (void)unused;
  static const double ends[][4] = {{1, 2, 4, -2}, {3, 2, 4, 2}};
  uint64_t state = 7;
  for (size_t count = 1; count <= 2; count++) {
    scene *s = straight(ends, count);
    zs_flow *flow = make(s, ZS_FLOW_COME);
    for (int i = 0; i < 200; i++) {
      const double t = random_between(&state, 0, 1);
      const double p[2] = {random_between(&state, -9, 9), random_between(&state, -9, 9)};
      double by[2], expected[2] = {3, -4};
      displacement(flow, p, t, by);
      if (count == 2) {
        /* As complex numbers: d0 + (d1 - d0) (p - m0) / (m1 - m0). */
        const double m0[2] = {1 + 3 * t, 2 - 4 * t}, m1[2] = {3 + t, 2};
        const double ax = p[0] - m0[0], ay = p[1] - m0[1], bx = m1[0] - m0[0], by_ = m1[1] - m0[1];
        const double b2 = bx * bx + by_ * by_, qx = (ax * bx + ay * by_) / b2,
                     qy = (ay * bx - ax * by_) / b2;
        expected[0] += -2 * qx - 4 * qy;
        expected[1] += -2 * qy + 4 * qx;
      }
      for (int c = 0; c < 2; c++)
        assert_true(fabs(by[c] - expected[c]) < 1e-6 * (1 + fabs(expected[c])));
    }
    zs_flow_free(flow);
    free(s);
  }
}

/* Curved paths: come and to go, at the points of the curve. */
static void test_curves(void **unused)
{
  (void)unused;
  uint64_t state = 8;
  scene *s = lattice(13, 4, &state);
  zs_flow *come = make(s, ZS_FLOW_COME), *rest = make(s, ZS_FLOW_TO_GO);
  for (size_t i = 0; i < s->count; i++)
    for (int k = 0; k < 4; k++) {
      const double t = k / 3.0, *p = s->points[i], *at = p + 2 * k;
      double back[2], on[2];
      displacement(come, at, t, back);
      displacement(rest, at, t, on);
      for (int c = 0; c < 2; c++) {
        assert_true(fabs(at[c] - t * back[c] - p[c]) < 1e-6 * come->size);
        assert_true(fabs(at[c] + (1 - t) * on[c] - p[6 + c]) < 1e-6 * come->size);
      }
    }
  zs_flow_free(come);
  zs_flow_free(rest);
  free(s);
}

/* At rest the displacement is the same for all s. */
static void test_at_rest(void **unused)
{
  (void)unused;
  uint64_t state = 9;
  scene *s = lattice(8, 2, &state);
  for (int end = 0; end < 2; end++) {
    zs_flow *flow = make(s, end ? ZS_FLOW_AT_END : ZS_FLOW_AT_START);
    for (size_t i = 0; i < s->count; i++) {
      const double *p = s->points[i];
      double by[2];
      displacement(flow, p + 2 * end, 0.3, by);
      assert_true(fabs(by[0] - (p[2] - p[0])) < 1e-6 * flow->size);
      assert_true(fabs(by[1] - (p[3] - p[1])) < 1e-6 * flow->size);
    }
    zs_flow_free(flow);
  }
  free(s);
}

/* What cannot be followed is said. */
static void test_meetings(void **unused)
{
  (void)unused;
  static const double crossing[][4] = {{5, 5, 6, 6}, {0, 0, 4, 4}, {0, 4, 4, 0}};
  static const double apart[][4] = {{0, 0, 1, 0}, {0, 0, -1, 0}, {3, 3, 3, 3}};
  zs_flow *flow;
  zs_flow_meeting meeting;
  scene *s = straight(crossing, 3);
  assert_int_equal(zs_flow_new(&flow, s->paths, 3, ZS_FLOW_COME, &meeting), ZS_FLOW_MEET);
  assert_null(flow);
  assert_true(meeting.path[0] == 1 && meeting.path[1] == 2 && fabs(meeting.s - 0.5) < 0.02);
  /* They come from and go to places that differ: nothing is in the way at rest. */
  assert_int_equal(zs_flow_new(&flow, s->paths, 3, ZS_FLOW_AT_END, NULL), ZS_FLOW_DONE);
  zs_flow_free(flow);
  free(s);
  s = straight(apart, 3);
  assert_int_equal(zs_flow_new(&flow, s->paths, 3, ZS_FLOW_COME, &meeting), ZS_FLOW_MEET);
  assert_true(meeting.path[0] == 0 && meeting.path[1] == 1 && meeting.s < 0.02);
  free(s);
}

/* ---- The operation --------------------------------------------------------------------- */

/* Components, and what siblings are tested by: the first less the second. */
enum { BOTH = 2, RESULTS = 3 };

static double result_at(const zs_flow *flow, int result, const double at[3])
{
  return result == BOTH ? zs_flow_value(flow, 0, at, NULL) - zs_flow_value(flow, 1, at, NULL)
                        : zs_flow_value(flow, result, at, NULL);
}

static zs_eval *evaluator(const zs_flow *flow, int result)
{
  zs_compiler *c = zs_compiler_new(NULL, NULL, NULL);
  assert_non_null(c);
  zs_coordinates at = zs_coordinates_root();
  zs_value in[3], part[2];
  for (int k = 0; k < 3; k++)
    in[k] = zs_emit_coordinate(c, &at, k);
  for (int k = 0; k < 2; k++) {
    const zs_flow_part data = {.flow = flow, .component = k};
    if (result == k || result == BOTH)
      part[k] = zs_emit_operation(c, &zs_flow_operation, &data, in[0], in[1], in[2]);
  }
  zs_field *field = zs_compiler_finish(
    c, result == BOTH ? zs_emit(c, ZS_FUNCTION_SUBTRACT, part[0], part[1], 0) : part[result], 1);
  assert_non_null(field);
  const uint32_t first = 2 * ZS_COORDINATES; /* behind x, y and s */
  assert_int_equal(zs_program_siblings(zs_field_program(field), first), result == BOTH);
  zs_eval *eval = zs_eval_new(field, NULL);
  assert_non_null(eval);
  zs_field_unref(field);
  return eval;
}

enum { POINTS = 1000, APART = 300 /* with few points in a row at the same height */ };

static void test_blocks(void **unused)
{
  (void)unused;
  static const char *const isas[] = {"baseline", "avx2", "avx512"};
  static float x[POINTS], y[POINTS], z[POINTS], f[POINTS], g[4][POINTS];
  uint64_t state = 10;
  for (int i = 0; i < 9; i++) {
    setenv("ZEROSET_ISA", isas[i % 3], 1);
    scene *s = lattice(i < 3 ? 2 : 11, i < 6 ? 2 : 4, &state);
    zs_flow *flow = make(s, ZS_FLOW_COME);
    const int result = i / 3 % RESULTS;
    zs_eval *eval = evaluator(flow, result);
    for (int j = 0; j < POINTS; j++) {
      x[j] = (float)random_between(&state, -2, 2);
      y[j] = (float)random_between(&state, -2, 2);
      z[j] = j % 7 || j > APART ? z[j - 1] : (float)random_between(&state, -0.1, 1.1);
    }
    z[50] = NAN;
    zs_eval_values(eval, NULL, POINTS, x, y, z, f);
    zs_eval_gradients(eval, NULL, POINTS, x, y, z, g[0], g[1], g[2], g[3]);
    for (int j = 0; j < POINTS; j++) {
      const double at[3] = {(double)x[j], (double)y[j], (double)z[j]}, h = 1e-6;
      if (isnan(z[j])) {
        assert_true(isnan(f[j]) && isnan(g[0][j]));
        continue;
      }
      const double expected = result_at(flow, result, at);
      assert_true(fabs((double)f[j] - expected) < 1e-6 * (1 + fabs(expected)));
      assert_true(fabs((double)g[0][j] - expected) < 1e-6 * (1 + fabs(expected)));
      for (int k = 0; k < 3; k++) {
        double before[3], after[3];
        memcpy(before, at, sizeof at);
        memcpy(after, at, sizeof at);
        before[k] -= h;
        after[k] += h;
        if (k == 2 && (fabs(at[2]) < 2 * h || fabs(at[2] - 1) < 2 * h))
          continue;
        const double slope = (result_at(flow, result, after) -
                              result_at(flow, result, before)) / (2 * h);
        if (!(fabs((double)g[k + 1][j] - slope) < 1e-3 * (1 + fabs(slope))))
          fail_msg("at %g %g %g: slope %d is %g, differences %g", at[0], at[1], at[2], k,
                   (double)g[k + 1][j], slope);
      }
    }
    zs_eval_free(eval);
    zs_flow_free(flow);
    free(s);
  }
  unsetenv("ZEROSET_ISA");
}

enum { BOXES = 48 };

/* f at places in boxes is where it is said to be. */
static void check_boxes(zs_eval *eval, const zs_flow *flow, int result,
                        const double lo[BOXES][3], const double hi[BOXES][3], uint64_t *state)
{
  enum { SAMPLES = 60 };
  float f_lo[BOXES], f_hi[BOXES];
  zs_eval_bounds(eval, BOXES, lo, hi, f_lo, f_hi);
  for (int b = 0; b < BOXES; b++)
    for (int j = 0; j < SAMPLES; j++) {
      double p[3];
      for (int k = 0; k < 3; k++)
        p[k] = random_below(state, 3) ? random_between(state, lo[b][k], hi[b][k])
               : random_below(state, 2) ? lo[b][k] : hi[b][k];
      const double f = result_at(flow, result, p);
      if (!(f >= (double)f_lo[b] && f <= (double)f_hi[b]))
        fail_msg("%zu centres: %g at %g %g %g is not in %g .. %g", flow->centres, f, p[0], p[1],
                 p[2], (double)f_lo[b], (double)f_hi[b]);
    }
}

/* Boxes of all sizes, sixteen together, with heights in several intervals. */
static void check_bounds(zs_eval *eval, const zs_flow *flow, int result, uint64_t *state)
{
  double lo[BOXES][3], hi[BOXES][3];
  for (int b = 0; b < BOXES; b++)
    for (int k = 0; k < 3; k++) {
      lo[b][k] = random_between(state, k < 2 ? -2 : -0.1, k < 2 ? 2 : 1);
      hi[b][k] = lo[b][k] + exp(random_between(state, -7, k < 2 ? 1 : -1));
    }
  check_boxes(eval, flow, result, (const double(*)[3])lo, (const double(*)[3])hi, state);
}

/* The same within the box that the program has been restricted to. */
static void check_bounds_within(zs_eval *eval, const zs_flow *flow, int result,
                                const double lo[3], const double hi[3], uint64_t *state)
{
  double from[BOXES][3], to[BOXES][3];
  for (int b = 0; b < BOXES; b++)
    for (int k = 0; k < 3; k++) {
      from[b][k] = random_between(state, lo[k], hi[k]);
      to[b][k] = b % 4 ? random_between(state, from[b][k], hi[k]) : hi[k];
      from[b][k] = b % 8 ? from[b][k] : lo[k];
    }
  check_boxes(eval, flow, result, (const double(*)[3])from, (const double(*)[3])to, state);
}

/* How much wider bounds of small boxes among the anchors are than what f is there, in the
 * geometric mean. */
static double mean_excess(zs_eval *eval, const zs_flow *flow, int result, uint64_t *state)
{
  enum { SAMPLES = 64 };
  double lo[BOXES][3], hi[BOXES][3], sum = 0;
  float f_lo[BOXES], f_hi[BOXES];
  for (int b = 0; b < BOXES; b++)
    for (int k = 0; k < 3; k++) {
      lo[b][k] = k < 2 ? random_between(state, -0.5, 0.5) : random_between(state, 0.1, 0.8);
      hi[b][k] = lo[b][k] + 0.06;
    }
  zs_eval_bounds(eval, BOXES, (const double(*)[3])lo, (const double(*)[3])hi, f_lo, f_hi);
  for (int b = 0; b < BOXES; b++) {
    double least = INFINITY, most = -INFINITY;
    for (int j = 0; j < SAMPLES; j++) {
      double p[3];
      for (int k = 0; k < 3; k++)
        p[k] = j < 8 ? (j >> k & 1 ? hi : lo)[b][k] : random_between(state, lo[b][k], hi[b][k]);
      const double f = result_at(flow, result, p);
      least = fmin(least, f);
      most = fmax(most, f);
    }
    sum += log(((double)f_hi[b] - (double)f_lo[b]) / (most - least));
  }
  return exp(sum / BOXES);
}

static void test_bounds(void **unused)
{
  (void)unused;
  static const char *const isas[] = {"baseline", "avx2", "avx512"};
  uint64_t state = 12;
  for (int i = 0; i < 12; i++) {
    setenv("ZEROSET_ISA", isas[i % 3], 1);
    scene *s = lattice(i < 2 ? 1 + (size_t)i : 3 + 2 * (size_t)i, i < 6 ? 2 : 4, &state);
    zs_flow *flow = make(s, ZS_FLOW_COME);
    const int result = i / 3 % RESULTS;
    zs_eval *eval = evaluator(flow, result);
    for (int k = 0; k < 6; k++)
      check_bounds(eval, flow, result, &state);
    /* Narrow boxes have narrow bounds; where a box is not known nor is f. */
    const double lo[2][3] = {{0.3, -0.2, 0.4}, {-INFINITY, 0, 0}};
    const double hi[2][3] = {{0.302, -0.198, 0.402}, {1, 1, 1}};
    float f_lo[2], f_hi[2];
    zs_eval_bounds(eval, 2, lo, hi, f_lo, f_hi);
    if (!(f_hi[0] - f_lo[0] < 0.1f))
      fail_msg("%zu anchors: %g .. %g", s->count, (double)f_lo[0], (double)f_hi[0]);
    assert_true(isnan(f_lo[1]) && isnan(f_hi[1]));
    /* Second derivatives of many centres all but cancel each other: one by one, they would make
     * bounds four times as wide as f. */
    if (i >= 2 && i < 6) {
      const double excess = mean_excess(eval, flow, result, &state);
      if (!(excess < 2))
        fail_msg("%zu anchors: bounds are %g times as wide as f", s->count, excess);
    }
    zs_eval_free(eval);
    zs_flow_free(flow);
    free(s);
  }
  unsetenv("ZEROSET_ISA");
}

/* Within a box a flow is what it is, whether or not it is shorter there; in most small boxes
 * it is, but not across a corner of a path, nor where terms are far larger than their sum. */
static void test_regions(void **unused)
{
  (void)unused;
  enum { REGIONS = 60, SAMPLES = 48 };
  static const char *const isas[] = {"baseline", "avx2", "avx512"};
  static float x[SAMPLES], y[SAMPLES], z[SAMPLES], f[SAMPLES];
  uint64_t state = 13, boxes = 14;
  zs_arena arena = {0};
  unsigned shorter = 0, all = 0;
  for (int i = 0; i < 12; i++) {
    setenv("ZEROSET_ISA", isas[i % 3], 1);
    scene *s = lattice(1 + 2 * (size_t)i, i < 6 ? 2 : 4, &state);
    zs_flow *flow = make(s, i % 4 < 2 ? ZS_FLOW_COME : ZS_FLOW_TO_GO);
    const int result = i / 3 % RESULTS;
    zs_eval *eval = evaluator(flow, result);
    const zs_flow_part part = {.flow = flow, .component = result % BOTH};
    for (int b = 0; b < REGIONS; b++) {
      double lo[3], hi[3];
      float low[3], high[3];
      for (int k = 0; k < 3; k++) {
        lo[k] = random_between(&state, k < 2 ? -1.5 : -0.1, k < 2 ? 1.5 : 1.1);
        hi[k] = lo[k] + (b % 5 || k < 2 ? exp(random_between(&state, -7, -1.5)) : 0);
        low[k] = (float)lo[k];
        high[k] = (float)hi[k];
      }
      const zs_flow_part *own = zs_flow_restricted(&part, low, high, &arena);
      shorter += own->local != NULL;
      all++;
      assert_true(zs_eval_restrict(eval, lo, hi, ZS_REQUEST_VALUE));
      for (int j = 0; j < SAMPLES; j++) {
        x[j] = (float)random_between(&state, lo[0], hi[0]);
        y[j] = (float)random_between(&state, lo[1], hi[1]);
        z[j] = j % 3 ? (float)random_between(&state, lo[2], hi[2]) : j % 2 ? low[2] : high[2];
      }
      zs_eval_values(eval, NULL, SAMPLES, x, y, z, f);
      for (int j = 0; j < SAMPLES; j++) {
        const double at[3] = {(double)x[j], (double)y[j], (double)z[j]};
        const double expected = result_at(flow, result, at);
        if (!(fabs((double)f[j] - expected) < 2e-6 * (1 + fabs(expected))))
          fail_msg("%zu centres at %g %g %g: %.9g instead of %.9g", flow->centres, at[0], at[1],
                   at[2], (double)f[j], expected);
      }
      check_bounds_within(eval, flow, result, lo, hi, &boxes);
      zs_eval_release(eval);
    }
    zs_eval_free(eval);
    zs_flow_free(flow);
    free(s);
  }
  if (!(shorter > all * 2 / 5 && shorter < all))
    fail_msg("%u of %u boxes have shorter polynomials", shorter, all);
  static const double near[][4] = {{0, 0, 9, 1}, {0.01, 0, 9.01, 1.005}, {-5, 4, -4, 3}};
  const float lo[3] = {-0.1f, -0.1f, 0.3f}, hi[3] = {0, 0, 0.31f};
  const float far_lo[3] = {90, 90, 0.3f}, far_hi[3] = {90.1f, 90.1f, 0.31f};
  scene *s = straight(near, 3);
  zs_flow *flow = make(s, ZS_FLOW_COME);
  const zs_flow_part part = {.flow = flow};
  assert_ptr_equal(zs_flow_restricted(&part, lo, hi, &arena), &part);
  assert_ptr_equal(zs_flow_restricted(&part, far_lo, far_hi, &arena), &part);
  zs_flow_free(flow);
  free(s);
  zs_arena_free(&arena);
  unsetenv("ZEROSET_ISA");
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_anchors),  cmocka_unit_test(test_hard_anchors),
    cmocka_unit_test(test_few),      cmocka_unit_test(test_curves),
    cmocka_unit_test(test_at_rest),  cmocka_unit_test(test_meetings),
    cmocka_unit_test(test_blocks),   cmocka_unit_test(test_bounds),
    cmocka_unit_test(test_regions),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
