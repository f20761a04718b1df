/* The parts that solvers of fits are made of, each against an independent way
 * to the same result. */
#include "../random.h"

#include "rbf/clusters.h"
#include "rbf/fgmres.h"
#include "rbf/local.h"
#include "rbf/product.h"

#include <lapacke.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char *const isas[] = {"baseline", "avx2", "avx512"};

/* Instruction sets that the machine has. */
static unsigned machine_isas(void)
{
  const char *name = zs_isa();
  return !strcmp(name, "avx512") ? 3 : !strcmp(name, "avx2") ? 2 : 1;
}

static double *random_numbers(size_t count, uint64_t seed)
{
  double *numbers = malloc(count * sizeof *numbers);
  assert_non_null(numbers);
  for (size_t i = 0; i < count; i++)
    numbers[i] = random_between(&seed, -1, 1);
  return numbers;
}

static double distance_squared(unsigned dimension, const double *a, const double *b)
{
  double s = 0;
  for (unsigned k = 0; k < dimension; k++)
    s += (a[k] - b[k]) * (a[k] - b[k]);
  return s;
}

/* ---- Products ----------------------------------------------------------------------- */

static void check_product(zs_rbf_radial radial, unsigned dimension, size_t targets,
                          size_t sources)
{
  double *at = random_numbers(targets * dimension, 1);
  double *from = random_numbers(sources * dimension, 2), *weights = random_numbers(sources, 3);
  double *sums = random_numbers(targets, 4), *before = random_numbers(targets, 4);
  double *matrix = random_numbers((targets + 3) * sources, 5);
  /* One pair coincides. */
  memcpy(at, from + (sources - 1) * dimension, dimension * sizeof *at);
  zs_rbf_product p = {.radial = radial, .dimension = dimension, .target_count = targets,
                      .source_count = sources, .targets = at, .sources = from,
                      .weights = weights, .sums = sums};
  zs_rbf_multiply(&p, 2);
  p.matrix = matrix;
  p.stride = targets + 3;
  zs_rbf_multiply_select()(&p);
  for (size_t i = 0; i < targets; i++) {
    double sum = before[i], size = 1;
    for (size_t j = 0; j < sources; j++) {
      const double phi = zs_rbf_phi(
        radial, distance_squared(dimension, at + i * dimension, from + j * dimension));
      assert_true(fabs(matrix[j * p.stride + i] - weights[j] * phi) <=
                  2e-15 * (1 + fabs(weights[j] * phi)));
      sum += weights[j] * phi;
      size += fabs(weights[j] * phi);
    }
    assert_true(fabs(sums[i] - sum) < 1e-14 * size);
  }
  free(at);
  free(from);
  free(weights);
  free(sums);
  free(before);
  free(matrix);
}

/* What each point gets from all of them, itself too, whatever the threads. */
static void check_symmetric(zs_rbf_radial radial, unsigned dimension, size_t count)
{
  double *points = random_numbers(count * dimension, 1), *weights = random_numbers(count, 3);
  double *sums[2] = {random_numbers(count, 4), random_numbers(count, 4)};
  double *before = random_numbers(count, 4);
  for (unsigned k = 0; k < 2; k++)
    zs_rbf_multiply_symmetric(&(zs_rbf_product){.radial = radial, .dimension = dimension,
                                                .target_count = count, .source_count = count,
                                                .targets = points, .sources = points,
                                                .weights = weights, .sums = sums[k]},
                              k ? 3 : 1);
  for (size_t i = 0; i < count; i++) {
    double sum = before[i], size = 1;
    for (size_t j = 0; j < count; j++) {
      const double phi = zs_rbf_phi(
        radial, distance_squared(dimension, points + i * dimension, points + j * dimension));
      sum += weights[j] * phi;
      size += fabs(weights[j] * phi);
    }
    assert_true(fabs(sums[0][i] - sum) < 1e-14 * size);
    assert_true(sums[1][i] == sums[0][i]);
  }
  free(points);
  free(weights);
  free(sums[0]);
  free(sums[1]);
  free(before);
}

static void products_are_sums_of_pairs(void **state)
{
  (void)state;
  for (unsigned isa = 0; isa < machine_isas(); isa++) {
    assert_int_equal(setenv("ZEROSET_ISA", isas[isa], 1), 0);
    for (unsigned dimension = 2; dimension <= 5; dimension++)
      for (int kernel = 0; kernel < ZS_RBF_KERNEL_COUNT; kernel++) {
        const zs_rbf_radial radial = {(zs_rbf_kernel)kernel, 20};
        check_product(radial, dimension, 1, 1);
        check_product(radial, dimension, 37, 5);
        check_product(radial, dimension, 300, 700);
        check_symmetric(radial, dimension, 1);
        check_symmetric(radial, dimension, 130 * (unsigned)kernel + 77);
      }
  }
  unsetenv("ZEROSET_ISA");
}

/* ---- Small matrices ------------------------------------------------------------------ */

/* A random symmetric positive definite matrix with the given condition. */
static double *definite_matrix(size_t n, double condition, uint64_t seed)
{
  double *q = random_numbers(n * n, seed), *a = calloc(n * n, sizeof *a);
  double *tau = malloc(n * sizeof *tau);
  assert_non_null(a);
  assert_non_null(tau);
  const lapack_int size = (lapack_int)n;
  assert_int_equal(LAPACKE_dgeqrf(LAPACK_COL_MAJOR, size, size, q, size, tau), 0);
  for (size_t i = 0; i < n; i++)
    a[i * n + i] = pow(condition, -(double)i / (double)(n - 1));
  for (int side = 0; side < 2; side++)
    assert_int_equal(LAPACKE_dormqr(LAPACK_COL_MAJOR, side ? 'R' : 'L', side ? 'T' : 'N', size,
                                    size, size, q, size, tau, a, size),
                     0);
  free(q);
  free(tau);
  return a;
}

static void check_rows(size_t size, size_t inner, double condition)
{
  double *a = definite_matrix(size, condition, 7), *copy = malloc(size * size * sizeof *copy);
  double *rows = random_numbers(inner * size, 8);
  assert_non_null(copy);
  memcpy(copy, a, size * size * sizeof *copy);
  const zs_local local = {size, inner, a, rows};
  assert_true(zs_local_select()->invert(&local));
  /* Rows of the inverse by the matrix are rows of the identity. */
  for (size_t i = 0; i < inner; i++)
    for (size_t j = 0; j < size; j++) {
      double sum = 0;
      for (size_t k = 0; k < size; k++)
        sum += rows[k * inner + i] * copy[j * size + k];
      assert_true(fabs(sum - (j == size - inner + i)) < 1e-13 * condition);
    }
  free(a);
  free(copy);
  free(rows);
}

static void rows_of_inverses(void **state)
{
  (void)state;
  for (unsigned isa = 0; isa < machine_isas(); isa++) {
    assert_int_equal(setenv("ZEROSET_ISA", isas[isa], 1), 0);
    check_rows(16, 16, 10);
    check_rows(112, 32, 1e4);
    check_rows(240, 80, 1e6);
  }
  unsetenv("ZEROSET_ISA");
}

/* The leading part of a larger matrix, whose other numbers stay as they are. */
static void check_factor(size_t size, size_t stride, double condition)
{
  double *a = definite_matrix(stride, condition, 9), *l = malloc(stride * stride * sizeof *l);
  assert_non_null(l);
  memcpy(l, a, stride * stride * sizeof *l);
  assert_true(zs_local_select()->factorise(l, stride, size));
  for (size_t j = 0; j < stride; j++)
    for (size_t i = j; i < stride; i++) {
      double sum = i < size ? 0 : l[j * stride + i];
      for (size_t k = 0; i < size && k <= j; k++)
        sum += l[k * stride + i] * l[k * stride + j];
      assert_true(fabs(sum - a[j * stride + i]) < 1e-13);
    }
  free(a);
  free(l);
}

static void factors_are_those_of_matrices_of_any_size(void **state)
{
  (void)state;
  for (unsigned isa = 0; isa < machine_isas(); isa++) {
    assert_int_equal(setenv("ZEROSET_ISA", isas[isa], 1), 0);
    for (size_t size = 1; size < 70; size++)
      check_factor(size, size + 2 + size % 5, 1e4);
    check_factor(531, 540, 1e6);
  }
  unsetenv("ZEROSET_ISA");
}

static void indefinite_matrices_are_refused(void **state)
{
  (void)state;
  enum { SIZE = 48 };
  for (unsigned isa = 0; isa < machine_isas(); isa++) {
    assert_int_equal(setenv("ZEROSET_ISA", isas[isa], 1), 0);
    for (int bad = 0; bad < 3; bad++) {
      double *a = definite_matrix(SIZE, 100, 3), *rows = random_numbers(16 * SIZE, 4);
      a[20 * SIZE + 20] = bad == 0 ? -1 : bad == 1 ? 0 : (double)NAN;
      double *copy = malloc(SIZE * SIZE * sizeof *copy);
      assert_non_null(copy);
      memcpy(copy, a, SIZE * SIZE * sizeof *copy);
      assert_false(zs_local_select()->invert(&(zs_local){SIZE, 16, a, rows}));
      assert_false(zs_local_select()->factorise(copy, SIZE, SIZE - 5));
      free(copy);
      free(a);
      free(rows);
    }
  }
  unsetenv("ZEROSET_ISA");
}

static void rows_are_applied(void **state)
{
  (void)state;
  enum { INNER = 37, COUNT = 91 };
  double *random = random_numbers(INNER * COUNT, 5), *values = random_numbers(COUNT, 6);
  float rows[INNER * COUNT];
  for (size_t i = 0; i < INNER * COUNT; i++)
    rows[i] = (float)random[i];
  for (unsigned isa = 0; isa < machine_isas(); isa++) {
    assert_int_equal(setenv("ZEROSET_ISA", isas[isa], 1), 0);
    double sums[INNER];
    for (size_t i = 0; i < INNER; i++)
      sums[i] = (double)i;
    zs_local_select()->apply(rows, INNER, COUNT, values, sums);
    for (size_t i = 0; i < INNER; i++) {
      double expected = (double)i;
      for (size_t j = 0; j < COUNT; j++)
        expected += (double)rows[j * INNER + i] * values[j];
      assert_true(fabs(sums[i] - expected) < 1e-13);
    }
  }
  unsetenv("ZEROSET_ISA");
  free(random);
  free(values);
}

/* ---- Clusters ------------------------------------------------------------------------ */

static void check_tree(const zs_rbf_clusters *all, const double *points, size_t most)
{
  bool *seen = calloc(all->count, sizeof *seen);
  assert_non_null(seen);
  for (size_t i = 0; i < all->count; i++) {
    assert_false(seen[all->order[i]]);
    seen[all->order[i]] = true;
    assert_memory_equal(all->points + i * all->dimension,
                        points + (size_t)all->order[i] * all->dimension,
                        all->dimension * sizeof *points);
  }
  for (size_t c = 0; c < all->cluster_count; c++) {
    const zs_rbf_cluster *cluster = &all->clusters[c];
    assert_true(cluster->children || cluster->count <= most);
    for (size_t i = cluster->first; i < cluster->first + cluster->count; i++)
      for (unsigned k = 0; k < all->dimension; k++) {
        assert_true(all->points[i * all->dimension + k] >= cluster->lo[k]);
        assert_true(all->points[i * all->dimension + k] <= cluster->hi[k]);
      }
    if (cluster->children) {
      const zs_rbf_cluster *half = &all->clusters[cluster->children];
      assert_int_equal(half[0].first, cluster->first);
      assert_int_equal(half[1].first, cluster->first + half[0].count);
      assert_int_equal(half[0].count + half[1].count, cluster->count);
    }
  }
  free(seen);
}

static double gap_squared(const zs_rbf_clusters *all, const zs_rbf_cluster *part, size_t i)
{
  double sum = 0;
  for (unsigned k = 0; k < all->dimension; k++) {
    const double x = all->points[i * all->dimension + k];
    const double gap = fmax(fmax(part->lo[k] - x, x - part->hi[k]), 0);
    sum += gap * gap;
  }
  return sum;
}

/* No point outside is nearer than the farthest of those found. */
static void check_around(const zs_rbf_clusters *all, const zs_rbf_cluster *cluster,
                         const zs_rbf_cluster *part, size_t count)
{
  zs_rbf_neighbour around[60];
  const size_t found = zs_rbf_clusters_around(all, cluster, part, count, around);
  const size_t outside = all->count - cluster->count;
  assert_int_equal(found, count < outside ? count : outside);
  double farthest = 0;
  size_t nearer = 0, no_farther = 0;
  for (size_t i = 0; i < found; i++) {
    assert_true(around[i].point < cluster->first ||
                around[i].point >= cluster->first + cluster->count);
    assert_true(around[i].square == gap_squared(all, part, around[i].point));
    for (size_t j = 0; j < i; j++)
      assert_int_not_equal(around[i].point, around[j].point);
    farthest = fmax(farthest, around[i].square);
  }
  for (size_t i = 0; i < all->count; i++)
    if (i < cluster->first || i >= cluster->first + cluster->count) {
      nearer += gap_squared(all, part, i) < farthest;
      no_farther += gap_squared(all, part, i) <= farthest;
    }
  assert_true(nearer < found || found == 0);
  assert_true(no_farther >= found);
}

static void clusters_hold_every_point_once(void **state)
{
  (void)state;
  static const size_t counts[] = {1, 2, 13, 700}, mosts[] = {1, 5, 12};
  for (unsigned dimension = 2; dimension <= 5; dimension++)
    for (int flat = 0; flat < 2; flat++)
      for (size_t n = 0; n < 4; n++)
        for (size_t m = 0; m < 3; m++) {
          double *points = random_numbers(counts[n] * dimension, 9);
          for (size_t i = 0; flat && i < counts[n] * dimension; i++)
            points[i] = floor(2 * points[i]); /* many coincide */
          zs_rbf_clusters *all =
            zs_rbf_clusters_new(points, counts[n], dimension, mosts[m]);
          assert_non_null(all);
          check_tree(all, points, mosts[m]);
          for (size_t c = 0; c < all->cluster_count; c += 7)
            check_around(all, &all->clusters[c], &all->clusters[c], c % 60);
          check_around(all, &all->clusters[0], &all->clusters[all->cluster_count - 1], 9);
          zs_rbf_clusters_free(all);
          free(points);
        }
}

static void cuts_cover_all_points(void **state)
{
  (void)state;
  double *points = random_numbers(900 * 3, 10);
  zs_rbf_clusters *all = zs_rbf_clusters_new(points, 900, 3, 4);
  assert_non_null(all);
  for (size_t most = 4; most < 1000; most *= 3) {
    const zs_rbf_cluster *list[900];
    const size_t count = zs_rbf_clusters_cut(all, most, list);
    assert_int_equal(count, zs_rbf_clusters_cut(all, most, NULL));
    size_t next = 0;
    for (size_t i = 0; i < count; i++) {
      assert_int_equal(list[i]->first, next);
      assert_true(list[i]->count <= most);
      next += list[i]->count;
    }
    assert_int_equal(next, 900);
  }
  const zs_rbf_cluster *parts[900];
  size_t count = zs_rbf_clusters_parts(all, &all->clusters[1], parts), sum = 0;
  for (size_t i = 0; i < count; i++) {
    assert_int_equal(parts[i]->children, 0);
    sum += parts[i]->count;
  }
  assert_int_equal(sum, all->clusters[1].count);
  zs_rbf_clusters_free(all);
  free(points);
}

/* ---- Flexible GMRES ------------------------------------------------------------------- */

enum { EQUATIONS = 60 };

typedef struct equations {
  double *matrix, diagonal[EQUATIONS];
  unsigned steps, most, calls;
  double norm;
} equations;

static bool multiply(void *context, const double *x, double *result)
{
  equations *e = context;
  for (size_t i = 0; i < EQUATIONS; i++) {
    result[i] = 0;
    for (size_t j = 0; j < EQUATIONS; j++)
      result[i] += e->matrix[j * EQUATIONS + i] * x[j];
  }
  return true;
}

/* A preconditioner that is never the same twice. */
static bool precondition(void *context, const double *r, double *z)
{
  equations *e = context;
  e->calls++;
  for (size_t i = 0; i < EQUATIONS; i++)
    z[i] = r[i] / e->diagonal[i] * (1 + 0.1 * sin((double)(e->calls + i)));
  return true;
}

static bool step(void *context, double norm)
{
  equations *e = context;
  assert_true(norm <= e->norm * (1 + 1e-12));
  e->norm = norm;
  return ++e->steps < e->most;
}

/* Near its diagonal, whose entries are of many orders of magnitude. */
static equations *random_equations(void)
{
  equations *e = calloc(1, sizeof *e);
  assert_non_null(e);
  e->matrix = random_numbers(EQUATIONS * EQUATIONS, 12);
  for (size_t j = 0; j < EQUATIONS; j++) {
    e->diagonal[j] = pow(10, (double)(j % 7) - 3);
    for (size_t i = 0; i < EQUATIONS; i++)
      e->matrix[j * EQUATIONS + i] =
        i == j ? e->diagonal[j] : 0.05 * e->diagonal[j] * e->matrix[j * EQUATIONS + i];
  }
  e->most = 1000;
  e->norm = INFINITY;
  return e;
}

static void free_equations(equations *e)
{
  free(e->matrix);
  free(e);
}

static void fgmres_solves_as_lapack(void **state)
{
  (void)state;
  equations *e = random_equations();
  const zs_fgmres fgmres = {EQUATIONS, e, multiply, precondition, step};
  double *b = random_numbers(EQUATIONS, 13), x[EQUATIONS] = {0}, exact[EQUATIONS];
  lapack_int pivots[EQUATIONS];
  assert_int_equal(zs_fgmres_solve(&fgmres, b, 1e-11, x), ZS_FGMRES_DONE);
  assert_true(e->norm <= 1e-11);
  memcpy(exact, b, sizeof exact);
  assert_int_equal(LAPACKE_dgesv(LAPACK_COL_MAJOR, EQUATIONS, 1, e->matrix, EQUATIONS, pivots,
                                 exact, EQUATIONS),
                   0);
  for (size_t i = 0; i < EQUATIONS; i++)
    assert_true(fabs(x[i] - exact[i]) < 1e-8 * (1 + fabs(exact[i])));
  free(b);
  free_equations(e);
}

static void fgmres_ends(void **state)
{
  (void)state;
  equations *e = random_equations();
  const zs_fgmres fgmres = {EQUATIONS, e, multiply, precondition, step};
  double *b = random_numbers(EQUATIONS, 13), x[EQUATIONS] = {0};
  /* What rounding leaves cannot be had. */
  assert_int_equal(zs_fgmres_solve(&fgmres, b, 0, x), ZS_FGMRES_STALLED);
  assert_true(e->norm < 1e-12);
  /* A callback says when to stop. */
  e->most = 3;
  e->steps = 0;
  e->norm = INFINITY;
  assert_int_equal(zs_fgmres_solve(&fgmres, b, 0, x), ZS_FGMRES_STOPPED);
  assert_int_equal(e->steps, 3);
  /* A right-hand side of nothing is solved already. */
  memset(b, 0, EQUATIONS * sizeof *b);
  memset(x, 0, sizeof x);
  assert_int_equal(zs_fgmres_solve(&fgmres, b, 0, x), ZS_FGMRES_DONE);
  assert_true(x[0] == 0);
  /* A matrix of nothing has no solution. */
  memset(e->matrix, 0, EQUATIONS * EQUATIONS * sizeof *e->matrix);
  b[0] = 1;
  e->norm = INFINITY;
  e->most = 1000;
  assert_int_equal(zs_fgmres_solve(&fgmres, b, 1e-9, x), ZS_FGMRES_STALLED);
  for (size_t i = 0; i < EQUATIONS; i++)
    assert_true(x[i] == 0);
  free(b);
  free_equations(e);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(products_are_sums_of_pairs),
    cmocka_unit_test(rows_of_inverses),
    cmocka_unit_test(factors_are_those_of_matrices_of_any_size),
    cmocka_unit_test(indefinite_matrices_are_refused),
    cmocka_unit_test(rows_are_applied),
    cmocka_unit_test(clusters_hold_every_point_once),
    cmocka_unit_test(cuts_cover_all_points),
    cmocka_unit_test(fgmres_solves_as_lapack),
    cmocka_unit_test(fgmres_ends),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
