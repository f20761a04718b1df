/* Products by clusters, against sums of all pairs. */
#include "../random.h"

#include "rbf/adaptive.h"
#include "rbf/nodes.h"
#include "rbf/product.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SMALLEST = 12 /* cluster */ };

static const char *const isas[] = {"baseline", "avx2", "avx512"};

/* Instruction sets that the machine has. */
static unsigned machine_isas(void)
{
  const char *name = zs_isa();
  return !strcmp(name, "avx512") ? 3 : !strcmp(name, "avx2") ? 2 : 1;
}

/* ---- Interpolation ------------------------------------------------------------------- */

static const zs_nodes grid = {.dimension = 3,
                              .side = {4, 1, 6},
                              .lo = {-1, 2, 0.5},
                              .hi = {0.5, 2, 0.75}};

/* A polynomial of the degree that the nodes allow. */
static double polynomial(const double *x)
{
  return 1 + x[0] - 2 * pow(x[0], 3) * x[2] + 30 * pow(x[2] - 0.6, 5);
}

static void polynomials_are_reproduced(void **state)
{
  (void)state;
  enum { POINTS = 29 };
  const size_t count = zs_nodes_count(&grid);
  assert_int_equal(count, 24);
  double nodes[24 * 3], values[24], points[POINTS * 3];
  uint64_t seed = 3;
  zs_nodes_points(&grid, nodes);
  for (size_t i = 0; i < count; i++)
    values[i] = polynomial(nodes + 3 * i);
  for (size_t i = 0; i < POINTS; i++)
    for (size_t k = 0; k < 3; k++)
      points[3 * i + k] = random_between(&seed, grid.lo[k], grid.hi[k]);
  for (unsigned isa = 0; isa < machine_isas(); isa++) {
    assert_int_equal(setenv("ZEROSET_ISA", isas[isa], 1), 0);
    double sums[POINTS];
    for (size_t i = 0; i < POINTS; i++)
      sums[i] = (double)i;
    zs_nodes_select()->interpolate(&grid, values, points, POINTS, sums);
    for (size_t i = 0; i < POINTS; i++)
      assert_true(fabs(sums[i] - (double)i - polynomial(points + 3 * i)) < 1e-13);
  }
  unsetenv("ZEROSET_ISA");
}

/* Collecting is the transpose of interpolating. */
static void collecting_transposes(void **state)
{
  (void)state;
  enum { POINTS = 21 };
  double points[POINTS * 3], weights[POINTS], values[24];
  uint64_t seed = 4;
  for (size_t i = 0; i < POINTS; i++) {
    weights[i] = random_between(&seed, -1, 1);
    for (size_t k = 0; k < 3; k++)
      points[3 * i + k] = random_between(&seed, grid.lo[k], grid.hi[k]);
  }
  for (size_t i = 0; i < 24; i++)
    values[i] = random_between(&seed, -1, 1);
  for (unsigned isa = 0; isa < machine_isas(); isa++) {
    assert_int_equal(setenv("ZEROSET_ISA", isas[isa], 1), 0);
    double sums[POINTS] = {0}, collected[24] = {0}, one = 0, other = 0;
    zs_nodes_select()->interpolate(&grid, values, points, POINTS, sums);
    zs_nodes_select()->collect(&grid, collected, points, POINTS, weights);
    for (size_t i = 0; i < POINTS; i++)
      one += weights[i] * sums[i];
    for (size_t i = 0; i < 24; i++)
      other += values[i] * collected[i];
    assert_true(fabs(one - other) < 1e-12);
  }
  unsetenv("ZEROSET_ISA");
}

/* From grid to grid, either way, is what it is point by point. */
static void grids_match_their_points(void **state)
{
  (void)state;
  static const zs_nodes half = {
    .dimension = 3, .side = {5, 1, 3}, .lo = {-0.5, 2, 0.6}, .hi = {0.25, 2, 0.75}};
  enum { COUNT = 15 };
  double points[3 * COUNT], values[24], weights[COUNT];
  uint64_t seed = 6;
  assert_true(zs_nodes_match(&grid, &half));
  assert_int_equal(zs_nodes_count(&half), COUNT);
  zs_nodes_points(&half, points);
  for (size_t i = 0; i < 24; i++)
    values[i] = random_between(&seed, -1, 1);
  for (size_t i = 0; i < COUNT; i++)
    weights[i] = random_between(&seed, -1, 1);
  for (unsigned isa = 0; isa < machine_isas(); isa++) {
    assert_int_equal(setenv("ZEROSET_ISA", isas[isa], 1), 0);
    double sums[2][COUNT], collected[2][24];
    for (size_t i = 0; i < COUNT; i++)
      sums[0][i] = sums[1][i] = (double)i;
    for (size_t i = 0; i < 24; i++)
      collected[0][i] = collected[1][i] = (double)i;
    zs_nodes_select()->interpolate(&grid, values, points, COUNT, sums[0]);
    zs_nodes_select()->interpolate_grid(&grid, values, &half, sums[1]);
    zs_nodes_select()->collect(&grid, collected[0], points, COUNT, weights);
    zs_nodes_select()->collect_grid(&grid, collected[1], &half, weights);
    for (size_t i = 0; i < COUNT; i++)
      assert_true(fabs(sums[0][i] - sums[1][i]) < 1e-13);
    for (size_t i = 0; i < 24; i++)
      assert_true(fabs(collected[0][i] - collected[1][i]) < 1e-13);
  }
  unsetenv("ZEROSET_ISA");
  static const zs_nodes large = {.dimension = 5, .side = {14, 14, 14, 2, 2}};
  assert_false(zs_nodes_match(&large, &large));
}

/* ---- Products ------------------------------------------------------------------------ */

enum { RANDOM, CLUSTERED, PLANE, LINE, SPHERE, SHAPES };

static void place(int shape, unsigned dimension, uint64_t *seed, double *p)
{
  const double s = random_between(seed, -0.5, 0.5), t = random_between(seed, -0.5, 0.5);
  const double shrink = exp(-random_between(seed, 0, 6));
  double length = 0;
  for (unsigned k = 0; k < dimension; k++) {
    p[k] = random_between(seed, -0.5, 0.5);
    length += p[k] * p[k];
  }
  for (unsigned k = 0; k < dimension; k++) {
    if (shape == CLUSTERED)
      p[k] *= shrink;
    else if (shape == PLANE)
      p[k] = 0.3 * (k + 1) * s + 0.5 * (k == 1 ? t : 0);
    else if (shape == LINE)
      p[k] = 0.3 * (k + 1) * s;
    else if (shape == SPHERE)
      p[k] *= 0.5 / sqrt(length);
  }
}

static zs_rbf_clusters *random_clusters(int shape, unsigned dimension, size_t count,
                                        uint64_t seed)
{
  double *points = malloc(count * dimension * sizeof *points);
  assert_non_null(points);
  for (size_t i = 0; i < count; i++)
    place(shape, dimension, &seed, points + i * dimension);
  zs_rbf_clusters *clusters = zs_rbf_clusters_new(points, count, dimension, SMALLEST);
  assert_non_null(clusters);
  free(points);
  return clusters;
}

static double *random_weights(size_t count)
{
  double *weights = malloc(count * sizeof *weights);
  uint64_t seed = 9;
  assert_non_null(weights);
  for (size_t i = 0; i < count; i++)
    weights[i] = random_between(&seed, -1, 1);
  return weights;
}

static const zs_rbf_radial r1 = {ZS_RBF_R, 0}, r3 = {ZS_RBF_R3, 0};

/* The root of the mean square, over some of the targets, of the errors of sums,
 * and of what their terms add up to without their signs. */
static double sum_errors(zs_fast *fast, zs_rbf_radial radial, const zs_rbf_clusters *targets,
                         const zs_rbf_clusters *sources, const double *weights, double *size)
{
  const unsigned dimension = targets->dimension;
  double *sums = calloc(targets->count, sizeof *sums), square = 0, whole = 0;
  size_t count = 0;
  assert_non_null(sums);
  sums[0] = 7; /* products are added */
  assert_true(zs_fast_multiply(fast, weights, sums));
  for (size_t i = 0; i < targets->count; i += 41, count++) {
    double exact = i ? 0 : 7, absolute = 0;
    for (size_t j = 0; j < sources->count; j++) {
      double s = 0;
      for (unsigned k = 0; k < dimension; k++)
        s += pow(targets->points[i * dimension + k] - sources->points[j * dimension + k], 2);
      exact += weights[j] * zs_rbf_phi(radial, s);
      absolute += fabs(weights[j] * zs_rbf_phi(radial, s));
    }
    square += pow(sums[i] - exact, 2);
    whole += pow(absolute, 2);
  }
  free(sums);
  *size = sqrt(whole / (double)count);
  return sqrt(square / (double)count);
}

static void products_agree_with_pairs(void **state)
{
  (void)state;
  enum { COUNT = 5000 };
  double *weights = random_weights(COUNT);
  for (unsigned dimension = 2; dimension <= 4; dimension++)
    for (int shape = 0; shape < SHAPES; shape++) {
      zs_rbf_clusters *clusters = random_clusters(shape, dimension, COUNT, 11);
      for (int kernel = 0; kernel < ZS_RBF_KERNEL_COUNT; kernel++) {
        const zs_rbf_radial radial = {(zs_rbf_kernel)kernel, 3};
        double size, rough, fine;
        zs_fast *fast = zs_fast_new(radial, clusters, clusters, 4, 2);
        assert_non_null(fast);
        rough = sum_errors(fast, radial, clusters, clusters, weights, &size);
        assert_true(rough < 1e-3 * size);
        zs_fast_free(fast);
        fast = zs_fast_new(radial, clusters, clusters, 9, 2);
        assert_non_null(fast);
        fine = sum_errors(fast, radial, clusters, clusters, weights, &size);
        assert_true(fine < 2e-7 * size);
        zs_fast_free(fast);
      }
      zs_rbf_clusters_free(clusters);
    }
  free(weights);
}

/* Targets other than the sources, few of them or many. */
static void two_trees_agree_with_pairs(void **state)
{
  (void)state;
  static const size_t counts[][2] = {{1, 4000}, {4000, 1}, {300, 4000}, {4000, 300}, {7, 7}};
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
    zs_rbf_clusters *targets = random_clusters(SPHERE, 3, counts[i][0], 5);
    zs_rbf_clusters *sources = random_clusters(RANDOM, 3, counts[i][1], 6);
    double *weights = random_weights(counts[i][1]), size;
    zs_fast *fast = zs_fast_new(r3, targets, sources, 8, 2);
    assert_non_null(fast);
    assert_true(sum_errors(fast, r3, targets, sources, weights, &size) < 1e-5 * size);
    zs_fast_free(fast);
    free(weights);
    zs_rbf_clusters_free(targets);
    zs_rbf_clusters_free(sources);
  }
}

/* The number of pairs grows far less than with the square of the points. */
static void pairs_are_few(void **state)
{
  (void)state;
  double pairs[2];
  for (int i = 0; i < 2; i++) {
    zs_rbf_clusters *clusters = random_clusters(SPHERE, 3, i ? 40000 : 10000, 5);
    zs_fast *fast = zs_fast_new(r1, clusters, clusters, 6, 1);
    assert_non_null(fast);
    pairs[i] = zs_fast_pairs(fast);
    zs_fast_free(fast);
    zs_rbf_clusters_free(clusters);
  }
  assert_true(pairs[1] < 8 * pairs[0]);
  assert_true(pairs[1] < 0.2 * 40000 * 40000.0);
}

static zs_fast_errors errors_at_sample(zs_fast *fast, const double *weights, size_t count)
{
  double *sums = calloc(count, sizeof *sums);
  assert_non_null(sums);
  assert_true(zs_fast_multiply(fast, weights, sums));
  const zs_fast_errors errors = zs_fast_compare(fast, weights, sums);
  free(sums);
  return errors;
}

/* In a volume twenty thousand points are too few for the finest of these. */
static void the_asked_accuracy_is_chosen(void **state)
{
  (void)state;
  enum { COUNT = 20000 };
  double *weights = random_weights(COUNT), size;
  for (int shape = 0; shape < SHAPES; shape++) {
    zs_rbf_clusters *clusters = random_clusters(shape, 3, COUNT, 11);
    double pairs = 0;
    for (double accuracy = 1e-1; accuracy > 1e-3; accuracy /= 30) {
      zs_fast *fast = zs_fast_choose(r1, clusters, clusters, weights, accuracy, 2);
      assert_true(fast || shape < PLANE);
      if (!fast)
        break;
      const zs_fast_errors errors = errors_at_sample(fast, weights, COUNT);
      assert_true(errors.mean <= accuracy);
      assert_true(errors.most >= errors.mean);
      assert_true(zs_fast_pairs(fast) >= pairs);
      pairs = zs_fast_pairs(fast);
      /* At other targets than those it was chosen by. */
      assert_true(sum_errors(fast, r1, clusters, clusters, weights, &size) < 2 * accuracy);
      zs_fast_free(fast);
    }
    assert_null(zs_fast_choose(r1, clusters, clusters, weights, 1e-30, 2));
    zs_rbf_clusters_free(clusters);
  }
  free(weights);
}

/* Whatever was asked for before, in any order, down to what only all pairs can give. */
static void each_product_is_as_accurate_as_asked(void **state)
{
  (void)state;
  enum { COUNT = 20000 };
  static const double accuracies[] = {1e-3, 1e-1, 1e-4, 1e-30, 1e-2};
  zs_rbf_clusters *clusters = random_clusters(SPHERE, 3, COUNT, 11);
  const zs_rbf_system system = {.radial = r1, .dimension = 3, .degree = 1, .terms = 4,
                                .smoothing = 0.5, .count = COUNT, .points = clusters->points,
                                .threads = 2};
  double *weights = random_weights(COUNT);
  double *exact = malloc(COUNT * sizeof *exact), *product = malloc(COUNT * sizeof *product);
  assert_non_null(exact);
  assert_non_null(product);
  zs_rbf_system_multiply(&system, weights, exact);
  zs_adaptive adaptive = {.system = &system, .clusters = clusters};
  zs_adaptive_series series = {.error = 0};
  for (size_t i = 0; i < sizeof accuracies / sizeof *accuracies; i++) {
    zs_fast_errors errors;
    double square = 0;
    assert_true(zs_adaptive_multiply(&adaptive, &series, weights, accuracies[i], product, &errors));
    for (size_t j = 0; j < COUNT; j++)
      square += (product[j] - exact[j]) * (product[j] - exact[j]) / COUNT;
    assert_true(errors.mean <= accuracies[i]);
    /* At other places than the sample. */
    assert_true(sqrt(square) <= 2 * accuracies[i]);
    /* And no better than need be. */
    assert_true(accuracies[i] < 1e-20 || sqrt(square) > 1e-3 * accuracies[i]);
  }
  zs_adaptive_clear(&adaptive);
  free(exact);
  free(product);
  free(weights);
  zs_rbf_clusters_free(clusters);
}

/* Bits of sums do not tell how many threads there were. */
static void threads_do_not_matter(void **state)
{
  (void)state;
  enum { COUNT = 3000, OTHERS = 700, MOST = 3 };
  zs_rbf_clusters *clusters = random_clusters(CLUSTERED, 3, COUNT, 21);
  zs_rbf_clusters *others = random_clusters(RANDOM, 3, OTHERS, 22);
  double *weights = random_weights(COUNT), sums[MOST][COUNT];
  for (int both = 0; both < 2; both++) {
    memset(sums, 0, sizeof sums);
    for (unsigned threads = 1; threads <= MOST; threads++) {
      zs_fast *fast = zs_fast_new(r3, both ? clusters : others, clusters, 5, threads);
      assert_non_null(fast);
      assert_true(zs_fast_multiply(fast, weights, sums[threads - 1]));
      assert_memory_equal(sums[threads - 1], sums[0], sizeof sums[0]);
      zs_fast_free(fast);
    }
  }
  zs_rbf_clusters_free(clusters);
  zs_rbf_clusters_free(others);
  free(weights);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(polynomials_are_reproduced),
    cmocka_unit_test(collecting_transposes),
    cmocka_unit_test(grids_match_their_points),
    cmocka_unit_test(products_agree_with_pairs),
    cmocka_unit_test(two_trees_agree_with_pairs),
    cmocka_unit_test(pairs_are_few),
    cmocka_unit_test(the_asked_accuracy_is_chosen),
    cmocka_unit_test(each_product_is_as_accurate_as_asked),
    cmocka_unit_test(threads_do_not_matter),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
