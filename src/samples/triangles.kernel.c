/* Block, gradient and bounds kernels of the distance to triangles.  Compiled once per
 * instruction set. */
#include "samples/triangles.h"

#include "field/lanes.h"

/* Sides of triangles that a packet is as long as when it takes as long as its points do one by
 * one: measured. */
static const double MANY_SIDES = 18;

/* Points that are looked at together, the box around them, and what is nearest to each. */
typedef struct packet {
  double lo[3], hi[3], centre[3];
  zs_lanes p[3];     /* relative to the centre */
  zs_lanes distance2;
  double most2;      /* the largest of them, not less than it is exactly */
  zs_lanes_mask triangle;
} packet;

/* A triangle, relative to a packet's centre. */
typedef struct face {
  zs_lanes a[3], ab[3], ac[3], bc[3], normal[3];
  zs_lanes by_ab, by_ac, by_bc; /* 1 / squared lengths */
} face;

static inline zs_lanes dot(const zs_lanes a[3], const zs_lanes b[3])
{
  return zs_lanes_multiply_add(a[0], b[0], zs_lanes_multiply_add(a[1], b[1], a[2] * b[2]));
}

static inline double square_of(const double v[3])
{
  return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}

static inline zs_lanes reciprocal(double x)
{
  return zs_lanes_all(x > 1e-30 ? (float)(1 / x) : 0);
}

static inline face face_of(const zs_triangle *t, const double centre[3])
{
  face f;
  double bc[3];
  for (int k = 0; k < 3; k++) {
    bc[k] = t->ac[k] - t->ab[k];
    f.a[k] = zs_lanes_all((float)(t->a[k] - centre[k]));
    f.ab[k] = zs_lanes_all((float)t->ab[k]);
    f.ac[k] = zs_lanes_all((float)t->ac[k]);
    f.bc[k] = zs_lanes_all((float)bc[k]);
    f.normal[k] = zs_lanes_all((float)t->normal[k]);
  }
  f.by_ab = reciprocal(square_of(t->ab));
  f.by_ac = reciprocal(square_of(t->ac));
  f.by_bc = reciprocal(square_of(bc));
  return f;
}

/* The squared distance from an edge that begins at the origin. */
static inline zs_lanes edge_distance2(const zs_lanes p[3], const zs_lanes edge[3], zs_lanes scale)
{
  const zs_lanes t =
    zs_lanes_clamped(dot(p, edge) * scale, zs_lanes_all(0), zs_lanes_all(1));
  const zs_lanes d[3] = {p[0] - t * edge[0], p[1] - t * edge[1], p[2] - t * edge[2]};
  return dot(d, d);
}

/* Whether a point is on the inner side of an edge, seen along the normal. */
static inline zs_lanes side(const zs_lanes p[3], const zs_lanes edge[3], const zs_lanes normal[3])
{
  return normal[0] * (edge[1] * p[2] - edge[2] * p[1]) +
         normal[1] * (edge[2] * p[0] - edge[0] * p[2]) +
         normal[2] * (edge[0] * p[1] - edge[1] * p[0]);
}

static inline void try_triangle(packet *k, const zs_triangles *s, uint32_t index)
{
  const face f = face_of(&s->triangles[index], k->centre);
  const zs_lanes zero = zs_lanes_all(0);
  zs_lanes ap[3], bp[3];
  for (int i = 0; i < 3; i++) {
    ap[i] = k->p[i] - f.a[i];
    bp[i] = ap[i] - f.ab[i];
  }
  const zs_lanes edges = zs_lanes_smaller(
    edge_distance2(bp, f.bc, f.by_bc),
    zs_lanes_smaller(edge_distance2(ap, f.ab, f.by_ab), edge_distance2(ap, f.ac, f.by_ac)));
  const zs_lanes height = dot(ap, f.normal);
  /* Without an area all three are 0, and the edges are nearest. */
  const zs_lanes_mask within = (side(ap, f.ab, f.normal) > zero) &
                               (side(bp, f.bc, f.normal) > zero) &
                               (side(ap, f.ac, f.normal) < zero);
  const zs_lanes distance2 = zs_lanes_select(within, height * height, edges);
  const zs_lanes_mask nearer = distance2 < k->distance2;
  k->distance2 = zs_lanes_select(nearer, distance2, k->distance2);
  k->triangle = (nearer & (int32_t)index) | (~nearer & k->triangle);
}

/* Squared distance of a box from the packet's. */
static inline double gap2_of(const packet *k, const zs_triangle_box *box)
{
  double sum = 0;
  for (int i = 0; i < 3; i++) {
    const double below = box->lo[i] - k->hi[i], above = k->lo[i] - box->hi[i];
    const double d = below > above ? below : above;
    sum += d > 0 ? d * d : 0;
  }
  return sum;
}

static inline void find_most(packet *k)
{
  float most = 0;
  for (int l = 0; l < ZS_WIDTH; l++)
    most = k->distance2[l] > most ? k->distance2[l] : most;
  k->most2 = (double)most * (1 + 1e-5);
}

/* Find what is nearest to the points of a packet, one of which is near triangle `guess`. */
static void search(packet *k, const zs_triangles *s, uint32_t guess)
{
  k->distance2 = zs_lanes_all(INFINITY);
  k->triangle = (zs_lanes_mask){0} + (int32_t)guess;
  try_triangle(k, s, guess);
  find_most(k);
  for (uint32_t at = 0; at < s->box_count;) {
    const zs_triangle_box *box = &s->boxes[at];
    if (gap2_of(k, box) > k->most2) {
      at = box->skip;
      continue;
    }
    for (uint32_t i = 0; i < box->count; i++)
      try_triangle(k, s, box->first + i);
    if (box->count)
      find_most(k);
    at++;
  }
}

/* Whether the points are so far apart that single precision would not tell what is nearest, or
 * that what is nearest to one of them has little to do with the others: then it is quicker to
 * look for it point by point. */
static bool is_wide(const packet *k, const zs_triangles *s)
{
  const zs_triangles *whole = s->whole;
  const zs_triangle_box *all = &whole->boxes[0];
  double size = 0, apart = 0;
  for (int i = 0; i < 3; i++) {
    size = all->hi[i] - all->lo[i] > size ? all->hi[i] - all->lo[i] : size;
    apart = k->hi[i] - k->lo[i] > apart ? k->hi[i] - k->lo[i] : apart;
  }
  return apart > size / 4 || apart > MANY_SIDES * whole->side;
}

/* Gather the points from `first` on.  Those that are not finite stand in for by 0. */
static void gather(packet *k, const zs_block_arguments *a, unsigned first)
{
  for (int i = 0; i < 3; i++) {
    k->lo[i] = INFINITY;
    k->hi[i] = -INFINITY;
    for (unsigned l = 0; l < ZS_WIDTH; l++) {
      const double x = (double)a->in[i][first + l], finite = isfinite(x) ? x : 0;
      k->lo[i] = finite < k->lo[i] ? finite : k->lo[i];
      k->hi[i] = finite > k->hi[i] ? finite : k->hi[i];
    }
    k->centre[i] = k->lo[i] + (k->hi[i] - k->lo[i]) / 2;
    for (unsigned l = 0; l < ZS_WIDTH; l++) {
      const double x = (double)a->in[i][first + l];
      k->p[i][l] = (float)((isfinite(x) ? x : 0) - k->centre[i]);
    }
  }
}

/* A point whose side is known. */
typedef struct known {
  double p[3], distance; /* INFINITY less than nothing: there is none yet */
  bool inside;
} known;

/* What is nearest to one point. */
typedef struct result {
  double f, from[3];
  const zs_triangle *triangle;
} result;

/* The exact distance, from the triangle that has been found, and its sign.  The way between
 * two points does not meet the surface when it is shorter than their distances from it. */
static void settle(const zs_triangles *s, const double p[3], uint32_t triangle, known *last,
                   result *out)
{
  out->triangle = &s->triangles[triangle];
  const double distance = sqrt(zs_triangle_distance2(out->triangle, p, out->from));
  double way2 = 0;
  for (int k = 0; k < 3; k++)
    way2 += (p[k] - last->p[k]) * (p[k] - last->p[k]);
  const double clear = 0.999 * (distance + last->distance);
  if (!(clear > 0 && way2 < clear * clear))
    last->inside = zs_triangles_inside(s, p);
  for (int k = 0; k < 3; k++)
    last->p[k] = p[k];
  last->distance = distance;
  out->f = last->inside ? distance : -distance;
}

typedef void deliver(const zs_block_arguments *a, unsigned i, const result *r);

/* Work a block out and deliver it point by point; results are written when the whole packet
 * has been read. */
ZS_INLINE void work_out(const zs_block_arguments *a, deliver *deliver)
{
  const zs_triangles *s = a->data;
  known last = {.distance = -INFINITY};
  uint32_t guess = UINT32_MAX;
  for (unsigned first = 0; first < a->n; first += ZS_WIDTH) {
    packet k;
    gather(&k, a, first);
    const bool wide = is_wide(&k, s);
    if (guess == UINT32_MAX)
      guess = zs_triangles_guess(s, k.centre);
    if (!wide)
      search(&k, s, guess);
    for (unsigned l = 0; l < ZS_WIDTH; l++) {
      const unsigned i = first + l;
      const double p[3] = {(double)a->in[0][i], (double)a->in[1][i], (double)a->in[2][i]};
      result r = {.f = NAN, .from = {NAN, NAN, NAN}};
      if (!isfinite(p[0] + p[1] + p[2])) {
        r.f = zs_triangles_distance(s, p);
      } else {
        guess = wide ? zs_triangles_nearest(s, p, guess) : (uint32_t)k.triangle[l];
        settle(s, p, guess, &last, &r);
      }
      deliver(a, i, &r);
    }
  }
}

ZS_INLINE void deliver_value(const zs_block_arguments *a, unsigned i, const result *r)
{
  a->out[i] = (float)r->f;
}

/* The gradient is a unit vector along the way to the nearest point; on the surface, across
 * the triangle. */
ZS_INLINE void deliver_gradient(const zs_block_arguments *a, unsigned i, const result *r)
{
  double g[3];
  for (int k = 0; k < 3; k++)
    g[k] = r->f != 0 ? r->from[k] / r->f : -r->triangle->normal[k];
  for (unsigned row = 1; row < 4; row++)
    a->out[row * ZS_BLOCK + i] = (float)(g[0] * (double)a->in[0][row * ZS_BLOCK + i] +
                                         g[1] * (double)a->in[1][row * ZS_BLOCK + i] +
                                         g[2] * (double)a->in[2][row * ZS_BLOCK + i]);
  a->out[i] = (float)r->f;
}

static void value(const zs_block_arguments *a)
{
  work_out(a, deliver_value);
}

static void gradient(const zs_block_arguments *a)
{
  work_out(a, deliver_gradient);
}

/* The distance changes no faster than the point moves. */
static void bounds(const zs_bounds_arguments *a)
{
  for (unsigned l = 0; l < ZS_LANES; l++) {
    double p[3], half = 0;
    for (int k = 0; k < 3; k++) {
      const double lo = (double)a->in[k]->lo[l], side = (double)a->in[k]->hi[l] - lo;
      p[k] = lo + side / 2;
      half += side * side / 4;
    }
    half = sqrt(half);
    float f_lo = NAN, f_hi = NAN;
    if (isfinite(half + p[0] + p[1] + p[2])) {
      const double f = zs_triangles_distance(a->data, p);
      const double slack = 1e-6 * (fabs(f) + half);
      f_lo = (float)(f - half - slack);
      f_hi = (float)(f + half + slack);
    }
    a->out->lo[l] = f_lo;
    a->out->hi[l] = f_hi;
  }
}

const zs_kernels ZS_KERNELS(zs_triangles_kernels) = {value, gradient, bounds};
