#include "samples/warp.h"

#include "samples/warp_point.h"

#include <stdlib.h>

static size_t padded(const zs_warp *warp, int axis)
{
  return warp->size[axis] + 2 * (size_t)ZS_WARP_PADDING;
}

static size_t cells_along(const zs_warp *warp, int axis)
{
  return warp->size[axis] + 3u;
}

static size_t cell_count(const zs_warp *warp)
{
  return cells_along(warp, 0) * cells_along(warp, 1) * cells_along(warp, 2);
}

zs_warp *zs_warp_new(const uint32_t size[3])
{
  zs_warp *warp = calloc(1, sizeof *warp);
  if (!warp)
    return NULL;
  memcpy(warp->size, size, sizeof warp->size);
  warp->moves = calloc(padded(warp, 0) * padded(warp, 1) * padded(warp, 2), sizeof *warp->moves);
  warp->cells = malloc(cell_count(warp) * sizeof *warp->cells);
  if (!warp->moves || !warp->cells) {
    zs_warp_free(warp);
    return NULL;
  }
  return warp;
}

void zs_warp_free(void *data)
{
  zs_warp *warp = data;
  if (!warp)
    return;
  free(warp->moves);
  free(warp->cells);
  free(warp->start);
  free(warp);
}

static double *padded_move(const zs_warp *warp, size_t i, size_t j, size_t k)
{
  return warp->moves[(k * padded(warp, 1) + j) * padded(warp, 0) + i];
}

double *zs_warp_move(zs_warp *warp, const uint32_t control[3])
{
  return padded_move(warp, control[0] + ZS_WARP_PADDING, control[1] + ZS_WARP_PADDING,
                     control[2] + ZS_WARP_PADDING);
}

bool zs_warp_is_identity(const zs_warp *warp)
{
  for (int k = 0; k < 3; k++)
    if (warp->all.lo[k] != 0 || warp->all.hi[k] != 0)
      return false;
  return true;
}

/* ---- Ranges ---------------------------------------------------------------------- */

/* What fmin and fmax are functions for, and slower. */
static inline double smaller(double a, double b)
{
  return a < b ? a : b;
}

static inline double larger(double a, double b)
{
  return a > b ? a : b;
}

static void join(zs_warp_range *all, const zs_warp_range *one)
{
  for (int k = 0; k < 3; k++) {
    all->lo[k] = smaller(all->lo[k], one->lo[k]);
    all->hi[k] = larger(all->hi[k], one->hi[k]);
    all->bend[k] = larger(all->bend[k], one->bend[k]);
    for (int j = 0; j < 3; j++) {
      all->slope_lo[k][j] = smaller(all->slope_lo[k][j], one->slope_lo[k][j]);
      all->slope_hi[k][j] = larger(all->slope_hi[k][j], one->slope_hi[k][j]);
    }
  }
}

/* Differences of a component's moves along an axis, or along two: of 4 x 4 x 4 numbers, x
 * fastest, what is behind the last is not used again. */
static void subtract(double numbers[64], unsigned count[3], int axis)
{
  const unsigned stride = axis == 0 ? 1 : axis == 1 ? 4 : 16;
  count[axis]--;
  for (unsigned n = 0; n + stride < 64; n++)
    numbers[n] = numbers[n + stride] - numbers[n];
}

static void take_in_all(double *lo, double *hi, const double numbers[64], const unsigned count[3])
{
  for (unsigned k = 0; k < count[2]; k++)
    for (unsigned j = 0; j < count[1]; j++)
      for (unsigned i = 0; i < count[0]; i++) {
        *lo = smaller(*lo, numbers[16 * k + 4 * j + i]);
        *hi = larger(*hi, numbers[16 * k + 4 * j + i]);
      }
}

/* Most cells of fine lattices are like that. */
static bool nothing_moves(const zs_warp *warp, const size_t first[3])
{
  for (size_t k = 0; k < 4; k++)
    for (size_t j = 0; j < 4; j++) {
      const double *row = padded_move(warp, first[0], first[1] + j, first[2] + k);
      for (size_t n = 0; n < 16; n++)
        if (row[n] != 0)
          return false;
    }
  return true;
}

/* D is a mean of the moves of 4 x 4 x 4 control points, its derivatives are means of their
 * differences along an axis, and second ones of differences of these: convex hulls hold them. */
static zs_warp_range range_of_cell(const zs_warp *warp, const size_t first[3])
{
  zs_warp_range r = {0};
  if (nothing_moves(warp, first))
    return r;
  for (int k = 0; k < 3; k++) {
    double own[64], slopes[64], bends[64];
    unsigned all[3] = {4, 4, 4};
    for (size_t n = 0; n < 64; n++)
      own[n] = padded_move(warp, first[0] + n % 4, first[1] + n / 4 % 4, first[2] + n / 16)[k];
    r.lo[k] = r.hi[k] = own[0];
    take_in_all(&r.lo[k], &r.hi[k], own, all);
    double bend_lo = 0, bend_hi = 0;
    for (int j = 0; j < 3; j++) {
      unsigned count[3] = {4, 4, 4};
      memcpy(slopes, own, sizeof slopes);
      subtract(slopes, count, j);
      r.slope_lo[k][j] = r.slope_hi[k][j] = slopes[0];
      take_in_all(&r.slope_lo[k][j], &r.slope_hi[k][j], slopes, count);
      for (int l = j; l < 3; l++) {
        unsigned fewer[3] = {count[0], count[1], count[2]};
        memcpy(bends, slopes, sizeof bends);
        subtract(bends, fewer, l);
        take_in_all(&bend_lo, &bend_hi, bends, fewer);
      }
    }
    r.bend[k] = larger(-bend_lo, bend_hi);
  }
  return r;
}

void zs_warp_finish(zs_warp *warp)
{
  const size_t nx = cells_along(warp, 0), ny = cells_along(warp, 1), nz = cells_along(warp, 2);
  warp->all = (zs_warp_range){0};
  for (size_t k = 0; k < nz; k++)
    for (size_t j = 0; j < ny; j++)
      for (size_t i = 0; i < nx; i++) {
        zs_warp_range *cell = &warp->cells[(k * ny + j) * nx + i];
        *cell = range_of_cell(warp, (const size_t[3]){i, j, k});
        join(&warp->all, cell);
      }
}

/* Over more cells than this along an axis the range is that of all. */
enum { MOST_CELLS = 5 };

/* Half sides of boxes, added up, in which the middle tells more than control points do. */
static const double MOST_WAY = 2;

/* The range over a box; what lies beyond the reach of the lattice adds 0. */
static zs_warp_range range_over(const zs_warp *warp, const double lo[3], const double hi[3])
{
  size_t from[3], to[3];
  bool beyond = false, far = false;
  for (int k = 0; k < 3; k++) {
    double t;
    const double slack = 1e-9 * (1 + fabs(lo[k]) + fabs(hi[k]));
    from[k] = zs_warp_cell(warp->size[k], lo[k] - slack, &t);
    to[k] = zs_warp_cell(warp->size[k], hi[k] + slack, &t);
    beyond |= !(lo[k] >= -2 && hi[k] <= (double)warp->size[k] + 1);
    far |= to[k] - from[k] >= MOST_CELLS;
  }
  if (far)
    return warp->all;
  const size_t nx = cells_along(warp, 0), ny = cells_along(warp, 1);
  zs_warp_range r = warp->cells[(from[2] * ny + from[1]) * nx + from[0]];
  for (size_t k = from[2]; k <= to[2]; k++)
    for (size_t j = from[1]; j <= to[1]; j++)
      for (size_t i = from[0]; i <= to[0]; i++)
        join(&r, &warp->cells[(k * ny + j) * nx + i]);
  if (beyond)
    join(&r, &(zs_warp_range){0});
  return r;
}

/* What is known of a box: D in its middle and its derivatives there, how far it is to the
 * sides, and the ranges of D and its derivatives over it. */
typedef struct region {
  double middle[3], half[3], value[3], slope[3][3];
  zs_warp_range range;
} region;

/* The range is that of the control points, and about the middle what the largest derivatives
 * of the next order allow: less only in small boxes, and false in others, without the middle. */
static bool examine(const zs_warp *warp, const double lo[3], const double hi[3], region *r)
{
  r->range = range_over(warp, lo, hi);
  double way = 0;
  for (int k = 0; k < 3; k++) {
    r->middle[k] = lo[k] + (hi[k] - lo[k]) / 2;
    r->half[k] = (hi[k] - lo[k]) / 2 * (1 + 1e-12);
    way += r->half[k];
  }
  if (!(way < MOST_WAY))
    return false;
  zs_warp_evaluate(warp, r->middle, r->value, r->slope);
  for (int k = 0; k < 3; k++) {
    double reach = 0;
    for (int j = 0; j < 3; j++) {
      const double by = r->range.bend[k] * way + 1e-12;
      double *least = &r->range.slope_lo[k][j], *most = &r->range.slope_hi[k][j];
      *least = larger(*least, r->slope[k][j] - by);
      *most = smaller(*most, r->slope[k][j] + by);
      reach += larger(fabs(*least), fabs(*most)) * r->half[j];
    }
    reach += 1e-9 * (fabs(r->value[k]) + reach);
    r->range.lo[k] = larger(r->range.lo[k], r->value[k] - reach);
    r->range.hi[k] = smaller(r->range.hi[k], r->value[k] + reach);
  }
  return true;
}

/* Newton's method stops a little before it is there. */
static const double NOT_QUITE = 3e-6;

/* A box that becomes no smaller than this is left as it is. */
static const double LITTLE_LESS = 0.9;

/* Where the inverses y of a box are: nearer about the middle m of a box that holds them all,
 * with P the inverse of the derivatives there, and M their range over the box,
 *   y - m = P (x - x(m)) + (1 - P M) (y - m).
 * Only where 1 - P M is so small that Newton's method cannot miss them; false elsewhere. */
static bool contract(const zs_warp *warp, const double lo[3], const double hi[3], double from[3],
                     double to[3])
{
  static const double SMALL = 0.25;
  region r;
  double p[3][3], rest[3][3];
  if (!examine(warp, from, to, &r) || !zs_warp_invert((const double(*)[3])r.slope, p))
    return false;
  for (int i = 0; i < 3; i++) {
    double sum = 0;
    for (int j = 0; j < 3; j++) {
      rest[i][j] = 0; /* |P (M(m) - M)| */
      for (int k = 0; k < 3; k++)
        rest[i][j] += fabs(p[i][k]) * larger(r.range.slope_hi[k][j] - r.slope[k][j],
                                           r.slope[k][j] - r.range.slope_lo[k][j]);
      sum += rest[i][j];
    }
    if (!(sum < SMALL))
      return false;
  }
  for (int i = 0; i < 3; i++) {
    double least = 0, most = 0, beyond = 0;
    for (int k = 0; k < 3; k++) {
      const double at = r.middle[k] + r.value[k];
      const double a = p[i][k] * (lo[k] - at), b = p[i][k] * (hi[k] - at);
      least += smaller(a, b);
      most += larger(a, b);
      beyond += rest[i][k] * r.half[k] + NOT_QUITE * fabs(p[i][k]);
    }
    from[i] = larger(from[i], r.middle[i] + least - beyond);
    to[i] = smaller(to[i], r.middle[i] + most + beyond);
  }
  return true;
}

/* Of the inverse: y lies in x - D(box of y), from the box that the largest moves allow on;
 * so do ZS_WARP_SUBSTITUTIONS steps of y = x - D(y), with which zs_warp_inverse ends when there
 * is no y. */
void zs_warp_bounds(const zs_warp *warp, const double lo[3], const double hi[3], double least[3],
                    double most[3])
{
  region r;
  if (!warp->backward) {
    examine(warp, lo, hi, &r);
    memcpy(least, r.range.lo, sizeof r.range.lo);
    memcpy(most, r.range.hi, sizeof r.range.hi);
    return;
  }
  double from[3], to[3], before = INFINITY;
  r.range = warp->all;
  for (int i = 0; i <= ZS_WARP_SUBSTITUTIONS; i++) {
    double size = 0;
    if (i > 0)
      examine(warp, from, to, &r);
    for (int k = 0; k < 3; k++) {
      const double left = lo[k] - r.range.hi[k] - NOT_QUITE;
      const double right = hi[k] - r.range.lo[k] + NOT_QUITE;
      from[k] = i > 0 ? larger(from[k], left) : left;
      to[k] = i > 0 ? smaller(to[k], right) : right;
      size += to[k] - from[k];
    }
    if (!(size < LITTLE_LESS * before))
      break;
    before = size;
  }
  for (int i = 0; i < 3 && contract(warp, lo, hi, from, to); i++)
    ;
  examine(warp, from, to, &r);
  for (int k = 0; k < 3; k++) {
    least[k] = -r.range.hi[k] - NOT_QUITE;
    most[k] = -r.range.lo[k] + NOT_QUITE;
  }
}

/* ---- The inverse ------------------------------------------------------------------- */

double zs_warp_determinant(const double slope[3][3])
{
  return zs_warp_determinant_of(slope);
}

bool zs_warp_inverse(const zs_warp *warp, const double x[3], double value[3], double slope[3][3])
{
  return zs_warp_solve(warp, x, ZS_WARP_EXACT, value, slope);
}

/* The points of the grid along each axis. */
static void count_starts(const zs_warp *warp, uint32_t resolution, uint32_t count[3])
{
  double longest = 0;
  for (int k = 0; k < 3; k++)
    longest = fmax(longest, zs_warp_length(warp, k));
  for (int k = 0; k < 3; k++)
    count[k] = (uint32_t)ceil(zs_warp_length(warp, k) / longest * resolution) + 1;
}

double zs_warp_start_bytes(const zs_warp *warp, uint32_t resolution)
{
  uint32_t count[3];
  count_starts(warp, resolution, count);
  return (double)count[0] * count[1] * count[2] * sizeof *warp->start;
}

bool zs_warp_prepare_inverse(zs_warp *warp, uint32_t resolution, unsigned threads)
{
  uint32_t count[3];
  count_starts(warp, resolution, count);
  float(*start)[3] = malloc((size_t)count[0] * count[1] * count[2] * sizeof *start);
  if (!start)
    return false;
  const size_t nx = count[0], ny = count[1];
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
  for (size_t k = 0; k < count[2]; k++)
    for (size_t j = 0; j < ny; j++)
      for (size_t i = 0; i < nx; i++) {
        const size_t at[3] = {i, j, k};
        double x[3], e[3];
        for (int axis = 0; axis < 3; axis++)
          x[axis] = (double)at[axis] / (count[axis] - 1) * zs_warp_length(warp, axis) - ZS_WARP_REACH;
        zs_warp_solve(warp, x, 1e-4, e, NULL); /* without starts as yet */
        for (int axis = 0; axis < 3; axis++)
          start[(k * ny + j) * nx + i][axis] = (float)e[axis];
      }
  memcpy(warp->starts, count, sizeof count);
  warp->start = start;
  return true;
}

/* ---- Folds --------------------------------------------------------------------------- */

/* Where in every row the derivatives of D add up to less than 1, those of x + D(x) are
 * diagonally dominant: no fold. */
static bool cannot_fold(const zs_warp_range *r)
{
  for (int k = 0; k < 3; k++) {
    double sum = 0;
    for (int j = 0; j < 3; j++)
      sum += j == k ? fmax(-r->slope_lo[k][j], 0)
                    : fmax(fabs(r->slope_lo[k][j]), fabs(r->slope_hi[k][j]));
    if (!(sum < 1))
      return false;
  }
  return true;
}

static bool folds_in_cell(const zs_warp *warp, const size_t cell[3], double at[3],
                          double *determinant)
{
  for (int n = 0; n < 125; n++) {
    const double x[3] = {(double)cell[0] - 2 + n % 5 / 4.0, (double)cell[1] - 2 + n / 5 % 5 / 4.0,
                         (double)cell[2] - 2 + n / 25 / 4.0};
    double value[3], slope[3][3];
    zs_warp_evaluate(warp, x, value, slope);
    *determinant = zs_warp_determinant((const double(*)[3])slope);
    if (!(*determinant > 0)) {
      memcpy(at, x, sizeof x);
      return true;
    }
  }
  return false;
}

bool zs_warp_fold(const zs_warp *warp, double at[3], double *determinant)
{
  const size_t nx = cells_along(warp, 0), ny = cells_along(warp, 1), nz = cells_along(warp, 2);
  for (size_t k = 0; k < nz; k++)
    for (size_t j = 0; j < ny; j++)
      for (size_t i = 0; i < nx; i++)
        if (!cannot_fold(&warp->cells[(k * ny + j) * nx + i]) &&
            folds_in_cell(warp, (const size_t[3]){i, j, k}, at, determinant))
          return true;
  return false;
}

/* ---- The operation --------------------------------------------------------------------- */

void zs_warp_basis(const double at[3], int first[3], double weight[3][4])
{
  for (int k = 0; k < 3; k++) {
    const double cell = floor(at[k]);
    first[k] = (int)cell - 1;
    zs_warp_weigh(at[k] - cell, weight[k]);
  }
}

void zs_warp_at(const zs_warp *warp, const double at[3], double value[3], double slope[3][3])
{
  zs_warp_evaluate(warp, at, value, slope);
}

static double reference(const void *data, const double in[])
{
  const zs_warp_part *part = data;
  double value[3];
  if (!isfinite(in[0] + in[1] + in[2]))
    return isnan(in[0] + in[1] + in[2]) ? NAN : 0;
  if (part->warp->backward)
    zs_warp_inverse(part->warp, in, value, NULL);
  else
    zs_warp_evaluate(part->warp, in, value, NULL);
  return value[part->component];
}

static bool are_siblings(const void *data, const void *other)
{
  const zs_warp_part *a = data, *b = other;
  return a->warp == b->warp;
}

ZS_DEFINE_KERNEL_TABLE(zs_warp_kernels)

const zs_operation zs_warp_operation = {.name = "warp",
                                        .arity = 3,
                                        .data_size = sizeof(zs_warp_part),
                                        .kernels = zs_warp_kernels_table,
                                        .reference = reference,
                                        .are_siblings = are_siblings};
