/* Sums as operations: every instruction set against the definition. */
#include "../random.h"

#include "field/compiler.h"
#include "field/program.h"
#include "rbf/sum.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Instruction sets that the machine has. */
static unsigned machine_isas(void)
{
  const char *name = zs_isa();
  return !strcmp(name, "avx512") ? 3 : !strcmp(name, "avx2") ? 2 : 1;
}

/* A sphere's constraints: on it, and beside it on both sides. */
static zs_rbf *sphere_fit(unsigned dimension, zs_rbf_kernel kernel, size_t count, uint64_t seed)
{
  double *positions = malloc(3 * dimension * count * sizeof *positions);
  double *values = malloc(3 * count * sizeof *values);
  assert_non_null(positions);
  assert_non_null(values);
  for (size_t i = 0; i < count; i++) {
    double p[ZS_RBF_MAXIMUM_DIMENSION], length;
    do {
      length = 0;
      for (unsigned k = 0; k < dimension; k++) {
        p[k] = random_between(&seed, -1, 1);
        length += p[k] * p[k];
      }
      length = sqrt(length);
    } while (length < 0.1 || length > 1);
    for (unsigned side = 0; side < 3; side++) {
      const double radius = 1 + 0.05 * ((int)side - 1);
      for (unsigned k = 0; k < dimension; k++)
        positions[dimension * (3 * i + side) + k] = p[k] / length * radius;
      values[3 * i + side] = 1 - radius;
    }
  }
  const zs_rbf_problem problem = {.dimension = dimension, .kernel = kernel, .degree = 2,
                                  .count = 3 * count, .positions = positions, .values = values};
  zs_rbf *rbf = zs_rbf_fit(&problem, NULL, NULL, NULL);
  assert_non_null(rbf);
  free(positions);
  free(values);
  return rbf;
}

/* Where fits of more than three dimensions are cut. */
static const double slice[2] = {0.1, -0.2};

static zs_rbf_sum *sum_of(const zs_rbf *rbf, unsigned threads)
{
  zs_control control;
  zs_control_init(&control);
  control.threads = threads;
  zs_rbf_sum *sum =
    zs_rbf_sum_new(rbf, rbf->dimension < 3 ? 2 : 3, slice, ZS_RBF_ACCURACY, &control, NULL);
  assert_non_null(sum);
  return sum;
}

/* Each kernel in space, then in a slice of 4 or 5 dimensions. */
enum { CASES = 2 * ZS_RBF_KERNEL_COUNT };

static zs_rbf_kernel kernel_of(unsigned c)
{
  return (zs_rbf_kernel)(c % ZS_RBF_KERNEL_COUNT);
}

static unsigned dimension_of(unsigned c)
{
  return c < ZS_RBF_KERNEL_COUNT ? 3 : 4 + c % 2;
}

enum { SIDE = 64 }; /* of grids */
enum { ON_CENTRE = 5 }; /* the point of a block that lies on a centre */

typedef struct rows {
  _Alignas(64) float row[4][ZS_BLOCK];
} rows;

/* Random points, with random derivatives by the frame's coordinates. */
static void random_points(rows in[3], const zs_rbf_sum *sum, uint64_t *seed)
{
  for (int k = 0; k < 3; k++)
    for (int i = 0; i < ZS_BLOCK; i++) {
      in[k].row[0][i] = (float)random_between(seed, -0.6, 0.6);
      for (int r = 1; r < 4; r++)
        in[k].row[r][i] = (float)random_between(seed, -1, 1);
    }
  /* One point on a centre, where slopes are most likely to go wrong. */
  const zs_rbf_centre *c = &sum->terms.centres[0];
  const double centre[3] = {c->x, c->y, c->z};
  for (int k = 0; k < 3; k++)
    in[k].row[0][ON_CENTRE] = (float)centre[k];
}

static double reference(const zs_rbf_sum *sum, const double in[3])
{
  return zs_rbf_sum_operation(sum->kernel)->reference(sum, in);
}

static void blocks_follow_the_definition(void **state)
{
  (void)state;
  static rows in[3], value, gradient;
  uint64_t seed = 12;
  for (unsigned c = 0; c < CASES; c++) {
    const zs_rbf_kernel kernel = kernel_of(c);
    zs_rbf *rbf = sphere_fit(dimension_of(c), kernel, 190, 3);
    zs_rbf_sum *sum = sum_of(rbf, 2);
    random_points(in, sum, &seed);
    for (unsigned isa = 0; isa < machine_isas(); isa++) {
      const zs_kernels *kernels = zs_rbf_sum_operation(sum->kernel)->kernels[isa];
      for (unsigned n = 16; n <= ZS_BLOCK; n += 48) {
        zs_block_arguments a = {.data = sum, .n = n,
                                .in = {in[0].row[0], in[1].row[0], in[2].row[0]},
                                .out = value.row[0]};
        kernels->value(&a);
        a.out = gradient.row[0];
        kernels->gradient(&a);
        for (unsigned i = 0; i < n; i++) {
          const double x[3] = {(double)in[0].row[0][i], (double)in[1].row[0][i],
                               (double)in[2].row[0][i]};
          double f = reference(sum, x), slope[3];
          assert_true(fabs((double)value.row[0][i] - f) < 1e-6 * (1 + fabs(f)));
          assert_true(fabs((double)gradient.row[0][i] - f) < 1e-6 * (1 + fabs(f)));
          for (int k = 0; k < 3; k++) {
            const double h = 1e-6;
            double p[3] = {x[0], x[1], x[2]}, q[3] = {x[0], x[1], x[2]};
            p[k] += h;
            q[k] -= h;
            slope[k] = (reference(sum, p) - reference(sum, q)) / (2 * h);
          }
          for (int r = 1; r < 4; r++) {
            double expected = 0, size = 1;
            for (int k = 0; k < 3; k++) {
              expected += slope[k] * (double)in[k].row[r][i];
              size += fabs(slope[k]);
            }
            float found = gradient.row[r][i];
            /* Sums of r have a kink at their centres. */
            assert_true(kernel == ZS_RBF_R && i == ON_CENTRE
                          ? isfinite(found)
                          : fabs((double)found - expected) < 3e-4 * size);
          }
        }
      }
    }
    zs_rbf_sum_free(sum);
    zs_rbf_free(rbf);
  }
}

/* Slices of fits seen from the plane: cell by cell, within bounds, and far from the fit. */
static void sums_in_the_plane_follow_the_fit(void **state)
{
  (void)state;
  static const double beyond[3] = {0.15, -0.1, 0.2}, sizes[] = {0.6, 4, 19};
  uint64_t seed = 6;
  for (unsigned dimension = 2; dimension <= ZS_RBF_MAXIMUM_DIMENSION; dimension++) {
    zs_rbf *rbf = sphere_fit(dimension, ZS_RBF_R3, 300, dimension);
    zs_rbf_sum *sum = zs_rbf_sum_new(rbf, 2, beyond, ZS_RBF_ACCURACY, NULL, NULL);
    assert_non_null(sum);
    const float lo[3] = {-19, -19, 0}, hi[3] = {19, 19, 0};
    const void *inside = zs_rbf_sum_restricted(sum, lo, hi, NULL);
    assert_ptr_not_equal(inside, sum);
    for (size_t size = 0; size < sizeof sizes / sizeof *sizes; size++) {
      static rows in[3], out;
      for (int i = 0; i < ZS_BLOCK; i++) {
        in[0].row[0][i] = (float)random_between(&seed, -sizes[size], sizes[size]);
        in[1].row[0][i] = (float)random_between(&seed, -sizes[size], sizes[size]);
        in[2].row[0][i] = 0;
      }
      zs_block_arguments a = {.data = inside, .n = ZS_BLOCK,
                              .in = {in[0].row[0], in[1].row[0], in[2].row[0]},
                              .out = out.row[0]};
      zs_rbf_sum_operation(ZS_RBF_R3)->kernels[zs_isa_select()]->value(&a);
      for (int i = 0; i < ZS_BLOCK; i++) {
        double x[ZS_RBF_MAXIMUM_DIMENSION];
        float box[2][3], f[2];
        for (unsigned k = 0; k < dimension; k++)
          x[k] = k < 2 ? rbf->centre[k] + rbf->size * (double)in[k].row[0][i] : beyond[k - 2];
        const double expected = zs_rbf_value(rbf, x);
        assert_true(fabs((double)out.row[0][i] - expected) < 5e-6 * (1 + fabs(expected)));
        for (int k = 0; k < 3; k++) {
          const float half = k < 2 ? 0.01f : 0;
          box[0][k] = in[k].row[0][i] - half;
          box[1][k] = in[k].row[0][i] + half;
        }
        zs_rbf_tree_bounds(sum->tree, box[0], box[1], f);
        assert_true((double)f[0] <= expected && expected <= (double)f[1]);
      }
    }
    zs_rbf_sum_free(sum);
    zs_rbf_free(rbf);
  }
}

/* The output may be one of the inputs. */
static void blocks_work_in_place(void **state)
{
  (void)state;
  static rows in[3], copy[3], out;
  uint64_t seed = 1;
  zs_rbf *rbf = sphere_fit(3, ZS_RBF_R3, 60, 9);
  zs_rbf_sum *sum = sum_of(rbf, 2);
  random_points(in, sum, &seed);
  const zs_kernels *kernels = zs_rbf_sum_operation(ZS_RBF_R3)->kernels[0];
  for (int k = 0; k < 3; k++) {
    memcpy(copy, in, sizeof copy);
    zs_block_arguments a = {.data = sum, .n = ZS_BLOCK,
                            .in = {copy[0].row[0], copy[1].row[0], copy[2].row[0]},
                            .out = out.row[0]};
    kernels->gradient(&a);
    a.out = copy[k].row[0];
    kernels->gradient(&a);
    assert_memory_equal(out.row, copy[k].row, sizeof out.row);
  }
  zs_rbf_sum_free(sum);
  zs_rbf_free(rbf);
}

/* So do slices of fits of more dimensions, and fits in the plane. */
static void sums_equal_fits(void **state)
{
  (void)state;
  uint64_t seed = 4;
  for (unsigned dimension = 2; dimension <= ZS_RBF_MAXIMUM_DIMENSION; dimension++)
    for (int kernel = 0; kernel < ZS_RBF_KERNEL_COUNT; kernel++) {
      zs_rbf *rbf = sphere_fit(dimension, (zs_rbf_kernel)kernel, 60, 5);
      zs_rbf_sum *sum = sum_of(rbf, 2);
      for (int i = 0; i < 50; i++) {
        double x[5] = {0, 0, 0, slice[0], slice[1]}, u[3] = {0};
        for (unsigned k = 0; k < dimension && k < 3; k++) {
          x[k] = random_between(&seed, -2, 2);
          u[k] = (x[k] - rbf->centre[k]) / rbf->size;
        }
        const double f = zs_rbf_value(rbf, x);
        assert_true(fabs(reference(sum, u) - f) < 1e-8 * (1 + fabs(f)));
      }
      zs_rbf_sum_free(sum);
      zs_rbf_free(rbf);
    }
}

/* Random boxes of all sizes inside the cube that the tree covers hold their
 * samples, in double precision and in blocks, and the sign is known for most
 * small boxes away from the surface. */
static void bounds_hold_samples(void **state)
{
  (void)state;
  uint64_t seed = 31;
  for (unsigned c = 0; c < CASES; c++) {
    const zs_rbf_kernel kernel = kernel_of(c);
    zs_rbf *rbf = sphere_fit(dimension_of(c), kernel, 100, 4);
    zs_rbf_sum *sum = sum_of(rbf, 2);
    unsigned decided = 0, small = 0;
    for (int round = 0; round < 25; round++) {
      static rows in[3], out;
      zs_bounds boxes[3], f;
      /* Most of them about the centres. */
      const double reach = round % 5 ? 0.8 : 5;
      for (int l = 0; l < ZS_LANES; l++)
        for (int k = 0; k < 3; k++) {
          double half = exp(random_between(&seed, log(0.002), log(0.6)));
          double middle = random_between(&seed, half - reach, reach - half);
          boxes[k].lo[l] = fmaxf((float)(middle - half), (float)-reach);
          boxes[k].hi[l] = fminf((float)(middle + half), (float)reach);
        }
      zs_bounds_arguments a = {.data = sum, .in = {&boxes[0], &boxes[1], &boxes[2]}, .out = &f};
      const zs_kernels *kernels = zs_rbf_sum_operation(sum->kernel)->kernels[0];
      kernels->bounds(&a);
      for (int l = 0; l < ZS_LANES; l++) {
        const bool known = f.lo[l] <= f.hi[l];
        assert_true(known || (isnan(f.lo[l]) && isnan(f.hi[l])));
        for (int i = 0; i < ZS_BLOCK; i++)
          for (int k = 0; k < 3; k++) {
            double lo = (double)boxes[k].lo[l], hi = (double)boxes[k].hi[l];
            /* Corners first. */
            in[k].row[0][i] = i < 8 ? (float)(i >> k & 1 ? hi : lo)
                                    : (float)random_between(&seed, lo, hi);
          }
        zs_block_arguments block = {.data = sum, .n = ZS_BLOCK,
                                    .in = {in[0].row[0], in[1].row[0], in[2].row[0]},
                                    .out = out.row[0]};
        kernels->value(&block);
        bool near = false;
        for (int i = 0; i < ZS_BLOCK; i++) {
          const double x[3] = {(double)in[0].row[0][i], (double)in[1].row[0][i],
                               (double)in[2].row[0][i]};
          near = near || fabsf(out.row[0][i]) < 0.15f;
          if (!known)
            continue;
          assert_true(out.row[0][i] >= f.lo[l] && out.row[0][i] <= f.hi[l]);
          if (i < 32) {
            double exact = reference(sum, x);
            assert_true(exact >= (double)f.lo[l] && exact <= (double)f.hi[l]);
          }
        }
        small += !near;
        decided += !near && known && (f.lo[l] >= 0 || f.hi[l] < 0);
      }
    }
    assert_true(small > 20);
    assert_true(decided > 0.8 * small);
    zs_rbf_sum_free(sum);
    zs_rbf_free(rbf);
  }
}

/* Compare a restricted sum with the whole one at random points of a box: f to the
 * promised tolerance near the surface and to a part of f away from it, block
 * kernels to single precision. */
static void compare_in_box(const zs_rbf_sum *whole, const zs_rbf_sum *part, const float lo[3],
                           const float hi[3], uint64_t *seed)
{
  static rows in[3], value, gradient, expected;
  const double slope = 2; /* of f, or so, in the unit box */
  for (int k = 0; k < 3; k++) {
    memset(in[k].row, 0, sizeof in[k].row);
    for (int i = 0; i < ZS_BLOCK; i++) {
      double x = i < 8 ? (double)(i >> k & 1 ? hi[k] : lo[k])
                       : random_between(seed, (double)lo[k], (double)hi[k]);
      in[k].row[0][i] = (float)x;
      in[k].row[k + 1][i] = 1;
    }
  }
  zs_block_arguments a = {.data = whole, .n = ZS_BLOCK,
                          .in = {in[0].row[0], in[1].row[0], in[2].row[0]},
                          .out = expected.row[0]};
  zs_rbf_sum_operation(whole->kernel)->kernels[0]->gradient(&a);
  a.data = part;
  for (unsigned isa = 0; isa < machine_isas(); isa++) {
    a.out = value.row[0];
    zs_rbf_sum_operation(part->kernel)->kernels[isa]->value(&a);
    a.out = gradient.row[0];
    zs_rbf_sum_operation(part->kernel)->kernels[isa]->gradient(&a);
    for (int i = 0; i < ZS_BLOCK; i++) {
      const double x[3] = {(double)in[0].row[0][i], (double)in[1].row[0][i],
                           (double)in[2].row[0][i]};
      const double f = reference(whole, x), g = reference(part, x);
      const double away = fabs(f) > 0.04 ? 1e-5 * fabs(f) : 0;
      assert_true(fabs(f - g) <= whole->tolerance + away + 1e-12);
      assert_true(fabs((double)value.row[0][i] - g) <= 1e-7 * (fabs(g) + slope));
      assert_true(fabs((double)gradient.row[0][i] - g) <= 1e-7 * (fabs(g) + slope));
      for (int r = 1; r < 4; r++)
        assert_true(fabs((double)(gradient.row[r][i] - expected.row[r][i])) < 1e-4 * slope);
    }
  }
}

static void restricted_sums_equal_the_whole(void **state)
{
  (void)state;
  uint64_t seed = 77;
  for (unsigned c = 0; c < CASES; c++) {
    zs_rbf *rbf = sphere_fit(dimension_of(c), kernel_of(c), 150, 3);
    zs_rbf_sum *whole = sum_of(rbf, 2);
    for (int i = 0; i < 12; i++) {
      const double side = exp(random_between(&seed, log(0.02), log(1.5)));
      float lo[3], hi[3];
      for (int k = 0; k < 3; k++) {
        lo[k] = (float)random_between(&seed, -0.8, 0.8 - side);
        hi[k] = lo[k] + (float)side;
      }
      const zs_rbf_sum *part = zs_rbf_sum_restricted(whole, lo, hi, NULL);
      assert_true(part != whole && part->restricted);
      assert_ptr_equal(zs_rbf_sum_restricted(part, lo, hi, NULL), part);
      compare_in_box(whole, part, lo, hi, &seed);
    }
    /* Where cells do not reach, or the box is not known. */
    const float cube_lo[3] = {-1, -1, -1}, far[3] = {6, 7, 8};
    const float unknown[3] = {NAN, NAN, NAN}, endless[3] = {INFINITY, 0, 0};
    assert_ptr_equal(zs_rbf_sum_restricted(whole, cube_lo, far, NULL), whole);
    assert_ptr_equal(zs_rbf_sum_restricted(whole, unknown, unknown, NULL), whole);
    assert_ptr_equal(zs_rbf_sum_restricted(whole, cube_lo, endless, NULL), whole);
    zs_rbf_sum_free(whole);
    zs_rbf_free(rbf);
  }
}

static void few_centres_are_added_up(void **state)
{
  (void)state;
  zs_rbf *rbf = sphere_fit(3, ZS_RBF_R3, 12, 3);
  zs_rbf_sum *sum = sum_of(rbf, 2);
  const float lo[3] = {0, 0, 0}, hi[3] = {0.1f, 0.1f, 0.1f};
  assert_ptr_equal(zs_rbf_sum_restricted(sum, lo, hi, NULL), sum);
  zs_rbf_sum_free(sum);
  zs_rbf_free(rbf);
}

/* What is asked for is kept near the surface, and less costs less. */
static void accuracy_is_kept(void **state)
{
  (void)state;
  static const double accuracies[] = {1e-9, 1e-6, 1e-3};
  zs_rbf *rbf = sphere_fit(3, ZS_RBF_R3, 300, 6);
  size_t before = SIZE_MAX;
  for (size_t a = 0; a < sizeof accuracies / sizeof *accuracies; a++) {
    zs_rbf_sum *sum = zs_rbf_sum_new(rbf, 3, NULL, accuracies[a], NULL, NULL);
    assert_non_null(sum);
    uint64_t seed = 5;
    for (int i = 0; i < 300; i++) {
      const zs_rbf_centre *c = &sum->terms.centres[random_below(&seed, (unsigned)rbf->count)];
      const double x[3] = {c->x + random_between(&seed, -0.01, 0.01),
                           c->y + random_between(&seed, -0.01, 0.01),
                           c->z + random_between(&seed, -0.01, 0.01)};
      /* f is between -0.05 and 0.05 at the centres. */
      assert_true(fabs(reference(sum->inside, x) - reference(sum, x)) <= 0.1 * accuracies[a]);
    }
    assert_true(sum->cells->bytes < before);
    before = sum->cells->bytes;
    zs_rbf_sum_free(sum);
  }
  zs_rbf_free(rbf);
}

static void bounds_are_unknown_outside(void **state)
{
  (void)state;
  zs_rbf *rbf = sphere_fit(3, ZS_RBF_R3, 40, 4);
  zs_rbf_sum *sum = sum_of(rbf, 1);
  const float boxes[][2] = {{-1, 5.5f}, {-INFINITY, INFINITY}, {NAN, NAN}, {12, 13}};
  for (size_t i = 0; i < sizeof boxes / sizeof *boxes; i++) {
    float f[2];
    const float lo[3] = {0, boxes[i][0], 0}, hi[3] = {0.5f, boxes[i][1], 0.5f};
    zs_rbf_tree_bounds(sum->tree, lo, hi, f);
    assert_true(isnan(f[0]) && isnan(f[1]));
  }
  zs_rbf_sum_free(sum);
  zs_rbf_free(rbf);
}

/* Values at random points: many small parts and holes, at all sizes. */
static zs_rbf *random_fit(zs_rbf_kernel kernel, size_t count, uint64_t *seed)
{
  double *positions = malloc(3 * count * sizeof *positions);
  double *values = malloc(count * sizeof *values);
  for (size_t i = 0; i < count; i++) {
    for (int k = 0; k < 3; k++)
      positions[3 * i + (size_t)k] = random_between(seed, -0.5, 0.5);
    values[i] = random_between(seed, -1, 0.7);
  }
  const zs_rbf_problem problem = {.dimension = 3, .kernel = kernel, .count = count,
                                  .positions = positions, .values = values};
  zs_rbf *rbf = zs_rbf_fit(&problem, NULL, NULL, NULL);
  assert_non_null(rbf);
  free(positions);
  free(values);
  return rbf;
}

static bool keep_slab(void *context, uint32_t z, uint32_t count_z, const void *samples)
{
  uint8_t **next = context;
  (void)z;
  memcpy(*next, samples, count_z * SIDE * SIDE);
  *next += count_z * SIDE * SIDE;
  return true;
}

/* Which samples are inside, and how many were evaluated. */
static uint64_t occupancy(const zs_rbf_sum *sum, bool brute, uint8_t *samples)
{
  zs_compiler *compiler = zs_compiler_new(NULL, NULL, NULL);
  const zs_coordinates root = zs_coordinates_root();
  zs_value u[3];
  for (int k = 0; k < 3; k++)
    u[k] = zs_emit_coordinate(compiler, &root, k);
  zs_value f =
    zs_emit_operation(compiler, zs_rbf_sum_operation(sum->kernel), sum, u[0], u[1], u[2]);
  zs_field *field = zs_compiler_finish(compiler, f, 1);
  const zs_grid grid = {{-0.6, -0.6, -0.6}, {1.2 / SIDE, 1.2 / SIDE, 1.2 / SIDE},
                        {SIDE, SIDE, SIDE}};
  zs_control control;
  zs_control_init(&control);
  control.brute = brute;
  zs_job_report report;
  assert_true(zs_voxelize(field, &grid, ZS_QUANTITY_INSIDE, keep_slab, &samples, NULL, &control,
                          &report, NULL));
  zs_field_unref(field);
  return report.evaluations;
}

/* Bounds that come from samples of f overlook nothing. */
static void pruning_loses_nothing(void **state)
{
  (void)state;
  static uint8_t pruned[SIDE * SIDE * SIDE], brute[SIDE * SIDE * SIDE];
  uint64_t seed = 20, evaluated = 0, all = 0;
  for (int i = 0; i < 20; i++) {
    zs_rbf *rbf =
      random_fit((zs_rbf_kernel)(i % ZS_RBF_KERNEL_COUNT), i < 19 ? 20 + 12 * (size_t)i : 700,
                 &seed);
    zs_rbf_sum *sum = sum_of(rbf, 2);
    evaluated += occupancy(sum, false, pruned);
    all += occupancy(sum, true, brute);
    assert_memory_equal(pruned, brute, sizeof brute);
    zs_rbf_sum_free(sum);
    zs_rbf_free(rbf);
  }
  assert_true(evaluated < all);
}

/* The number of threads changes nothing. */
static void threads_build_the_same_tree(void **state)
{
  (void)state;
  zs_rbf *rbf = sphere_fit(3, ZS_RBF_R3, 60, 4);
  zs_rbf_sum *one = sum_of(rbf, 1), *three = sum_of(rbf, 3);
  assert_int_equal(zs_rbf_tree_bytes(one->tree), zs_rbf_tree_bytes(three->tree));
  uint64_t seed = 3;
  for (int i = 0; i < 1000; i++) {
    float lo[3], hi[3], a[2], b[2];
    for (int k = 0; k < 3; k++) {
      lo[k] = (float)random_between(&seed, -0.6, 0.55);
      hi[k] = lo[k] + 0.05f;
    }
    zs_rbf_tree_bounds(one->tree, lo, hi, a);
    zs_rbf_tree_bounds(three->tree, lo, hi, b);
    assert_memory_equal(a, b, sizeof a);
  }
  zs_rbf_sum_free(one);
  zs_rbf_sum_free(three);
  zs_rbf_free(rbf);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(blocks_follow_the_definition),
    cmocka_unit_test(sums_in_the_plane_follow_the_fit),
    cmocka_unit_test(blocks_work_in_place),
    cmocka_unit_test(sums_equal_fits),
    cmocka_unit_test(bounds_hold_samples),
    cmocka_unit_test(restricted_sums_equal_the_whole),
    cmocka_unit_test(few_centres_are_added_up),
    cmocka_unit_test(accuracy_is_kept),
    cmocka_unit_test(bounds_are_unknown_outside),
    cmocka_unit_test(pruning_loses_nothing),
    cmocka_unit_test(threads_build_the_same_tree),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
