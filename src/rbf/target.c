#include "rbf/target.h"

#include "base/array.h"

#include <stdlib.h>
#include <string.h>

enum {
  ORDER = ZS_CHEBYSHEV_ORDER,
  ALL = ZS_TARGET_TERMS,
  NODES = (ALL + 15) / 16 * 16,
  ROUNDS = ZS_TARGET_ROUNDS
};
static const unsigned orders[ROUNDS] = {5, 6, 7, 8, 9, ORDER};
/* Of the tolerance, what each swarm may be off by, and what may be dropped of a
 * leaf's polynomial. */
static const double SHARE = 0.5, DROPPED = 0.02;
/* Beyond a distance f grows, unless it is of Gaussians, and so does what cells may be off by: by
 * this many tolerances for each side of the unit box. */
static const double BEYOND = 0.02, FARTHER = 300;

/* ---- What interpolation is off by -------------------------------------------------- */

/* The size of the term of order n, or n - 1 if that is odd, in the expansion of phi
 * about a point at distance 1, across the direction to there. */
static double decay_of(zs_rbf_kernel kernel, unsigned n)
{
  const unsigned half = n / 2;
  const double m = half;
  if (kernel == ZS_RBF_TPS2)
    return 0.5 / (m * (m - 1));
  if (kernel == ZS_RBF_TPS4)
    return 1 / (m * (m - 1) * fmax(m - 2, 1));
  const double power = zs_rbf_power(kernel) / 2;
  double product = 1;
  for (unsigned i = 0; i < half; i++)
    product *= (power - i) / (i + 1);
  return fabs(product);
}

/* How fast the coefficients of phi fall in a box around `middle`, for centres in
 * lo .. hi: for each axis, the sum of the half axes of the ellipse through the
 * nearest singular point of phi. */
static double rate_of(const double middle[3], const double half[3], const double lo[3],
                      const double hi[3], double lift)
{
  double along[3], gap[3], least = INFINITY;
  for (int k = 0; k < 3; k++) {
    along[k] = fmax(0, fmax(lo[k] - middle[k], middle[k] - hi[k]));
    gap[k] = fmax(0, along[k] - half[k]);
  }
  for (int k = 0; k < 3; k++) {
    const double *p = &gap[(k + 1) % 3], *q = &gap[(k + 2) % 3];
    if (half[k] <= 0)
      continue;
    const double x = along[k] / half[k], y2 = (*p * *p + *q * *q + lift) / (half[k] * half[k]);
    const double sum = (sqrt((x - 1) * (x - 1) + y2) + sqrt((x + 1) * (x + 1) + y2)) / 2;
    least = fmin(least, sum + sqrt(fmax(sum * sum - 1, 0)));
  }
  return least;
}

/* phi by powers of the distance, without the logarithm. */
static double size_of(zs_rbf_kernel kernel, double square)
{
  return pow(square, zs_rbf_power(kernel) / 2);
}

/* A Gaussian has no singular point.  In Bernstein's ellipse with half axes a and b, of an
 * interval whose half length squared is `tau` times 1 / rate, it is exp(tau b^2) at most: that is
 * (a + b)^-n exp(tau b^2) for the coefficient of order n, in the ellipse where it is least. */
static double gaussian_decay(double tau, unsigned n)
{
  return tau > 0 ? exp((hypot(tau, n) - tau - n * asinh(n / tau)) / 2) : 0;
}

/* What a Gaussian's coefficients fall from, for centres in lo .. hi and points in a target: what
 * it is by the distances across the axis along which they are most apart.  `most` becomes what
 * it is itself, at most. */
static double gaussian_size(double rate, const double middle[3], const double half[3],
                            const zs_swarm *s, double *most)
{
  double sum = s->lift, largest = 0;
  for (int k = 0; k < 3; k++) {
    const double gap =
      fmax(0, fmax(s->lo[k] - middle[k], middle[k] - s->hi[k]) - half[k]);
    sum += gap * gap;
    largest = fmax(largest, gap * gap);
  }
  *most = exp(-rate * sum);
  return exp(-rate * (sum - largest));
}

/* How fast coefficients fall, and how far they have at an order. */
static double speed_of(const zs_rbf_radial radial, const double middle[3], const double half[3],
                       const double lo[3], const double hi[3], double lift)
{
  const double longest = fmax(half[0], fmax(half[1], half[2]));
  return radial.kernel == ZS_RBF_GAUSSIAN ? radial.rate * longest * longest
                                          : rate_of(middle, half, lo, hi, lift);
}

static double fallen(zs_rbf_kernel kernel, double decay, double speed, unsigned order)
{
  return kernel == ZS_RBF_GAUSSIAN ? gaussian_decay(speed, order)
                                   : decay * pow(speed, -(double)order);
}

/* ---- Far and near ------------------------------------------------------------------- */

/* The largest of the distances along the axes between a target and a box. */
static double gap_to(const zs_target *t, const double lo[3], const double hi[3])
{
  double gap = 0;
  for (int k = 0; k < 3; k++)
    gap = fmax(gap, fmax(lo[k] - t->middle[k], t->middle[k] - hi[k]) - t->half);
  return gap;
}

/* Centres to be interpolated in a target. */
typedef struct far_centres {
  const zs_rbf_centre *list;
  size_t count;
} far_centres;

/* Choose what a swarm is worth from afar: the smallest of its grids that is off by
 * no more than `allowed`, or the centres themselves, if they are not too many. */
static bool choose_centres(const zs_target_maker *m, const zs_target *t, const zs_swarm *s,
                           double allowed, far_centres *centres)
{
  *centres = (far_centres){m->terms->centres + s->range.first, s->range.count};
  if (!s->grids[0])
    return true;
  double middle[3], reach[3], lo[3], hi[3];
  for (int k = 0; k < 3; k++) {
    middle[k] = (s->lo[k] + s->hi[k]) / 2;
    reach[k] = (s->hi[k] - s->lo[k]) / 2;
    lo[k] = t->middle[k] - t->half;
    hi[k] = t->middle[k] + t->half;
  }
  const double speed = speed_of(m->terms->radial, middle, reach, lo, hi, 0);
  for (int i = 0; i < ZS_SWARM_GRIDS && s->grids[i]; i++) {
    const unsigned order = zs_swarm_orders[i];
    if (fallen(m->terms->radial.kernel, m->grid_decay[i], speed, order) <= allowed) {
      *centres = (far_centres){s->grids[i], order * order * order};
      return true;
    }
  }
  return !s->grids[ZS_SWARM_GRIDS - 1];
}

/* The least of the orders that a swarm can be interpolated with in a target, and
 * what to take for it, which may be no centres at all; -1: none is enough. */
static int round_for(const zs_target_maker *m, const zs_target *t, const zs_swarm *s,
                     far_centres *centres)
{
  static const double SLOWEST = 1.5;
  const bool flat = m->terms->flat; /* a target is its side in the plane then */
  const double half[3] = {t->half, t->half, flat ? 0 : t->half};
  const double middle[3] = {t->middle[0], t->middle[1], flat ? 0 : t->middle[2]};
  const zs_rbf_radial radial = m->terms->radial;
  const bool gaussian = radial.kernel == ZS_RBF_GAUSSIAN;
  const double speed = speed_of(radial, middle, half, s->lo, s->hi, s->lift);
  double square = s->lift, size, most = INFINITY;
  for (int k = 0; k < 3; k++) {
    const double d = middle[k] - (s->lo[k] + s->hi[k]) / 2;
    square += d * d;
  }
  size = gaussian ? gaussian_size(radial.rate, middle, half, s, &most)
                  : size_of(radial.kernel, square);
  /* Coefficients fall from twice the size of the terms. */
  const double allowed = SHARE * m->tolerance * t->allowance / (2 * s->weight);
  *centres = (far_centres){NULL, 0};
  if (most <= allowed)
    return 0;
  if ((!gaussian && speed < SLOWEST) || !choose_centres(m, t, s, allowed / size, centres))
    return -1;
  for (int i = 0; i < ROUNDS; i++)
    if (fallen(radial.kernel, m->decay[i], speed, orders[i]) <= allowed / size)
      return i;
  return -1;
}

/* Those of one order. */
typedef struct far_list {
  far_centres *parts;
  size_t count, capacity;
} far_list;

static bool add_near(zs_target *t, uint32_t index)
{
  uint32_t *near = zs_array_grown(t->near, t->near_count + 1, &t->near_capacity, sizeof *near);
  if (!near)
    return false;
  t->near = near;
  t->near[t->near_count++] = index;
  return true;
}

static bool add_far(far_list *far, far_centres centres)
{
  far_centres *parts = zs_array_grown(far->parts, far->count + 1, &far->capacity, sizeof *parts);
  if (!parts)
    return false;
  far->parts = parts;
  far->parts[far->count++] = centres;
  return true;
}

/* Find where a swarm goes: to the far lists, or to the near one, whole or in
 * parts. */
static bool place_swarm(const zs_target_maker *m, zs_target *t, uint32_t index,
                        far_list far[ROUNDS])
{
  const zs_swarm *s = &m->swarms->list[index];
  far_centres centres;
  const int round = round_for(m, t, s, &centres);
  if (round >= 0)
    return !centres.count || add_far(&far[round], centres);
  if (!s->child_count || s->half < 0.75 * t->half) {
    t->near_centres += s->range.count;
    return add_near(t, index);
  }
  for (uint32_t i = 0; i < s->child_count; i++)
    if (!place_swarm(m, t, s->children + i, far))
      return false;
  return true;
}

/* Add the polynomials of one order to a target's series.  Those of flat sums do not
 * depend on z: they need no nodes away from the plane. */
static void interpolate(const zs_target_maker *m, zs_target *t, int round, const far_list *far)
{
  const bool flat = m->terms->flat;
  const unsigned order = orders[round], plane = order * order;
  const unsigned count = flat ? plane : plane * order;
  double node[ORDER], point[3][NODES], sums[NODES] = {0}, series[ALL];
  for (unsigned i = 0; i < order; i++)
    node[i] = zs_chebyshev_node(order, i);
  for (unsigned n = 0; n < NODES; n++) {
    const unsigned i = n < count ? n : count - 1;
    point[0][n] = t->middle[0] + t->half * node[i % order];
    point[1][n] = t->middle[1] + t->half * node[i / order % order];
    point[2][n] = flat ? 0 : t->middle[2] + t->half * node[i / plane];
  }
  const double *const rows[3] = {point[0], point[1], point[2]};
  for (size_t j = 0; j < far->count; j++) {
    m->kernels->add(m->terms->radial.rate, far->parts[j].list, far->parts[j].count, rows,
                    (count + 15) / 16 * 16, sums);
    t->pairs += (double)count * (double)far->parts[j].count;
  }
  for (unsigned k = 1; flat && k < order; k++)
    memcpy(sums + k * plane, sums, plane * sizeof *sums);
  m->kernels->transform(m->fit[round], order, order, sums, series);
  for (unsigned k = 0; k < order; k++)
    for (unsigned j = 0; j < order; j++)
      for (unsigned i = 0; i < order; i++)
        t->series[(k * ORDER + j) * ORDER + i] += series[(k * order + j) * order + i];
}

/* Take what can be interpolated out of a list of swarms. */
static bool absorb(const zs_target_maker *m, zs_target *t, const uint32_t *swarms, size_t count)
{
  far_list far[ROUNDS] = {{0}};
  bool done = true;
  double gap = INFINITY;
  for (size_t i = 0; i < count; i++)
    gap = fmin(gap, gap_to(t, m->swarms->list[swarms[i]].lo, m->swarms->list[swarms[i]].hi));
  t->allowance = count && m->terms->radial.kernel != ZS_RBF_GAUSSIAN
                   ? 1 + FARTHER * fmax(gap - BEYOND, 0)
                   : 1;
  for (size_t i = 0; done && i < count; i++)
    done = place_swarm(m, t, swarms[i], far);
  for (int i = 0; done && i < ROUNDS; i++)
    if (far[i].count)
      interpolate(m, t, i, &far[i]);
  for (int i = 0; i < ROUNDS; i++)
    free(far[i].parts);
  return done;
}

/* ---- Targets ------------------------------------------------------------------------ */

zs_target *zs_target_part(const zs_target_maker *m, const zs_target *whole, unsigned child)
{
  zs_target *t = calloc(1, sizeof *t);
  if (!t)
    return NULL;
  t->half = whole->half / 2;
  for (int k = 0; k < 3; k++)
    t->middle[k] = whole->middle[k] + (child >> k & 1 ? t->half : -t->half);
  zs_chebyshev_halve(&m->halves, whole->series, child, t->series);
  if (!absorb(m, t, whole->near, whole->near_count)) {
    zs_target_free(t);
    return NULL;
  }
  return t;
}

static int compare_ranges(const void *a, const void *b)
{
  const zs_rbf_range *x = a, *y = b;
  return x->first < y->first ? -1 : x->first > y->first;
}

/* Without the coefficients that do not matter, and with ranges that touch joined. */
bool zs_target_finish(const zs_target_maker *m, const zs_target *t, zs_rbf_cell *leaf)
{
  double beyond[ORDER] = {0}; /* coefficients of an order */
  for (unsigned n = 0; n < ALL; n++) {
    const unsigned i = n % ORDER, j = n / ORDER % ORDER, k = n / ORDER / ORDER;
    const unsigned most = i > j ? (i > k ? i : k) : j > k ? j : k;
    beyond[most] += fabs(t->series[n]);
  }
  unsigned order = ORDER;
  for (double sum = beyond[order - 1]; order > 2 && sum < DROPPED * m->tolerance * t->allowance;
       sum += beyond[order - 1])
    order--;
  const unsigned stride = zs_cells_stride(order);
  double *polynomial = calloc(order * stride, sizeof *polynomial);
  zs_rbf_range *near = malloc((t->near_count + 1) * sizeof *near);
  if (!polynomial || !near) {
    free(polynomial);
    free(near);
    return false;
  }
  for (unsigned k = 0; k < order; k++)
    for (unsigned j = 0; j < order; j++)
      memcpy(polynomial + k * stride + j * order, t->series + (k * ORDER + j) * ORDER,
             order * sizeof *polynomial);
  for (size_t i = 0; i < t->near_count; i++)
    near[i] = m->swarms->list[t->near[i]].range;
  qsort(near, t->near_count, sizeof *near, compare_ranges);
  uint32_t count = 0;
  for (size_t i = 0; i < t->near_count; i++)
    if (count && near[count - 1].first + near[count - 1].count == near[i].first)
      near[count - 1].count += near[i].count;
    else
      near[count++] = near[i];
  *leaf = (zs_rbf_cell){.order = order, .near_count = count, .polynomial = polynomial,
                        .near = near};
  return true;
}

void zs_target_free(zs_target *t)
{
  if (t)
    free(t->near);
  free(t);
}

/* Its series is the polynomial of the sum. */
zs_target *zs_target_cube(const zs_target_maker *m)
{
  const double h = zs_rbf_terms_half(m->terms), *p = m->terms->polynomial;
  zs_target *t = calloc(1, sizeof *t);
  if (!t)
    return NULL;
  t->half = h;
  double(*s)[ORDER][ORDER] = (double(*)[ORDER][ORDER])t->series;
  s[0][0][0] = p[0] + h * h / 2 * (p[4] + p[7] + p[9]);
  s[0][0][1] = h * p[1];
  s[0][1][0] = h * p[2];
  s[1][0][0] = h * p[3];
  s[0][0][2] = h * h / 2 * p[4];
  s[0][2][0] = h * h / 2 * p[7];
  s[2][0][0] = h * h / 2 * p[9];
  s[0][1][1] = h * h * p[5];
  s[1][0][1] = h * h * p[6];
  s[1][1][0] = h * h * p[8];
  t->near_centres = m->terms->count;
  if (!add_near(t, 0)) {
    zs_target_free(t);
    return NULL;
  }
  return t;
}

void zs_target_maker_init(zs_target_maker *m, const zs_rbf_terms *terms, const zs_swarms *swarms,
                          double tolerance)
{
  *m = (zs_target_maker){.terms = terms,
                         .swarms = swarms,
                         .kernels = zs_cells_select(terms->radial.kernel),
                         .tolerance = tolerance};
  zs_chebyshev_halves_make(&m->halves);
  for (int i = 0; i < ROUNDS; i++) {
    zs_chebyshev_fit(orders[i], m->fit[i]);
    m->decay[i] = decay_of(terms->radial.kernel, orders[i]);
  }
  for (int i = 0; i < ZS_SWARM_GRIDS; i++)
    m->grid_decay[i] = decay_of(terms->radial.kernel, zs_swarm_orders[i]);
}
