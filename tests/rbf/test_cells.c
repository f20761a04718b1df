/* Cells of radial sums against the sums themselves. */
#include "../random.h"

#include "field/program.h"
#include "rbf/cells.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

typedef enum layout {
  SPHERE,
  VOLUME,
  CLUSTERS,
  PLANE,
  LINE,
  LAYOUTS
} layout;

static void place(layout kind, uint64_t *seed, double p[3])
{
  double length = 0;
  for (int k = 0; k < 3; k++)
    p[k] = random_between(seed, -0.5, 0.5);
  switch (kind) {
  case SPHERE:
    for (int k = 0; k < 3; k++)
      length += p[k] * p[k];
    for (int k = 0; k < 3; k++)
      p[k] *= 0.45 / sqrt(length);
    break;
  case CLUSTERS:
    for (int k = 0; k < 3; k++)
      p[k] = (k == (int)random_below(seed, 3) ? 0.4 : -0.4) + p[k] * fabs(p[k]) / 5;
    break;
  case PLANE:
    p[1] = 0.1;
    break;
  case LINE:
    p[0] = p[1] = 0;
    break;
  default:
    break;
  }
}

/* Neighbours of opposite signs, as fits have, or weights at random; a polynomial. */
static zs_rbf_terms terms_of(layout kind, zs_rbf_kernel kernel, size_t count, double lift,
                             uint64_t seed)
{
  zs_rbf_terms terms = {.radial = {kernel, 100}, .count = count,
                        .centres = malloc(count * sizeof *terms.centres)};
  assert_non_null(terms.centres);
  for (size_t j = 0; j < count; j++) {
    double p[3];
    place(kind, &seed, p);
    terms.centres[j] = (zs_rbf_centre){p[0], p[1], p[2], lift * random_between(&seed, 0, 1),
                                       random_between(&seed, -1, 1)};
  }
  for (int k = 0; k < 10; k++)
    terms.polynomial[k] = random_between(&seed, -1, 1);
  return terms;
}

/* What f varies over the centres. */
static double range_of(const zs_rbf_terms *terms)
{
  double lo = INFINITY, hi = -INFINITY;
  for (size_t j = 0; j < terms->count; j += terms->count / 40 + 1) {
    const zs_rbf_centre *c = &terms->centres[j];
    const double f = zs_rbf_terms_value(terms, (double[3]){c->x, c->y, c->z});
    lo = fmin(lo, f);
    hi = fmax(hi, f);
  }
  return hi - lo;
}

/* Points on and near centres, and a few anywhere in the cube. */
static void choose_points(const zs_rbf_terms *terms, double point[3][ZS_BLOCK], uint64_t *seed)
{
  for (unsigned i = 0; i < ZS_BLOCK; i++) {
    const zs_rbf_centre *c = &terms->centres[random_below(seed, (unsigned)terms->count)];
    const double away = i % 4 ? exp(random_between(seed, log(1e-4), log(0.02))) : 0;
    const double middle[3] = {c->x, c->y, c->z};
    for (int k = 0; k < 3; k++)
      point[k][i] = i % 16 == 15 ? random_between(seed, -5, 5)
                                 : middle[k] + away * random_between(seed, -1, 1);
  }
}

static zs_control threads_only(unsigned threads)
{
  zs_control control;
  zs_control_init(&control);
  control.threads = threads;
  return control;
}

/* Values, and derivatives against differences of the sum. */
static void compare(const zs_rbf_terms *terms, double tolerance, unsigned threads, uint64_t *seed)
{
  static double point[3][ZS_BLOCK], exact[ZS_BLOCK], sum[4][ZS_BLOCK], value[1][ZS_BLOCK];
  const zs_control control = threads_only(threads);
  zs_rbf_cells *cells = zs_rbf_cells_new(terms, tolerance, &control, NULL);
  assert_non_null(cells);
  choose_points(terms, point, seed);
  zs_rbf_terms_values(terms, ZS_BLOCK, point, exact);
  const zs_cells_kernels *kernels = zs_cells_select(terms->radial.kernel);
  kernels->evaluate(cells, terms, ZS_BLOCK, (const double(*)[ZS_BLOCK])point, sum, true);
  kernels->evaluate(cells, terms, ZS_BLOCK, (const double(*)[ZS_BLOCK])point, value, false);
  double rounding = 0;
  for (size_t j = 0; j < terms->count; j++)
    rounding += 1e-15 * fabs(terms->centres[j].weight);
  for (unsigned i = 0; i < ZS_BLOCK; i++) {
    const double x[3] = {point[0][i], point[1][i], point[2][i]};
    const bool anywhere = i % 16 == 15;
    const double allowed = anywhere ? 1e-5 * fabs(exact[i]) + 5e3 * tolerance : tolerance;
    assert_true(fabs(value[0][i] - exact[i]) <= allowed + rounding);
    assert_true(fabs(sum[0][i] - value[0][i]) <= rounding + 1e-13 * fabs(exact[i]));
    assert_true(fabs(zs_rbf_cells_value(cells, terms, x) - value[0][i]) <=
                rounding + 1e-13 * fabs(exact[i]));
    for (int k = 0; !anywhere && i % 4 && k < 3; k++) {
      const double h = 1e-6;
      double p[3] = {x[0], x[1], x[2]}, q[3] = {x[0], x[1], x[2]};
      p[k] += h;
      q[k] -= h;
      const double slope =
        (zs_rbf_terms_value(terms, p) - zs_rbf_terms_value(terms, q)) / (2 * h);
      /* Sums of r have kinks. */
      if (terms->radial.kernel != ZS_RBF_R)
        assert_true(fabs(sum[k + 1][i] - slope) <= 2e3 * tolerance + 1e-5 * fabs(slope));
    }
  }
  zs_rbf_cells_free(cells);
}

static void cells_equal_sums(void **state)
{
  (void)state;
  uint64_t seed = 6;
  for (int kernel = 0; kernel < ZS_RBF_KERNEL_COUNT; kernel++)
    for (int kind = 0; kind < LAYOUTS; kind++) {
      if (kernel != ZS_RBF_R3 && kind != SPHERE)
        continue;
      zs_rbf_terms terms =
        terms_of((layout)kind, (zs_rbf_kernel)kernel, 2000, 0, random_bits(&seed));
      compare(&terms, 1e-6 * range_of(&terms), 2, &seed);
      free(terms.centres);
    }
}

static void cells_of_slices_equal_sums(void **state)
{
  (void)state;
  uint64_t seed = 8;
  for (int kernel = 0; kernel < ZS_RBF_KERNEL_COUNT; kernel++) {
    zs_rbf_terms terms =
      terms_of(SPHERE, (zs_rbf_kernel)kernel, 1000, kernel % 2 ? 0.5 : 0.01, random_bits(&seed));
    compare(&terms, 1e-6 * range_of(&terms), 2, &seed);
    free(terms.centres);
  }
}

/* Few centres are one leaf; a tolerance that cannot be had costs time, not
 * accuracy. */
static void extremes_work(void **state)
{
  (void)state;
  uint64_t seed = 2;
  for (size_t count = 1; count < 700; count = 7 * count + 1) {
    zs_rbf_terms terms = terms_of(VOLUME, ZS_RBF_R3, count, 0, count);
    compare(&terms, 1e-6, 1, &seed);
    free(terms.centres);
  }
  zs_rbf_terms terms = terms_of(SPHERE, ZS_RBF_R5, 700, 0, 3);
  compare(&terms, 1e-20, 2, &seed);
  free(terms.centres);
}

/* The number of threads changes nothing. */
static void threads_make_the_same_cells(void **state)
{
  (void)state;
  zs_rbf_terms terms = terms_of(SPHERE, ZS_RBF_R, 1500, 0, 3);
  const zs_control alone = threads_only(1), many = threads_only(3);
  zs_rbf_cells *one = zs_rbf_cells_new(&terms, 1e-6, &alone, NULL);
  zs_rbf_cells *three = zs_rbf_cells_new(&terms, 1e-6, &many, NULL);
  assert_int_equal(one->count, three->count);
  assert_int_equal(one->bytes, three->bytes);
  assert_true(one->count > 100);
  for (size_t i = 0; i < one->count; i++) {
    const zs_rbf_cell *a = &one->cells[i], *b = &three->cells[i];
    assert_int_equal(a->children, b->children);
    assert_int_equal(a->order, b->order);
    assert_int_equal(a->near_count, b->near_count);
    if (a->children)
      continue;
    assert_memory_equal(a->near, b->near, a->near_count * sizeof *a->near);
    assert_memory_equal(a->polynomial, b->polynomial,
                        a->order * zs_cells_stride(a->order) * sizeof *a->polynomial);
  }
  zs_rbf_cells_free(one);
  zs_rbf_cells_free(three);
  free(terms.centres);
}

/* A callback that is called in time, from the thread that began, and ends it. */
typedef struct caller {
  unsigned calls, most;
  double latest;
} caller;

static bool count_calls(void *context, const char *stage, double fraction)
{
  caller *c = context;
  assert_string_equal(stage, "cells");
  assert_true(fraction >= c->latest && fraction <= 1);
  c->latest = fraction;
  return ++c->calls < c->most;
}

static void can_be_cancelled(void **state)
{
  (void)state;
  zs_rbf_terms terms = terms_of(SPHERE, ZS_RBF_R3, 1500, 0, 3);
  caller c = {.most = 1u << 30};
  zs_control control = threads_only(2);
  control.progress = count_calls;
  control.context = &c;
  zs_rbf_cells_free(zs_rbf_cells_new(&terms, 1e-6, &control, NULL));
  assert_true(c.calls > 20);
  for (unsigned most = 1; most < c.calls; most = 3 * most + 1) {
    caller few = {.most = most};
    zs_diag diag = {0};
    control.context = &few;
    assert_null(zs_rbf_cells_new(&terms, 1e-6, &control, &diag));
    assert_int_equal(few.calls, most);
    assert_int_equal(diag.status, ZS_CANCELLED);
    assert_int_equal(diag.errors, 1);
  }
  free(terms.centres);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(cells_equal_sums),
    cmocka_unit_test(cells_of_slices_equal_sums),
    cmocka_unit_test(extremes_work),
    cmocka_unit_test(threads_make_the_same_cells),
    cmocka_unit_test(can_be_cancelled),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
