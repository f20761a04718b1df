#include "samples/minkowski.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Outlines without holes ---------------------------------------------------------- */

/* Corners of closed lines, with the inside on their left, and which follow which. */
typedef struct corners {
  size_t count;
  double (*at)[2];
  size_t *next, *before, *ring;
} corners;

static void corners_clear(corners *c)
{
  free(c->at);
  free(c->next);
  free(c->before);
  free(c->ring);
  *c = (corners){0};
}

static void join(corners *c, size_t a, size_t b)
{
  c->next[a] = b;
  c->before[b] = a;
}

static size_t add_corner(corners *c, const double at[2], size_t ring)
{
  memcpy(c->at[c->count], at, sizeof *c->at);
  c->ring[c->count] = ring;
  return c->count++;
}

/* Twice the area of a ring, negative for holes. */
static double area_of(const double *points, size_t count)
{
  double area = 0;
  for (size_t i = 0; i < count; i++) {
    const double *p = points + 2 * i, *q = points + 2 * (i + 1 < count ? i + 1 : 0);
    area += (p[0] - points[0]) * (q[1] - points[1]) - (q[0] - points[0]) * (p[1] - points[1]);
  }
  return area;
}

/* Join a hole to the edge above its highest corner by a slit.  Edges above belong to the rings that
 * bound the same part of the inside, and slits that only lead upwards close no circle.  False
 * where nothing is above. */
static bool open_hole(corners *c, size_t first, size_t count)
{
  size_t top = first, above = SIZE_MAX;
  double height = INFINITY;
  for (size_t i = first; i < first + count; i++)
    if (c->at[i][1] > c->at[top][1])
      top = i;
  const double x = c->at[top][0], y = c->at[top][1];
  for (size_t i = 0; i < c->count; i++) {
    const double *p = c->at[i], *q = c->at[c->next[i]];
    if (c->ring[i] == c->ring[top] || (p[0] <= x) == (q[0] <= x))
      continue;
    const double at = p[1] + (x - p[0]) / (q[0] - p[0]) * (q[1] - p[1]);
    if (at >= y && at < height) {
      height = at;
      above = i;
    }
  }
  if (above == SIZE_MAX)
    return false;
  const double end[2] = {x, height}, start[2] = {x, y};
  const size_t up = c->next[above], behind = c->before[top], ring = c->ring[above];
  const size_t down = add_corner(c, end, ring), again = add_corner(c, start, c->ring[top]);
  const size_t back = add_corner(c, end, ring);
  join(c, above, down);
  join(c, down, top);
  join(c, behind, again);
  join(c, again, back);
  join(c, back, up);
  return true;
}

static zs_fill_result make_corners(const zs_fill *fill, corners *c)
{
  double *points = NULL;
  size_t *ends = NULL, rings = 0;
  zs_fill_result result = ZS_FILL_MEMORY;
  *c = (corners){0};
  if (!zs_fill_rings(fill, &points, &ends, &rings))
    return result;
  const size_t room = (rings ? ends[rings - 1] : 0) + 3 * rings + 1;
  c->at = malloc(room * sizeof *c->at);
  c->next = malloc(room * sizeof *c->next);
  c->before = malloc(room * sizeof *c->before);
  c->ring = malloc(room * sizeof *c->ring);
  if (c->at && c->next && c->before && c->ring) {
    result = ZS_FILL_DONE;
    for (size_t r = 0, first = 0; r < rings; first = ends[r++])
      for (size_t i = first; i < ends[r]; i++) {
        add_corner(c, points + 2 * i, r);
        join(c, i, i + 1 < ends[r] ? i + 1 : first);
      }
    for (size_t r = 0, first = 0; r < rings && result == ZS_FILL_DONE; first = ends[r++])
      if (area_of(points + 2 * first, ends[r] - first) < 0 && !open_hole(c, first, ends[r] - first))
        result = ZS_FILL_UNCLEAR;
  }
  free(points);
  free(ends);
  return result;
}

/* ---- Convolution ------------------------------------------------------------------------ */

/* A corner with the edge behind it: directions as angles.  Only their order counts, so that the
 * convolution closes whatever rounding does to them. */
typedef struct turning {
  double at[2], end[2];
  double before, after; /* of the edges before and behind the corner */
} turning;

/* The closed lines one after another; edges of no length left out.  NULL when memory is out. */
static turning *make_turnings(const corners *c, size_t **ends, size_t *loops)
{
  turning *all = malloc((c->count + 1) * sizeof *all);
  bool *seen = calloc(c->count + 1, sizeof *seen);
  *ends = malloc((c->count + 1) * sizeof **ends);
  *loops = 0;
  if (!all || !seen || !*ends) {
    free(all);
    free(seen);
    free(*ends);
    *ends = NULL;
    return NULL;
  }
  size_t n = 0;
  for (size_t i = 0; i < c->count; i++) {
    const size_t first = n;
    for (size_t k = i; !seen[k]; k = c->next[k]) {
      const double *p = c->at[k], *q = c->at[c->next[k]];
      seen[k] = true;
      if (p[0] == q[0] && p[1] == q[1])
        continue;
      all[n++] = (turning){.at = {p[0], p[1]}, .end = {q[0], q[1]},
                           .after = atan2(q[1] - p[1], q[0] - p[0])};
    }
    for (size_t k = first; k < n; k++)
      all[k].before = all[k > first ? k - 1 : n - 1].after;
    if (n > first)
      (*ends)[(*loops)++] = n;
  }
  free(seen);
  return all;
}

/* Whether a direction is passed when a corner turns from one edge to the next: 1 to the left, -1
 * to the right, 0 if not.  Of equal directions those of the second shape come `later`. */
static int passes(const turning *corner, double direction, bool later)
{
  double turn = corner->after - corner->before;
  const double pi = 3.14159265358979323846;
  turn += turn > pi ? -2 * pi : turn <= -pi ? 2 * pi : 0;
  const double from = turn > 0 ? corner->before : corner->after;
  const double to = turn > 0 ? corner->after : corner->before;
  const bool beyond = later ? direction >= from : direction > from;
  const bool ahead = later ? direction < to : direction <= to;
  const bool inside = turn == 0 ? false : from <= to ? beyond && ahead : beyond || ahead;
  return inside ? turn > 0 ? 1 : -1 : 0;
}

/* The edges of one shape moved by the corners of another. */
static bool move_edges(const turning *edges, size_t edge_count, const turning *by, size_t by_count,
                       bool later, zs_fill *sum)
{
  for (size_t i = 0; i < edge_count; i++)
    for (size_t j = 0; j < by_count; j++) {
      const int sign = passes(&by[j], edges[i].after, later);
      if (!sign)
        continue;
      const double *v = by[j].at;
      const double from[2] = {edges[i].at[0] + v[0], edges[i].at[1] + v[1]};
      const double to[2] = {edges[i].end[0] + v[0], edges[i].end[1] + v[1]};
      if (!zs_fill_add_edge(sum, sign > 0 ? from : to, sign > 0 ? to : from))
        return false;
    }
  return true;
}

static bool convolve(const corners *a, const corners *b, zs_fill *sum)
{
  size_t *ends[2] = {NULL, NULL}, loops[2];
  turning *p = make_turnings(a, &ends[0], &loops[0]), *q = make_turnings(b, &ends[1], &loops[1]);
  bool done = p && q;
  for (size_t i = 0, first = 0; done && i < loops[0]; first = ends[0][i++])
    for (size_t j = 0, start = 0; done && j < loops[1]; start = ends[1][j++]) {
      const size_t n = ends[0][i] - first, m = ends[1][j] - start;
      done = move_edges(p + first, n, q + start, m, false, sum) &&
             move_edges(q + start, m, p + first, n, true, sum);
    }
  free(p);
  free(q);
  free(ends[0]);
  free(ends[1]);
  return done;
}

zs_fill_result zs_minkowski_sum(const zs_fill *a, const zs_fill *b, zs_fill *sum)
{
  corners p, q = {0};
  *sum = (zs_fill){0};
  zs_fill_result result = make_corners(a, &p);
  if (result == ZS_FILL_DONE)
    result = make_corners(b, &q);
  if (result == ZS_FILL_DONE)
    result = convolve(&p, &q, sum) ? zs_fill_resolve(sum, false) : ZS_FILL_MEMORY;
  corners_clear(&p);
  corners_clear(&q);
  return result;
}
