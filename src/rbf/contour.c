#include "rbf/contour.h"

#include "base/vector3.h"
#include "rbf/fit.h"

#include <math.h>
#include <stdlib.h>

/* The automatic spacing, by the size of the rings. */
static const double SPACING = 1.0 / 96;
/* A right angle, and the turn that makes a corner sharp: it has no normal. */
static const double RIGHT = 1.57079632679489662, SHARP = 0.7;
/* How near to a corner with a right angle the first sample of an edge lies, by the spacing, the
 * farther the less the outline turns; and how many times as far each next one, until the spacing is
 * reached: more of them the narrower the corner, since so much nearer are those of its other edge.
 * Nearer than a part of the spacing they have no normals: constraints beside the surface so near to
 * each other weigh a lot against each other.  All this keeps the zero set of a fit within 1e-4 of
 * the shape's size of its polygon. */
static const double FIRST = 1.0 / 32, GROWTH = 1.5, NARROWEST = 0.1, FASTEST = 3, BARE = 0.5;
/* Parts of an edge between two sharp corners, perhaps the end of something thin, at the least where
 * it is longer than the spacing. */
static const double LEAST_PARTS = 6;

/* Rings on their way to samples. */
typedef struct tracer {
  zs_rbf_samples *list;
  const zs_rings *rings;
  const zs_rbf_plane *plane;
  double across[3]; /* the plane's normal: u x v */
  double spacing;
  zs_diag *diag;
} tracer;

static double length_of(const double v[3])
{
  return hypot(hypot(v[0], v[1]), v[2]);
}

static void place(const zs_rbf_plane *plane, const double point[2], double result[3])
{
  for (int k = 0; k < 3; k++)
    result[k] = plane->origin[k] + point[0] * plane->u[k] + point[1] * plane->v[k];
}

/* ---- Rings --------------------------------------------------------------------- */

static size_t ring_begin(const zs_rings *rings, size_t r)
{
  return r ? rings->ends[r - 1] : 0;
}

/* The point after one of a ring. */
static const double *ring_after(const zs_rings *rings, size_t r, size_t i)
{
  return rings->points + 2 * (i + 1 < rings->ends[r] ? i + 1 : ring_begin(rings, r));
}

/* Twice the area of a ring, positive when it is counter-clockwise. */
static double signed_area(const zs_rings *rings, size_t r)
{
  const size_t begin = ring_begin(rings, r), end = rings->ends[r];
  const double *p = rings->points, *first = p + 2 * begin;
  double area = 0;
  for (size_t i = begin + 1; i + 1 < end; i++)
    area += (p[2 * i] - first[0]) * (p[2 * i + 3] - first[1]) -
            (p[2 * i + 2] - first[0]) * (p[2 * i + 1] - first[1]);
  return area;
}

/* Whether a ray to the right from a point meets a ring an odd number of times. */
static bool holds(const zs_rings *rings, size_t r, const double point[2])
{
  const size_t begin = ring_begin(rings, r), end = rings->ends[r];
  bool odd = false;
  for (size_t i = begin; i < end; i++) {
    const double *a = rings->points + 2 * i;
    const double *b = ring_after(rings, r, i);
    if ((a[1] > point[1]) != (b[1] > point[1]) &&
        point[0] < a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
      odd = !odd;
  }
  return odd;
}

/* Whether the solid lies to the left along a ring. */
static bool solid_is_left(const zs_rings *rings, size_t r)
{
  bool left = signed_area(rings, r) > 0;
  for (size_t other = 0; other < rings->ring_count; other++)
    if (other != r && holds(rings, other, rings->points + 2 * ring_begin(rings, r)))
      left = !left;
  return left;
}

/* ---- Samples ------------------------------------------------------------------- */

/* An edge in space: unit direction, length, and the unit normal out of the solid. */
typedef struct edge {
  double from[3], direction[3], normal[3], length;
} edge;

static edge edge_between(const tracer *t, const double a[2], const double b[2], bool left)
{
  edge e;
  double to[3];
  place(t->plane, a, e.from);
  place(t->plane, b, to);
  for (int k = 0; k < 3; k++)
    e.direction[k] = to[k] - e.from[k];
  e.length = length_of(e.direction);
  for (int k = 0; e.length > 0 && k < 3; k++)
    e.direction[k] /= e.length;
  zs_cross3(e.direction, t->across, e.normal);
  for (int k = 0; !left && k < 3; k++)
    e.normal[k] = -e.normal[k];
  return e;
}

/* By how much the outline turns at a corner, 0 .. pi. */
static double turn_at(const edge *before, const edge *after)
{
  return acos(fmax(fmin(zs_dot3(before->direction, after->direction), 1), -1));
}

static bool add_corner(const tracer *t, const edge *before, const edge *after, double turn)
{
  zs_rbf_sample sample = {.value = 0};
  for (int k = 0; k < 3; k++) {
    sample.position[k] = after->from[k];
    if (turn < SHARP)
      sample.normal[k] = before->normal[k] + after->normal[k];
  }
  return zs_rbf_samples_add(t->list, &sample, t->diag);
}

static bool add_between(const tracer *t, const edge *e, double along, bool bare)
{
  zs_rbf_sample sample = {.value = 0};
  for (int k = 0; k < 3; k++) {
    sample.position[k] = e->from[k] + along * e->direction[k];
    sample.normal[k] = bare ? 0 : e->normal[k];
  }
  return zs_rbf_samples_add(t->list, &sample, t->diag);
}

/* Add samples at growing distances from an end of an edge where the outline turns by so much, to
 * at most a third of it; *at is moved to the last one.  `sign` is -1 at the edge's far end. */
static bool add_graded(const tracer *t, const edge *e, int sign, double turn, double *at)
{
  const double narrow = fmax(fmin((2 * RIGHT - turn) / RIGHT, 1), NARROWEST);
  const double end = *at, first = FIRST * narrow * t->spacing * RIGHT / turn;
  const double growth = fmin(1 + narrow * (GROWTH - 1) * fmax(RIGHT / turn, 1), FASTEST);
  double before = 0;
  for (double d = first; d - before < t->spacing && 3 * d < e->length; d *= growth) {
    before = d;
    *at = end + sign * d;
    if (!add_between(t, e, *at, d < BARE * t->spacing))
      return false;
  }
  return true;
}

/* Add samples between the ends of an edge, where the outline turns by so much. */
static bool add_inner(const tracer *t, const edge *e, double turn_from, double turn_to)
{
  double from = 0, to = e->length, spacing = t->spacing;
  if (!add_graded(t, e, 1, turn_from, &from) || !add_graded(t, e, -1, turn_to, &to))
    return false;
  if (turn_from > SHARP && turn_to > SHARP && e->length > spacing)
    spacing = fmin(spacing, e->length / LEAST_PARTS);
  const double parts = ceil((to - from) / spacing);
  for (double i = 1; i < parts; i++)
    if (!add_between(t, e, from + i * (to - from) / parts, false))
      return false;
  return true;
}

static bool trace(const tracer *t, size_t r)
{
  const size_t begin = ring_begin(t->rings, r), count = t->rings->ends[r] - begin;
  const double *p = t->rings->points + 2 * begin;
  const bool left = solid_is_left(t->rings, r);
  bool memory = true;
  edge before = edge_between(t, p + 2 * (count - 1), p, left);
  edge at = edge_between(t, p, p + 2, left);
  double turn = turn_at(&before, &at);
  for (size_t i = 0; memory && i < count; i++) {
    const edge after =
      edge_between(t, p + 2 * ((i + 1) % count), p + 2 * ((i + 2) % count), left);
    const double next = turn_at(&at, &after);
    memory = add_corner(t, &before, &at, turn) && add_inner(t, &at, turn, next);
    before = at;
    at = after;
    turn = next;
  }
  return memory;
}

/* The size of all rings in space, as of samples. */
static double size_of(const zs_rings *rings, const zs_rbf_plane *plane)
{
  double middle[3] = {0, 0, 0}, at[3], square = 0;
  for (size_t i = 0; i < rings->point_count; i++) {
    place(plane, rings->points + 2 * i, at);
    for (int k = 0; k < 3; k++)
      middle[k] += at[k] / (double)rings->point_count;
  }
  for (size_t i = 0; i < rings->point_count; i++) {
    place(plane, rings->points + 2 * i, at);
    square = fmax(square, pow(at[0] - middle[0], 2) + pow(at[1] - middle[1], 2) +
                            pow(at[2] - middle[2], 2));
  }
  return 2 * sqrt(square);
}

/* Whether corners repeat, which would leave edges without a direction. */
static bool check_ring(const zs_rings *rings, size_t r, const zs_place *where, zs_diag *diag)
{
  const size_t begin = ring_begin(rings, r), end = rings->ends[r];
  for (size_t i = begin; i < end; i++) {
    const double *a = rings->points + 2 * i;
    const double *b = ring_after(rings, r, i);
    if (a[0] == b[0] && a[1] == b[1] && end - begin > 1)
      return zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, where, NULL,
                       "the point (%.9g %.9g) is there twice in a row", a[0], a[1]);
  }
  if (end - begin >= 3 && fabs(signed_area(rings, r)) > 0)
    return true;
  return zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, where, NULL,
                   "the ring of %zu points from (%.9g %.9g) on encloses nothing; expected at "
                   "least 3 that are not on one line", end - begin, rings->points[2 * begin],
                   rings->points[2 * begin + 1]);
}

/* Whether samples so far apart are not more than can be fitted. */
static bool check_spacing(const tracer *t, const zs_place *where)
{
  double length = 0;
  for (size_t r = 0; r < t->rings->ring_count; r++)
    for (size_t i = ring_begin(t->rings, r); i < t->rings->ends[r]; i++)
      length +=
        edge_between(t, t->rings->points + 2 * i, ring_after(t->rings, r, i), true).length;
  return length / t->spacing <= ZS_RBF_MAXIMUM_COUNT ||
         zs_report(t->diag, ZS_ERROR, ZS_ERROR_UNABLE, where, NULL,
                   "a spacing of %g makes %.0f constraints of an outline of %g, and at most %d can "
                   "be fitted", t->spacing, ceil(length / t->spacing), length,
                   ZS_RBF_MAXIMUM_COUNT);
}

bool zs_rbf_contour_add(zs_rbf_samples *list, const zs_rings *rings, const zs_rbf_plane *plane,
                        double spacing, const zs_place *where, zs_diag *diag)
{
  tracer t = {.list = list, .rings = rings, .plane = plane, .diag = diag};
  t.spacing = isnan(spacing) ? SPACING * size_of(rings, plane) : spacing;
  zs_cross3(plane->u, plane->v, t.across);
  const double length = length_of(t.across);
  for (int k = 0; k < 3; k++)
    t.across[k] /= length;
  for (size_t r = 0; r < rings->ring_count; r++)
    if (!check_ring(rings, r, where, diag))
      return false;
  if (!check_spacing(&t, where))
    return false;
  for (size_t r = 0; r < rings->ring_count; r++)
    if (!trace(&t, r))
      return false;
  return true;
}

/* ---- Pictures ------------------------------------------------------------------- */

/* Of two crossings at one pixel that are nearer to each other than this, by its
 * side, one is left out: they would be nearly the same constraint. */
static const float CROWDED = 0.5F;

/* A picture on its way to samples. */
typedef struct scanner {
  zs_rbf_samples *list;
  const zs_gray *gray;
  const zs_rbf_plane *plane;
  double level;
  bool down;
  float *nearest; /* x and y of a crossing next to each pixel; NaN: none yet */
  zs_diag *diag;
} scanner;

/* Brightness above the level; around the picture it is black. */
static double above(const scanner *s, long x, long y)
{
  const zs_gray *g = s->gray;
  const bool within = x >= 0 && y >= 0 && x < (long)g->width && y < (long)g->height;
  return (within ? (double)g->pixels[(size_t)y * g->width + (size_t)x] : 0) - s->level;
}

/* The gradient at a pixel, by Sobel's differences over its eight neighbours. */
static void gradient(const scanner *s, long x, long y, double g[2])
{
  g[0] = g[1] = 0;
  for (int i = -1; i <= 1; i++) {
    const double weight = i ? 1 : 2;
    g[0] += weight * (above(s, x + 1, y + i) - above(s, x - 1, y + i));
    g[1] += weight * (above(s, x + i, y + 1) - above(s, x + i, y - 1));
  }
}

/* Whether another crossing at a pixel is close to this one, which is noted if there
 * is none yet.  Both ends of a crossing's way count as its pixels. */
static bool is_crowded(const scanner *s, long x, long y, const float at[2])
{
  if (x < 0 || y < 0 || x >= (long)s->gray->width || y >= (long)s->gray->height)
    return false;
  float *nearest = s->nearest + 2 * ((size_t)y * s->gray->width + (size_t)x);
  if (!isnan(nearest[0]))
    return hypotf(at[0] - nearest[0], at[1] - nearest[1]) < CROWDED;
  nearest[0] = at[0];
  nearest[1] = at[1];
  return false;
}

/* The crossing from one pixel to the next one in direction (dx, dy), if any. */
static bool cross_pixels(const scanner *s, long x, long y, int dx, int dy)
{
  const double a = above(s, x, y), b = above(s, x + dx, y + dy);
  if ((a >= 0) == (b >= 0))
    return true;
  const double t = a / (a - b);
  const float at[2] = {(float)((double)x + t * dx), (float)((double)y + t * dy)};
  if (is_crowded(s, x, y, at) || is_crowded(s, x + dx, y + dy, at))
    return true;
  double g[2], h[2];
  gradient(s, x, y, g);
  gradient(s, x + dx, y + dy, h);
  const double up = s->down ? 1 : -1; /* what a row more means along v */
  const double point[2] = {
    (double)x + 0.5 + t * dx,
    s->down ? (double)y + 0.5 + t * dy : (double)s->gray->height - 0.5 - (double)y - t * dy};
  zs_rbf_sample sample = {.value = 0};
  place(s->plane, point, sample.position);
  for (int k = 0; k < 3; k++)
    sample.normal[k] = -((1 - t) * g[0] + t * h[0]) * s->plane->u[k] -
                       up * ((1 - t) * g[1] + t * h[1]) * s->plane->v[k];
  return zs_rbf_samples_add(s->list, &sample, s->diag);
}

bool zs_rbf_picture_add(zs_rbf_samples *list, const zs_gray *gray, double level, bool down,
                        const zs_rbf_plane *plane, zs_diag *diag)
{
  scanner s = {.list = list, .gray = gray, .plane = plane, .level = level, .down = down,
               .diag = diag};
  const size_t pixels = (size_t)gray->width * gray->height;
  s.nearest = malloc(2 * pixels * sizeof *s.nearest);
  if (!s.nearest)
    return zs_fail_memory(diag);
  for (size_t i = 0; i < 2 * pixels; i++)
    s.nearest[i] = NAN;
  bool memory = true;
  for (long y = -1; memory && y < (long)gray->height; y++)
    for (long x = -1; memory && x < (long)gray->width; x++)
      memory = cross_pixels(&s, x, y, 1, 0) && cross_pixels(&s, x, y, 0, 1);
  free(s.nearest);
  return memory;
}
