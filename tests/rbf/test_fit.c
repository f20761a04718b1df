/* Fits: laws of interpolation, an independent solution, degenerate input. */
#include "clouds.h"

static void interpolates_every_value(void **state)
{
  (void)state;
  for (unsigned dimension = 2; dimension <= 5; dimension++)
    for (int kernel = 0; kernel < ZS_RBF_KERNEL_COUNT; kernel++) {
      const uint64_t seed = 7 * dimension + (unsigned)kernel;
      cloud *c = random_cloud(dimension, (zs_rbf_kernel)kernel, 300, seed);
      zs_rbf *rbf = fitted(c);
      assert_int_equal(rbf->count, 300);
      assert_true(rbf->residual < 1e-7);
      double worst = 0;
      for (size_t i = 0; i < c->problem.count; i++)
        worst = fmax(worst, fabs(zs_rbf_value(rbf, c->positions + i * dimension) - c->values[i]));
      assert_true(worst < 1e-7);
      zs_rbf_free(rbf);
      free(c);
    }
}

/* Away from the points too, an interpolant of many is near the function. */
static void approximates_between_points(void **state)
{
  (void)state;
  cloud *c = random_cloud(3, ZS_RBF_R3, 400, 5);
  zs_rbf *rbf = fitted(c);
  uint64_t seed = 99;
  for (int i = 0; i < 200; i++) {
    double x[3];
    for (int k = 0; k < 3; k++)
      x[k] = random_between(&seed, -0.7, 0.7);
    assert_true(fabs(zs_rbf_value(rbf, x) - smooth(3, x)) < 0.1);
  }
  zs_rbf_free(rbf);
  free(c);
}

static void agrees_with_bordered_system(void **state)
{
  (void)state;
  for (unsigned dimension = 2; dimension <= 5; dimension++)
    for (int kernel = 0; kernel < ZS_RBF_KERNEL_COUNT; kernel++) {
      unsigned order = zs_rbf_order((zs_rbf_kernel)kernel), degree = order > 2 ? order - 1 : 1;
      cloud *c = random_cloud(dimension, (zs_rbf_kernel)kernel, 120, 31 + (unsigned)kernel);
      zs_rbf *rbf = fitted(c);
      assert_true(difference_from_bordered(rbf, c, degree, 1.2) < 1e-6);
      zs_rbf_free(rbf);
      free(c);
    }
}

static void reproduces_linear_functions(void **state)
{
  (void)state;
  for (int kernel = 0; kernel < ZS_RBF_KERNEL_COUNT; kernel++) {
    cloud *c = random_cloud(3, (zs_rbf_kernel)kernel, 50, 11);
    for (size_t i = 0; i < 50; i++)
      c->values[i] = 2 - c->positions[3 * i] + 0.5 * c->positions[3 * i + 2];
    zs_rbf *rbf = fitted(c);
    const double far[3] = {40, -30, 20};
    assert_true(fabs(zs_rbf_value(rbf, far) - (2 - 40 + 10)) < 1e-5);
    zs_rbf_free(rbf);
    free(c);
  }
}

/* With degree 2, whatever the kernel asks for; solved directly and by iterations. */
static void reproduces_quadratics_on_request(void **state)
{
  (void)state;
  static const size_t counts[] = {60, 800};
  for (int i = 0; i < 2; i++) {
    cloud *c = random_cloud(3, ZS_RBF_R3, counts[i], 11);
    c->problem.degree = 2;
    for (size_t j = 0; j < counts[i]; j++) {
      const double *x = c->positions + 3 * j;
      c->values[j] = 2 - x[0] + 0.5 * x[1] * x[2] + x[2] * x[2];
    }
    zs_rbf *rbf = fitted(c);
    const double far[3] = {4, -3, 2};
    assert_int_equal(rbf->terms, 10);
    assert_true(fabs(zs_rbf_value(rbf, far) - (2 - 4 - 3 + 4)) < 1e-4);
    zs_rbf_free(rbf);
    free(c);
  }
}

/* Moving, turning and scaling the points moves, turns and scales the fit. */
static void follows_similarities(void **state)
{
  (void)state;
  const double scale = 1e4, a = cos(0.7), b = sin(0.7), shift[3] = {1e6, -2e5, 3e6};
  cloud *c = random_cloud(3, ZS_RBF_R3, 200, 21), *moved = random_cloud(3, ZS_RBF_R3, 200, 21);
  for (size_t i = 0; i < 200; i++) {
    const double *p = c->positions + 3 * i;
    double *q = moved->positions + 3 * i;
    q[0] = scale * (a * p[0] - b * p[1]) + shift[0];
    q[1] = scale * (b * p[0] + a * p[1]) + shift[1];
    q[2] = scale * p[2] + shift[2];
  }
  zs_rbf *rbf = fitted(c), *other = fitted(moved);
  uint64_t seed = 2;
  for (int i = 0; i < 100; i++) {
    double x[3];
    for (int k = 0; k < 3; k++)
      x[k] = random_between(&seed, -1, 1);
    const double y[3] = {scale * (a * x[0] - b * x[1]) + shift[0],
                         scale * (b * x[0] + a * x[1]) + shift[1], scale * x[2] + shift[2]};
    assert_true(fabs(zs_rbf_value(rbf, x) - zs_rbf_value(other, y)) < 1e-5);
  }
  zs_rbf_free(rbf);
  zs_rbf_free(other);
  free(c);
  free(moved);
}

/* Points of a plane or a line, in any position and with rounding, determine the
 * fit there, and it does not run away beside it. */
static void flat_sets_are_fitted(void **state)
{
  (void)state;
  const double u[3] = {0.36, 0.48, 0.8}, v[3] = {0.8, -0.6, 0};
  const double normal[3] = {0.48, 0.64, -0.6};
  for (int spanned = 1; spanned <= 2; spanned++)
    for (int kernel = 0; kernel < ZS_RBF_KERNEL_COUNT; kernel++)
      for (int rounded = 0; rounded <= 1; rounded++) {
        cloud *c = random_cloud(3, (zs_rbf_kernel)kernel, 60, 17);
        c->problem.sigma = 0; /* chosen by how close the points are */
        uint64_t seed = 8;
        for (size_t i = 0; i < 60; i++) {
          double s = random_between(&seed, -1, 1), t = random_between(&seed, -1, 1);
          for (int k = 0; k < 3; k++) {
            double x = 5 + s * u[k] + (spanned == 2 ? t * v[k] : 0);
            c->positions[3 * i + (size_t)k] = rounded ? (double)(float)x : x;
          }
          c->values[i] = 0.5 + s - (spanned == 2 ? 0.25 * t : 0);
        }
        zs_rbf *rbf = fitted(c);
        assert_true(rbf->residual < 1e-6);
        double beside[3];
        for (int k = 0; k < 3; k++)
          beside[k] = 5 + 0.1 * normal[k];
        assert_true(fabs(zs_rbf_value(rbf, beside) - 0.5) < 0.01);
        zs_rbf_free(rbf);
        free(c);
      }
}

static void few_points_are_fitted(void **state)
{
  (void)state;
  for (int kernel = 0; kernel < ZS_RBF_KERNEL_COUNT; kernel++)
    for (size_t count = 1; count <= 12; count++) {
      cloud *c = random_cloud(3, (zs_rbf_kernel)kernel, count, 50 + count);
      zs_rbf *rbf = fitted(c);
      assert_true(rbf->residual < 1e-7);
      zs_rbf_free(rbf);
      free(c);
    }
}

static void repeated_points_count_once(void **state)
{
  (void)state;
  cloud *c = random_cloud(3, ZS_RBF_R3, 100, 4);
  zs_rbf *rbf = fitted(c);
  for (size_t i = 0; i < 100; i++) {
    c->values[100 + i] = c->values[i];
    for (size_t k = 0; k < 3; k++)
      c->positions[300 + 3 * i + k] = c->positions[3 * i + k] + (i % 2 ? 1e-11 : 0);
  }
  c->problem.count = 200;
  zs_rbf *twice = fitted(c);
  assert_int_equal(twice->count, 100);
  const double x[3] = {0.1, -0.2, 0.3};
  assert_true(fabs(zs_rbf_value(rbf, x) - zs_rbf_value(twice, x)) < 1e-7);
  zs_rbf_free(rbf);
  zs_rbf_free(twice);
  free(c);
}

/* The latest message, for tests of failures. */
static void keep_message(void *context, const zs_diagnostic *diagnostic)
{
  snprintf(context, 512, "%s", diagnostic->message);
}

static void fails_with(const zs_rbf_problem *problem, const zs_control *control, zs_status status,
                       const char *part)
{
  char message[512] = "";
  zs_diag diag = {.report = keep_message, .context = message};
  assert_null(zs_rbf_fit(problem, control, NULL, &diag));
  assert_int_equal(diag.status, status);
  assert_non_null(strstr(message, part));
}

static void contradictions_are_reported(void **state)
{
  (void)state;
  cloud *c = random_cloud(3, ZS_RBF_R3, 100, 4);
  c->positions[30] = c->positions[60] = 0.25;
  c->positions[31] = c->positions[61] = 0.5;
  c->positions[32] = c->positions[62] = -0.75;
  c->values[10] = 0;
  c->values[20] = 1.5;
  fails_with(&c->problem, NULL, ZS_ERROR_GEOMETRY,
             "value 0 at (0.25 0.5 -0.75), value 1.5 at (0.25 0.5 -0.75)");
  /* As near as can be, as well. */
  c->positions[62] += 1e-9;
  fails_with(&c->problem, NULL, ZS_ERROR_GEOMETRY, "value 1.5 at (0.25 0.5 -0.749999999)");
  c->positions[62] -= 1e-9;
  /* With smoothing the two are averaged. */
  c->problem.smoothing = 1e-6;
  zs_rbf *rbf = fitted(c);
  assert_true(fabs(zs_rbf_value(rbf, c->positions + 30) - 0.75) < 1e-3);
  zs_rbf_free(rbf);
  free(c);
}

/* Gaussians of which nothing is said are as wide as can be solved, by themselves or by a message
 * that says which ones cannot. */
static void gaussians_have_a_width(void **state)
{
  (void)state;
  static const size_t counts[] = {30, 300, 1500};
  double before = INFINITY;
  for (int i = 0; i < 3; i++) {
    cloud *c = random_cloud(3, ZS_RBF_GAUSSIAN, counts[i], 8);
    c->problem.sigma = 0;
    zs_rbf *rbf = fitted(c);
    const double sigma = 1 / sqrt(rbf->radial.rate);
    assert_true(sigma < before && sigma > 0.5 / cbrt((double)counts[i]));
    assert_true(rbf->residual < 1e-6);
    before = sigma;
    zs_rbf_free(rbf);
    free(c);
  }
  cloud *c = random_cloud(3, ZS_RBF_GAUSSIAN, 300, 8);
  c->problem.sigma = 50;
  fails_with(&c->problem, NULL, ZS_ERROR_UNABLE, "for Gaussians of width 50");
  /* Smoothing makes any width good. */
  c->problem.smoothing = 1e-8;
  zs_rbf_free(fitted(c));
  /* Far from all points there is but the polynomial. */
  c->problem.smoothing = 0;
  c->problem.sigma = 0.3;
  zs_rbf *rbf = fitted(c);
  const double far[3] = {9, 0, 0}, farther[3] = {11, 0, 0}, middle[3] = {10, 0, 0};
  assert_true(fabs(zs_rbf_value(rbf, far) + zs_rbf_value(rbf, farther) -
                   2 * zs_rbf_value(rbf, middle)) < 1e-9);
  zs_rbf_free(rbf);
  free(c);
}

/* More smoothing never brings f nearer to the values, and never bends it more. */
static void smoothing_trades_closeness(void **state)
{
  (void)state;
  cloud *c = random_cloud(3, ZS_RBF_R3, 200, 14);
  uint64_t seed = 6;
  for (size_t i = 0; i < 200; i++)
    c->values[i] += random_between(&seed, -0.1, 0.1);
  double before = 0, weights_before = INFINITY;
  for (double mu = 1e-8; mu < 10; mu *= 100) {
    c->problem.smoothing = mu;
    zs_rbf *rbf = fitted(c);
    double square = 0, weights = 0;
    for (size_t i = 0; i < 200; i++) {
      square += pow(zs_rbf_value(rbf, c->positions + 3 * i) - c->values[i], 2);
      weights += pow(rbf->weights[i], 2);
    }
    assert_true(square > before);
    assert_true(weights < weights_before);
    before = square;
    weights_before = weights;
    zs_rbf_free(rbf);
  }
  free(c);
}

static void limits_are_kept(void **state)
{
  (void)state;
  cloud *c = random_cloud(3, ZS_RBF_R3, 300, 4);
  zs_control control;
  memset(&control, 0, sizeof control);
  control.memory_limit = 100000;
  fails_with(&c->problem, &control, ZS_ERROR_MEMORY, "memory limit");
  fails_with(&(zs_rbf_problem){.dimension = 3, .kernel = ZS_RBF_R3}, NULL, ZS_ERROR_GEOMETRY,
             "no constraints");
  c->positions[4] = 1e308;
  c->positions[7] = -1e308;
  fails_with(&c->problem, NULL, ZS_ERROR_GEOMETRY, "too far apart");
  c->positions[4] = (double)NAN;
  c->positions[7] = 0;
  fails_with(&c->problem, NULL, ZS_ERROR_GEOMETRY, "not finite");
  c->positions[4] = 0;
  c->values[9] = (double)INFINITY;
  fails_with(&c->problem, NULL, ZS_ERROR_GEOMETRY, "not finite");
  free(c);

  const size_t many = ZS_RBF_MAXIMUM_COUNT + 1;
  double *positions = malloc(many * 3 * sizeof *positions), *values = calloc(many, sizeof *values);
  assert_non_null(positions);
  assert_non_null(values);
  uint64_t seed = 1;
  for (size_t i = 0; i < 3 * many; i++)
    positions[i] = random_between(&seed, 0, 1);
  fails_with(&(zs_rbf_problem){.dimension = 3, .kernel = ZS_RBF_R3, .count = many,
                               .positions = positions, .values = values},
             NULL, ZS_ERROR_UNABLE, "2000001 constraints are more than the 2000000");
  free(positions);
  free(values);
}

static bool stop_late(void *context, const char *stage, double fraction)
{
  assert_string_equal(stage, "fitting");
  double *latest = context;
  assert_true(fraction >= *latest);
  *latest = fraction;
  return fraction < 0.5;
}

static void can_be_cancelled(void **state)
{
  (void)state;
  cloud *c = random_cloud(3, ZS_RBF_R3, 200, 4);
  double latest = 0;
  zs_control control;
  memset(&control, 0, sizeof control);
  control.progress = stop_late;
  control.context = &latest;
  fails_with(&c->problem, &control, ZS_CANCELLED, "cancelled");
  assert_true(latest >= 0.5);
  free(c);
}

/* Nearly coinciding points of different values either fit or fail: no garbage. */
static void close_points_fit_or_fail(void **state)
{
  (void)state;
  for (double gap = 1e-3; gap > 1e-10; gap /= 4) {
    cloud *c = random_cloud(3, ZS_RBF_R3, 300, 77);
    memcpy(c->positions + 3, c->positions, 3 * sizeof(double));
    c->positions[3] += gap;
    c->values[1] = c->values[0] + 0.01;
    zs_diag diag = {0};
    zs_rbf *rbf = zs_rbf_fit(&c->problem, NULL, NULL, &diag);
    if (rbf) {
      for (size_t i = 0; i < 300; i++)
        assert_true(fabs(zs_rbf_value(rbf, c->positions + 3 * i) - c->values[i]) < 1e-3);
      assert_true(gap < 0.9e-3 || rbf->residual < 1e-6);
    } else {
      assert_true(gap < 1e-4);
      assert_true(diag.status == ZS_ERROR_UNABLE || diag.status == ZS_ERROR_GEOMETRY);
    }
    zs_rbf_free(rbf);
    free(c);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(interpolates_every_value),
    cmocka_unit_test(approximates_between_points),
    cmocka_unit_test(agrees_with_bordered_system),
    cmocka_unit_test(reproduces_linear_functions),
    cmocka_unit_test(reproduces_quadratics_on_request),
    cmocka_unit_test(follows_similarities),
    cmocka_unit_test(flat_sets_are_fitted),
    cmocka_unit_test(few_points_are_fitted),
    cmocka_unit_test(repeated_points_count_once),
    cmocka_unit_test(contradictions_are_reported),
    cmocka_unit_test(gaussians_have_a_width),
    cmocka_unit_test(smoothing_trades_closeness),
    cmocka_unit_test(limits_are_kept),
    cmocka_unit_test(can_be_cancelled),
    cmocka_unit_test(close_points_fit_or_fail),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
