/* Fits of so many constraints that they are solved by iterations. */
#include "clouds.h"

#include "rbf/solve.h"

enum { COUNT = 900 };

static double random_difference(const zs_rbf *rbf, const zs_rbf *other, unsigned dimension)
{
  uint64_t seed = 8;
  double worst = 0;
  for (int i = 0; i < 50; i++) {
    double x[ZS_RBF_MAXIMUM_DIMENSION];
    for (unsigned k = 0; k < dimension; k++)
      x[k] = random_between(&seed, -1, 1);
    worst = fmax(worst, fabs(zs_rbf_value(rbf, x) - zs_rbf_value(other, x)));
  }
  return worst;
}

/* The largest of what a fit misses its constraints by, found independently. */
static double miss(const zs_rbf *rbf, const cloud *c)
{
  double worst = 0;
  for (size_t i = 0; i < c->problem.count; i++)
    worst = fmax(worst, fabs(zs_rbf_value(rbf, c->positions + i * rbf->dimension) - c->values[i]));
  return worst;
}

static void agrees_with_bordered_system(void **state)
{
  (void)state;
  for (unsigned dimension = 2; dimension <= 5; dimension++)
    for (int kernel = 0; kernel < ZS_RBF_KERNEL_COUNT; kernel++) {
      const unsigned order = zs_rbf_order((zs_rbf_kernel)kernel);
      const unsigned degree = order > 2 ? order - 1 : 1;
      cloud *c = random_cloud(dimension, (zs_rbf_kernel)kernel, COUNT, 31 + (unsigned)kernel);
      c->problem.tolerance = 1e-8;
      zs_rbf *rbf = fitted(c);
      assert_true(rbf->residual < 1e-7);
      assert_true(fabs(rbf->residual - miss(rbf, c)) < 1e-9);
      assert_true(difference_from_bordered(rbf, c, degree, 1) < 1e-6);
      zs_rbf_free(rbf);
      free(c);
    }
}

/* As many as are solved by any such factorisation; a few of all kernels and dimensions. */
static void many_agree_with_bordered_system(void **state)
{
  (void)state;
  static const struct {
    unsigned dimension;
    zs_rbf_kernel kernel;
    unsigned degree;
  } cases[] = {{2, ZS_RBF_TPS2, 1}, {3, ZS_RBF_R, 1},    {3, ZS_RBF_R3, 1},
               {3, ZS_RBF_R5, 2},   {4, ZS_RBF_TPS4, 2}, {5, ZS_RBF_GAUSSIAN, 1}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    cloud *c = random_cloud(cases[i].dimension, cases[i].kernel, CLOUD_MAXIMUM, 3 + i);
    c->problem.tolerance = 1e-8;
    zs_rbf *rbf = fitted(c);
    assert_true(difference_from_bordered(rbf, c, cases[i].degree, 1) < 1e-6);
    zs_rbf_free(rbf);
    free(c);
  }
}

/* The kernels that are used most are solved by iterations where they should be. */
static void iterations_serve(void **state)
{
  (void)state;
  static const zs_rbf_kernel usual[] = {ZS_RBF_R, ZS_RBF_R3, ZS_RBF_TPS2};
  for (unsigned dimension = 2; dimension <= 5; dimension++)
    for (size_t k = 0; k < 3; k++) {
      cloud *c = random_cloud(dimension, usual[k], 2000, 5);
      zs_rbf *rbf = fitted(c);
      assert_string_equal(rbf->method, "iterative");
      assert_true(rbf->residual <= 1e-6 * 5);
      assert_true(miss(rbf, c) < 1e-5);
      zs_rbf_free(rbf);
      free(c);
    }
}

static void smoothing_is_the_direct_one(void **state)
{
  (void)state;
  cloud *c = random_cloud(3, ZS_RBF_R3, COUNT, 14);
  uint64_t seed = 6;
  for (size_t i = 0; i < COUNT; i++)
    c->values[i] += random_between(&seed, -0.1, 0.1);
  c->problem.tolerance = 1e-9;
  c->problem.smoothing = 1e-3;
  zs_rbf *rbf = fitted(c);
  assert_string_equal(rbf->method, "iterative");
  assert_true(difference_from_bordered(rbf, c, 1, 1) < 1e-6);
  assert_true(fabs(rbf->residual - miss(rbf, c)) < 1e-9);
  zs_rbf_free(rbf);
  free(c);
}

/* Many points, with values. */
typedef struct crowd {
  size_t count;
  double *positions, *values;
} crowd;

/* In a cube or on a sphere. */
static crowd random_crowd(size_t count, bool sphere)
{
  crowd c = {count, malloc(3 * count * sizeof(double)), malloc(count * sizeof(double))};
  assert_non_null(c.positions);
  assert_non_null(c.values);
  uint64_t seed = 19;
  for (size_t i = 0; i < count; i++) {
    double *at = c.positions + 3 * i, square = 0;
    for (size_t k = 0; k < 3; k++) {
      at[k] = random_between(&seed, -1, 1);
      square += at[k] * at[k];
    }
    for (size_t k = 0; sphere && k < 3; k++)
      at[k] /= sqrt(square);
    c.values[i] = smooth(3, at);
  }
  return c;
}

static void clear_crowd(crowd *c)
{
  free(c->positions);
  free(c->values);
}

/* Every so many constraints are as near as the residual says. */
static void assert_met(const zs_rbf *rbf, const crowd *c, size_t every)
{
  for (size_t i = 0; i < c->count; i += every)
    assert_true(fabs(zs_rbf_value(rbf, c->positions + 3 * i) - c->values[i]) <=
                rbf->residual + 1e-9);
}

/* So many that products take clusters together. */
static void large_fits_meet_their_constraints(void **state)
{
  (void)state;
  enum { MANY = 13000 };
  crowd c = random_crowd(MANY, false);
  const zs_rbf_problem problem = {.dimension = 3, .kernel = ZS_RBF_R, .count = MANY,
                                  .positions = c.positions, .values = c.values};
  zs_diag diag = {0};
  zs_rbf *rbf = zs_rbf_fit(&problem, NULL, NULL, &diag);
  assert_non_null(rbf);
  assert_string_equal(rbf->method, "iterative");
  assert_int_equal(diag.warnings, 0);
  assert_met(rbf, &c, 97);
  assert_true(rbf->residual < 4e-6);
  zs_rbf_free(rbf);
  clear_crowd(&c);
}

/* Counts the steps after the preconditioner is there. */
static bool count_step(void *context, const char *stage, double fraction)
{
  unsigned *steps = context;
  (void)stage;
  *steps += fraction > 0.2; /* 0.4 of the half that iterations are */
  return true;
}

/* So many that the preconditioner has a level between the first and the last: it has to do as
 * well as a direct solution there, which takes 5 steps. */
static void levels_in_the_middle_serve(void **state)
{
  (void)state;
  enum { MANY = 53000 };
  crowd c = random_crowd(MANY, true);
  unsigned steps = 0;
  zs_control control;
  memset(&control, 0, sizeof control);
  control.progress = count_step;
  control.context = &steps;
  zs_rbf *rbf = zs_rbf_fit(&(zs_rbf_problem){.dimension = 3, .kernel = ZS_RBF_R, .count = MANY,
                                             .positions = c.positions, .values = c.values,
                                             .tolerance = 1e-4},
                           &control, NULL, NULL);
  assert_non_null(rbf);
  assert_true(steps <= 10);
  assert_met(rbf, &c, 997);
  zs_rbf_free(rbf);
  clear_crowd(&c);
}

/* ---- Invariance ----------------------------------------------------------------------- */

static void order_does_not_matter(void **state)
{
  (void)state;
  cloud *c = random_cloud(3, ZS_RBF_R3, COUNT, 21), *other = random_cloud(3, ZS_RBF_R3, COUNT, 21);
  for (size_t i = 0; i < COUNT; i++) {
    const size_t j = (i * 377 + 5) % COUNT;
    memcpy(other->positions + 3 * i, c->positions + 3 * j, 3 * sizeof(double));
    other->values[i] = c->values[j];
  }
  c->problem.tolerance = other->problem.tolerance = 1e-8;
  zs_rbf *rbf = fitted(c), *again = fitted(other);
  assert_true(random_difference(rbf, again, 3) < 1e-6);
  zs_rbf_free(rbf);
  zs_rbf_free(again);
  free(c);
  free(other);
}

static void follows_similarities(void **state)
{
  (void)state;
  static const double scales[] = {1, 1000, 0.001};
  const double a = cos(0.7), b = sin(0.7), shift[3] = {100, -20, 300};
  for (int kernel = 0; kernel < ZS_RBF_KERNEL_COUNT; kernel++)
    for (int s = 0; s < 3; s++) {
      cloud *c = random_cloud(3, (zs_rbf_kernel)kernel, COUNT, 21);
      c->problem.tolerance = 1e-8;
      zs_rbf *rbf = fitted(c);
      const cloud before = *c;
      for (size_t i = 0; i < COUNT; i++) {
        const double *p = before.positions + 3 * i;
        double *q = c->positions + 3 * i;
        q[0] = scales[s] * (a * p[0] - b * p[1] + shift[0]);
        q[1] = scales[s] * (b * p[0] + a * p[1] + shift[1]);
        q[2] = scales[s] * (p[2] + shift[2]);
      }
      c->problem.sigma *= scales[s];
      zs_rbf *moved = fitted(c);
      uint64_t seed = 2;
      for (int i = 0; i < 50; i++) {
        double x[3];
        for (int k = 0; k < 3; k++)
          x[k] = random_between(&seed, -1, 1);
        const double y[3] = {scales[s] * (a * x[0] - b * x[1] + shift[0]),
                             scales[s] * (b * x[0] + a * x[1] + shift[1]),
                             scales[s] * (x[2] + shift[2])};
        assert_true(fabs(zs_rbf_value(rbf, x) - zs_rbf_value(moved, y)) < 1e-6);
      }
      zs_rbf_free(rbf);
      zs_rbf_free(moved);
      free(c);
    }
}

/* ---- Hostile sets ----------------------------------------------------------------------- */

/* A plane, a line, and points that get ever denser: a fit meets its constraints,
 * or says that it does not. */
static void place_points(cloud *c, int shape)
{
  uint64_t seed = 15;
  for (size_t i = 0; i < c->problem.count; i++) {
    double *p = c->positions + 3 * i;
    const double s = random_between(&seed, -1, 1), t = random_between(&seed, -1, 1);
    const double shrink = exp(-random_between(&seed, 0, 5));
    for (int k = 0; k < 3; k++)
      p[k] = shape == 2 ? p[k] * shrink : (k + 1) * s + (shape == 1 ? 0 : (k * k - 1) * t);
    c->values[i] = smooth(3, p);
  }
}

static void hostile_sets_are_fitted(void **state)
{
  (void)state;
  static const zs_rbf_kernel usual[] = {ZS_RBF_R, ZS_RBF_R3, ZS_RBF_TPS2};
  for (int shape = 0; shape < 3; shape++)
    for (size_t k = 0; k < 3; k++) {
      cloud *c = random_cloud(3, usual[k], COUNT, 15);
      place_points(c, shape);
      zs_diag diag = {0};
      zs_rbf *rbf = zs_rbf_fit(&c->problem, NULL, NULL, &diag);
      /* r^3 on a thousand points of a line is at the end of double precision. */
      const bool hard = shape == 1 && usual[k] == ZS_RBF_R3;
      assert_true(rbf || hard);
      if (rbf) {
        assert_true(rbf->residual < 5 * 1e-6 || diag.warnings == 1);
        assert_true(fabs(rbf->residual - miss(rbf, c)) < 1e-8 + 0.1 * rbf->residual);
      } else {
        assert_int_equal(diag.status, ZS_ERROR_UNABLE);
      }
      zs_rbf_free(rbf);
      free(c);
    }
}

/* Dense on one small sphere, and few points far from it and from each other: each of those is
 * as important for what is smooth as all of the sphere. */
static void few_points_far_away_are_fitted(void **state)
{
  (void)state;
  enum { DENSE = 2800, FAR = 100 };
  cloud *c = random_cloud(3, ZS_RBF_R3, DENSE + FAR, 5);
  uint64_t seed = 77;
  for (size_t i = 0; i < DENSE + FAR; i++) {
    double *p = c->positions + 3 * i, length = 0;
    for (size_t k = 0; k < 3; k++)
      p[k] = random_between(&seed, -1, 1);
    for (size_t k = 0; k < 3; k++)
      length = hypot(length, p[k]);
    if (i < DENSE)
      for (size_t k = 0; k < 3; k++)
        p[k] *= (i % 2 ? 0.02 : 0.0202) / length;
    c->values[i] = 0.02 - (i < DENSE ? (i % 2 ? 0.02 : 0.0202) : length);
  }
  zs_rbf *rbf = fitted(c);
  assert_string_equal(rbf->method, "iterative");
  assert_true(rbf->residual < 1e-6 * 1.8);
  zs_rbf_free(rbf);
  free(c);
}

/* ---- Limits ----------------------------------------------------------------------------- */

typedef struct seen {
  char message[512];
  zs_severity severity;
} seen;

static void keep(void *context, const zs_diagnostic *d)
{
  seen *s = context;
  snprintf(s->message, sizeof s->message, "%s", d->message);
  s->severity = d->severity;
}

static void a_miss_is_reported(void **state)
{
  (void)state;
  cloud *c = random_cloud(3, ZS_RBF_R3, COUNT, 15);
  seen s = {.message = ""};
  zs_diag diag = {.report = keep, .context = &s};
  c->problem.tolerance = 1e-15; /* less than rounding leaves */
  zs_rbf *rbf = zs_rbf_fit(&c->problem, NULL, NULL, &diag);
  assert_non_null(rbf);
  assert_int_equal(s.severity, ZS_WARNING);
  assert_non_null(strstr(s.message, "misses its constraints by up to"));
  zs_rbf_free(rbf);
  free(c);
}

static void memory_is_limited(void **state)
{
  (void)state;
  cloud *c = random_cloud(3, ZS_RBF_R3, COUNT, 15);
  seen s = {.message = ""};
  zs_diag diag = {.report = keep, .context = &s};
  zs_control control;
  memset(&control, 0, sizeof control);
  control.memory_limit = 1000000;
  assert_null(zs_rbf_fit(&c->problem, &control, NULL, &diag));
  assert_int_equal(diag.status, ZS_ERROR_MEMORY);
  assert_non_null(strstr(s.message, "fitting 900 constraints needs"));
  assert_non_null(strstr(s.message, "more than the memory limit of 1 MB"));
  free(c);
}

/* Where there is no memory for the direct solution, iterations that end far from the values are
 * no fit. */
static void stalled_fits_say_so(void **state)
{
  (void)state;
  crowd c = random_crowd(4000, false);
  uint64_t seed = 23;
  for (size_t i = 0; i < c.count; i++) {
    c.positions[3 * i + 1] *= 0.01; /* nearly a line */
    c.positions[3 * i + 2] *= 0.01;
    c.values[i] = random_between(&seed, -1, 1);
  }
  seen s = {.message = ""};
  zs_diag diag = {.report = keep, .context = &s};
  const zs_control control = {.memory_limit = 100000000};
  const zs_rbf_problem problem = {.dimension = 3, .kernel = ZS_RBF_R5, .count = c.count,
                                  .positions = c.positions, .values = c.values};
  assert_null(zs_rbf_fit(&problem, &control, NULL, &diag));
  assert_int_equal(diag.status, ZS_ERROR_UNABLE);
  assert_non_null(strstr(s.message, "the fit of 4000 constraints with kernel r5 misses them"));
  clear_crowd(&c);
}

/* Counts calls, and stops at one of them. */
typedef struct stop {
  unsigned calls, at;
  double latest;
} stop;

static bool stop_at(void *context, const char *stage, double fraction)
{
  stop *s = context;
  assert_string_equal(stage, "fitting");
  assert_true(fraction >= s->latest && fraction <= 1);
  s->latest = fraction;
  return ++s->calls != s->at;
}

static void can_be_cancelled_anywhere(void **state)
{
  (void)state;
  cloud *c = random_cloud(3, ZS_RBF_R3, COUNT, 15);
  stop s = {0};
  zs_control control;
  memset(&control, 0, sizeof control);
  control.progress = stop_at;
  control.context = &s;
  zs_rbf *rbf = zs_rbf_fit(&c->problem, &control, NULL, NULL);
  assert_non_null(rbf);
  assert_true(s.latest == 1);
  const unsigned calls = s.calls;
  assert_true(calls > 8);
  zs_rbf_free(rbf);
  for (unsigned at = 1; at <= calls; at++) {
    zs_diag diag = {0};
    s = (stop){.at = at};
    assert_null(zs_rbf_fit(&c->problem, &control, NULL, &diag));
    assert_int_equal(diag.status, ZS_CANCELLED);
    assert_int_equal(s.calls, at);
  }
  free(c);
}

static void threads_change_nothing(void **state)
{
  (void)state;
  cloud *c = random_cloud(3, ZS_RBF_R3, 2500, 15);
  zs_control control;
  memset(&control, 0, sizeof control);
  control.threads = 1;
  zs_rbf *rbf = zs_rbf_fit(&c->problem, &control, NULL, NULL);
  control.threads = 3;
  zs_rbf *other = zs_rbf_fit(&c->problem, &control, NULL, NULL);
  assert_non_null(rbf);
  assert_non_null(other);
  assert_true(random_difference(rbf, other, 3) < 1e-9);
  zs_rbf_free(rbf);
  zs_rbf_free(other);
  free(c);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(agrees_with_bordered_system),
    cmocka_unit_test(many_agree_with_bordered_system),
    cmocka_unit_test(iterations_serve),
    cmocka_unit_test(smoothing_is_the_direct_one),
    cmocka_unit_test(large_fits_meet_their_constraints),
    cmocka_unit_test(levels_in_the_middle_serve),
    cmocka_unit_test(order_does_not_matter),
    cmocka_unit_test(follows_similarities),
    cmocka_unit_test(hostile_sets_are_fitted),
    cmocka_unit_test(few_points_far_away_are_fitted),
    cmocka_unit_test(a_miss_is_reported),
    cmocka_unit_test(memory_is_limited),
    cmocka_unit_test(stalled_fits_say_so),
    cmocka_unit_test(can_be_cancelled_anywhere),
    cmocka_unit_test(threads_change_nothing),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
