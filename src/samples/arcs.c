#include "samples/arcs.h"

#include "samples/fill.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CHORDS = 16 /* of an arc, to find where outlines touch */ };

static double cross(const double a[2], const double b[2])
{
  return a[0] * b[1] - a[1] * b[0];
}

bool zs_arc_bulge(const double a[2], const double b[2], const double p[2], double *bulge)
{
  const double u[2] = {a[0] - p[0], a[1] - p[1]}, v[2] = {b[0] - p[0], b[1] - p[1]};
  const double sine = cross(u, v), cosine = u[0] * v[0] + u[1] * v[1];
  /* The angle at p is half of what the arc leaves of the circle. */
  const double angle = atan2(sine, cosine);
  const double half_turn = copysign(3.14159265358979323846, angle);
  const double quarter = (angle - half_turn) / 2;
  *bulge = tan(quarter);
  return fabs(sine) > 1e-12 * (u[0] * u[0] + u[1] * u[1] + v[0] * v[0] + v[1] * v[1]);
}

double zs_arc_circle(const double a[2], const double b[2], double bulge, double centre[2])
{
  const double way[2] = {b[0] - a[0], b[1] - a[1]};
  const double left = (1 - bulge * bulge) / (4 * bulge);
  centre[0] = (a[0] + b[0]) / 2 - left * way[1];
  centre[1] = (a[1] + b[1]) / 2 + left * way[0];
  return hypot(way[0], way[1]) * (1 + bulge * bulge) / (4 * fabs(bulge));
}

void zs_arc_point(const double a[2], const double b[2], double bulge, double t, double out[2])
{
  double centre[2];
  zs_arc_circle(a, b, bulge, centre);
  const double angle = 4 * atan(bulge) * t, c = cos(angle), s = sin(angle);
  const double u[2] = {a[0] - centre[0], a[1] - centre[1]};
  out[0] = centre[0] + c * u[0] - s * u[1];
  out[1] = centre[1] + s * u[0] + c * u[1];
}

bool zs_arc_divide(const zs_arc_ring *from, zs_arc_ring *to)
{
  size_t count = 0;
  for (size_t i = 0; i < from->count; i++)
    count += from->edges[i].pieces;
  to->edges = malloc(count * sizeof *to->edges);
  to->count = 0;
  if (!to->edges)
    return false;
  for (size_t i = 0; i < from->count; i++) {
    const zs_arc_edge *e = &from->edges[i];
    for (unsigned p = 0; p < e->pieces; p++) {
      zs_arc_edge *piece = &to->edges[to->count++];
      *piece =
        (zs_arc_edge){{e->from[0], e->from[1]}, tan(atan(e->bulge) / e->pieces), e->pieces, i};
      if (p)
        zs_arc_point(e->from, zs_arc_next(from, i)->from, e->bulge, (double)p / e->pieces,
                     piece->from);
    }
  }
  return true;
}

/* The direction of an edge's arc at its end or its beginning, or that of the chord of its
 * last or first piece, in which it is turned less from the chord of the whole. */
static void direction(const zs_arc_ring *r, size_t i, bool at_end, bool of_piece, double out[2])
{
  const zs_arc_edge *e = &r->edges[i];
  const double *a = e->from, *b = zs_arc_next(r, i)->from;
  const double full = 2 * atan(e->bulge), turn = of_piece ? full - full / e->pieces : full;
  const double c = cos(turn), s = at_end ? sin(turn) : -sin(turn);
  const double x = b[0] - a[0], y = b[1] - a[1], length = hypot(x, y);
  out[0] = (c * x - s * y) / length;
  out[1] = (s * x + c * y) / length;
}

/* Whether the corner at which edge i begins is convex, or is not, as much for pieces' chords as
 * for the edges themselves, and for each of the two with the other's. */
static bool turns_alike(const zs_arc_ring *r, size_t i)
{
  double in[2][2], out[2][2];
  for (int piece = 0; piece < 2; piece++) {
    direction(r, i ? i - 1 : r->count - 1, true, piece, in[piece]);
    direction(r, i, false, piece, out[piece]);
  }
  const double exact = cross(in[0], out[0]);
  bool alike = true;
  for (int k = 1; k < 4; k++)
    alike &= (cross(in[k & 1], out[k >> 1]) > 0) == (exact > 0);
  return alike || fabs(exact) < 1e-6;
}

void zs_arc_choose_pieces(zs_arc_ring *r)
{
  for (bool again = true; again;) {
    again = false;
    for (size_t i = 0; i < r->count; i++) {
      if (turns_alike(r, i))
        continue;
      zs_arc_edge *both[2] = {&r->edges[i], &r->edges[i ? i - 1 : r->count - 1]};
      for (int k = 0; k < 2; k++)
        if (both[k]->bulge != 0 && 2 * both[k]->pieces <= ZS_ARC_MOST_PIECES) {
          both[k]->pieces *= 2;
          again = true;
        }
    }
  }
}

double zs_arc_area(const zs_arc_ring *r)
{
  double area = 0;
  for (size_t i = 0; i < r->count; i++) {
    const zs_arc_edge *e = &r->edges[i];
    const double *a = e->from, *b = zs_arc_next(r, i)->from;
    area += cross(a, b);
    if (e->bulge == 0)
      continue;
    double centre[2];
    const double radius = zs_arc_circle(a, b, e->bulge, centre), angle = 4 * atan(e->bulge);
    area += radius * radius * (angle - sin(angle));
  }
  return area;
}

void zs_arc_reverse(zs_arc_ring *r)
{
  for (size_t i = 0, j = r->count - 1; i < j; i++, j--) {
    const zs_arc_edge e = r->edges[i];
    r->edges[i] = r->edges[j];
    r->edges[j] = e;
  }
  /* An edge follows its corner: now that of the corner after. */
  const zs_arc_edge first = r->edges[0];
  for (size_t i = 0; i < r->count; i++) {
    const zs_arc_edge after = i + 1 < r->count ? r->edges[i + 1] : first;
    r->edges[i].bulge = -after.bulge;
    r->edges[i].pieces = after.pieces;
    r->edges[i].whole = after.whole;
  }
}

/* ---- Crossings -------------------------------------------------------------------------- */

/* Points nearer to an end than this part of an edge are at it. */
static const double AT_END = 1e-6;

/* Find where the circle of an arc meets the line or the circle of another edge: two points, or
 * none. */
static bool find_common(const zs_arc_ring *r, size_t arc, size_t other, double points[2][2])
{
  const double *a = r->edges[other].from, *b = zs_arc_next(r, other)->from;
  double c[2], centre[2], way[2] = {a[1] - b[1], b[0] - a[0]};
  const double radius = zs_arc_circle(r->edges[arc].from, zs_arc_next(r, arc)->from,
                                      r->edges[arc].bulge, c);
  const bool straight = r->edges[other].bulge == 0;
  const double others = straight ? 0 : zs_arc_circle(a, b, r->edges[other].bulge, centre);
  for (int k = 0; k < 2 && !straight; k++)
    way[k] = centre[k] - c[k];
  const double length = hypot(way[0], way[1]);
  /* Along the way, from the centre to the line through both points. */
  const double away =
    straight ? (way[0] * (a[0] - c[0]) + way[1] * (a[1] - c[1])) / length
             : (length * length + radius * radius - others * others) / (2 * length);
  if (!(fabs(away) < radius))
    return false;
  const double side = sqrt(radius * radius - away * away);
  for (int k = 0; k < 2; k++) {
    points[k][0] = c[0] + (away * way[0] - (k ? side : -side) * way[1]) / length;
    points[k][1] = c[1] + (away * way[1] + (k ? side : -side) * way[0]) / length;
  }
  return true;
}

/* Whether a point of the line or the circle of an edge is on the edge, and not at its ends. */
static bool is_between(const zs_arc_ring *r, size_t i, const double p[2])
{
  const double *a = r->edges[i].from, *b = zs_arc_next(r, i)->from, bulge = r->edges[i].bulge;
  const double way[2] = {b[0] - a[0], b[1] - a[1]}, from[2] = {p[0] - a[0], p[1] - a[1]};
  const double length = hypot(way[0], way[1]);
  const double end = fmin(hypot(from[0], from[1]), hypot(p[0] - b[0], p[1] - b[1]));
  if (end <= AT_END * length)
    return false;
  if (bulge != 0) /* of the two parts of the circle the one beside the chord */
    return (cross(way, from) < 0) == (bulge > 0);
  const double along = way[0] * from[0] + way[1] * from[1];
  return along > 0 && along < length * length;
}

/* How far an edge reaches from the middle of its chord. */
static double reach_of(const zs_arc_ring *r, size_t i, double middle[2])
{
  const double *a = r->edges[i].from, *b = zs_arc_next(r, i)->from;
  for (int k = 0; k < 2; k++)
    middle[k] = (a[k] + b[k]) / 2;
  return hypot(b[0] - a[0], b[1] - a[1]) / 2 * fmax(1, fabs(r->edges[i].bulge));
}

/* Whether an arc crosses another edge, which neighbours may do very near to their corner. */
static bool arcs_cross(const zs_arc_ring *r)
{
  for (size_t i = 0; i < r->count; i++)
    for (size_t j = 0; r->edges[i].bulge != 0 && j < r->count; j++) {
      double m[2], n[2], points[2][2];
      const double reach = reach_of(r, i, m) + reach_of(r, j, n);
      if (i == j || hypot(m[0] - n[0], m[1] - n[1]) > reach || !find_common(r, i, j, points))
        continue;
      for (int k = 0; k < 2; k++)
        if (is_between(r, i, points[k]) && is_between(r, j, points[k]))
          return true;
    }
  return false;
}

/* Whether edges meet elsewhere than at corners: then what they enclose has other edges. */
bool zs_arc_is_simple(const zs_arc_ring *r, bool *memory)
{
  zs_fill fill = {0};
  double *points = malloc(2 * CHORDS * r->count * sizeof *points);
  size_t count = 0;
  *memory = points != NULL;
  for (size_t i = 0; points && i < r->count; i++)
    for (int k = 0; k < (r->edges[i].bulge != 0 ? CHORDS : 1); k++) {
      double *p = points + 2 * count++;
      memcpy(p, r->edges[i].from, 2 * sizeof *p);
      if (k)
        zs_arc_point(r->edges[i].from, zs_arc_next(r, i)->from, r->edges[i].bulge,
                 (double)k / CHORDS, p);
    }
  *memory = *memory && zs_fill_add_rings(&fill, points, &count, 1);
  const zs_fill_result result = *memory ? zs_fill_resolve(&fill, true) : ZS_FILL_MEMORY;
  *memory = result != ZS_FILL_MEMORY;
  const bool simple = result == ZS_FILL_DONE && fill.count == count && !arcs_cross(r);
  free(points);
  zs_fill_clear(&fill);
  return simple;
}
