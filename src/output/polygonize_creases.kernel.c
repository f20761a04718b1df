/* Compiled once per instruction set. */
#include "output/polygonize_creases.h"

#include "field/lanes.h"

extern const zs_crease_kernels ZS_KERNELS(zs_crease_kernels);

typedef zs_lanes vector[3];

static inline void load(const float *from, size_t stride, vector v)
{
  for (size_t k = 0; k < 3; k++)
    v[k] = zs_lanes_load(from + k * stride);
}

static inline void store(float *to, size_t stride, const vector v)
{
  for (size_t k = 0; k < 3; k++)
    zs_lanes_store(to + k * stride, v[k]);
}

static inline zs_lanes dot(const vector a, const vector b)
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline zs_lanes ones_where(zs_lanes_mask mask)
{
  return zs_lanes_select(mask, zs_lanes_all(1), zs_lanes_all(0));
}

/* ---- Where planes meet ---------------------------------------------------------- */

/* Directions in which planes say less than this part of what they say in the
 * best one are left alone, as along an edge. */
static const float INFORMATIVE = 0.02f;

/* A vector of symmetric matrices, and what turns them. */
typedef struct matrices {
  zs_lanes a[3][3]; /* a[i][j] where i <= j */
  zs_lanes v[3][3];
} matrices;

/* Turn the plane of axes p < q so that a[p][q] becomes 0; r is the third axis. */
static inline void turn(matrices *m, int p, int q, int r)
{
  zs_lanes(*const a)[3] = m->a;
  zs_lanes *const with_p = p < r ? &a[p][r] : &a[r][p], *const with_q = q < r ? &a[q][r] : &a[r][q];
  const zs_lanes off = a[p][q], theta = (a[q][q] - a[p][p]) / (2 * off);
  const zs_lanes positive =
    1 / (zs_lanes_absolute(theta) + zs_lanes_square_root(theta * theta + 1));
  const zs_lanes t = zs_lanes_select(
    off != 0, zs_lanes_select(theta < 0, -positive, positive), zs_lanes_all(0));
  const zs_lanes c = 1 / zs_lanes_square_root(t * t + 1), s = t * c;
  a[p][p] -= t * off;
  a[q][q] += t * off;
  a[p][q] = zs_lanes_all(0);
  const zs_lanes x = *with_p, y = *with_q;
  *with_p = c * x - s * y;
  *with_q = s * x + c * y;
  for (int k = 0; k < 3; k++) {
    const zs_lanes u = m->v[k][p], w = m->v[k][q];
    m->v[k][p] = c * u - s * w;
    m->v[k][q] = s * u + c * w;
  }
}

/* Jacobi's method: eigenvalues to the diagonal of a, eigenvectors to the columns
 * of v. */
static inline void diagonalize(matrices *m)
{
  enum { MOST_SWEEPS = 6 };
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      m->v[i][j] = zs_lanes_all(i == j);
  const zs_lanes rounding = 1e-8f * (m->a[0][0] + m->a[1][1] + m->a[2][2]);
  for (int sweep = 0; sweep < MOST_SWEEPS; sweep++) {
    const zs_lanes off = zs_lanes_larger(
      zs_lanes_absolute(m->a[0][1]),
      zs_lanes_larger(zs_lanes_absolute(m->a[0][2]), zs_lanes_absolute(m->a[1][2])));
    if (!zs_lanes_bits(off > rounding))
      return;
    turn(m, 0, 1, 2);
    turn(m, 0, 2, 1);
    turn(m, 1, 2, 0);
  }
}

/* The least x for which a x is closest to b. */
static inline void solve(const matrices *m, const vector b, vector x)
{
  const zs_lanes largest =
    zs_lanes_larger(m->a[0][0], zs_lanes_larger(m->a[1][1], m->a[2][2]));
  for (int k = 0; k < 3; k++)
    x[k] = zs_lanes_all(0);
  for (int k = 0; k < 3; k++) {
    const vector axis = {m->v[0][k], m->v[1][k], m->v[2][k]};
    const zs_lanes along = zs_lanes_select(m->a[k][k] > INFORMATIVE * largest,
                                           dot(axis, b) / m->a[k][k], zs_lanes_all(0));
    for (int l = 0; l < 3; l++)
      x[l] += along * axis[l];
  }
}

/* Whether any two of the normals are those of different sides of a sharp edge, and
 * none is missing. */
static inline zs_lanes_mask are_sharp(const vector normal[], int longest)
{
  zs_lanes least = zs_lanes_all(1);
  zs_lanes_mask there = zs_lanes_all(0) == 0;
  for (int i = 0; i < longest; i++) {
    there &= dot(normal[i], normal[i]) > 0;
    for (int j = 0; j < i; j++)
      least = zs_lanes_smaller(dot(normal[i], normal[j]), least);
  }
  return there & (least < ZS_SHARP);
}

/* What loops have of their vertex i; those that are shorter repeat their first. */
static inline void load_vertices(const zs_loops *loops, unsigned at, int longest,
                                 const float from[][3][ZS_LOOPS], vector v[])
{
  const zs_lanes length = zs_lanes_load(loops->length + at);
  for (int i = 0; i < longest; i++) {
    load(from[i][0] + at, ZS_LOOPS, v[i]);
    for (int k = 0; k < 3; k++)
      v[i][k] = zs_lanes_select(length > (float)i, v[i][k], v[0][k]);
  }
}

/* Make places relative to their middle; returns that less the first one. */
static inline void find_middle(zs_lanes length, int longest, vector point[], vector middle)
{
  for (int k = 0; k < 3; k++) {
    const zs_lanes first = point[0][k];
    zs_lanes sum = zs_lanes_all(0);
    for (int i = 1; i < longest; i++)
      sum += point[i][k] - first;
    middle[k] = sum / length;
    for (int i = 0; i < longest; i++)
      point[i][k] = (point[i][k] - first) - middle[k];
  }
}

/* Sums over planes: of the products of their normals to the matrix, of the normals
 * themselves, and of them times the distances of the planes. */
static inline void add_planes(zs_lanes length, int longest, const vector point[],
                              const vector normal[], zs_lanes a[3][3], vector normals,
                              vector distances)
{
  for (int k = 0; k < 3; k++) {
    normals[k] = distances[k] = zs_lanes_all(0);
    for (int l = k; l < 3; l++)
      a[k][l] = zs_lanes_all(0);
  }
  for (int i = 0; i < longest; i++) {
    const zs_lanes counts = ones_where(length > (float)i);
    const zs_lanes distance = dot(normal[i], point[i]);
    for (int k = 0; k < 3; k++) {
      const zs_lanes n = counts * normal[i][k];
      normals[k] += n;
      distances[k] += n * distance;
      for (int l = k; l < 3; l++)
        a[k][l] += n * normal[i][l];
    }
  }
}

/* A vector of loops from number `at` on. */
static uint16_t meet_several(zs_loops *loops, unsigned at)
{
  vector point[ZS_LONGEST_LOOP], normal[ZS_LONGEST_LOOP];
  const zs_lanes length = zs_lanes_load(loops->length + at);
  int longest = 0;
  for (unsigned l = 0; l < ZS_WIDTH; l++)
    longest = length[l] > (float)longest ? (int)length[l] : longest;
  load_vertices(loops, at, longest, (const float(*)[3][ZS_LOOPS])loops->normal, normal);
  const zs_lanes_mask sharp = are_sharp((const vector *)normal, longest);
  if (!zs_lanes_bits(sharp))
    return 0;
  load_vertices(loops, at, longest, (const float(*)[3][ZS_LOOPS])loops->point, point);
  matrices m;
  vector middle, normals, distances, place, direction;
  find_middle(length, longest, point, middle);
  add_planes(length, longest, (const vector *)point, (const vector *)normal, m.a, normals,
             distances);
  diagonalize(&m);
  solve(&m, distances, place);
  solve(&m, normals, direction);
  const zs_lanes size = zs_lanes_square_root(dot(direction, direction));
  zs_lanes_mask found = sharp & (size > 0) & (size < INFINITY);
  for (int k = 0; k < 3; k++) {
    place[k] += middle[k];
    direction[k] /= size;
    found &= zs_lanes_absolute(place[k]) < INFINITY;
  }
  store(loops->place[0] + at, ZS_LOOPS, (const zs_lanes *)place);
  store(loops->direction[0] + at, ZS_LOOPS, (const zs_lanes *)direction);
  return zs_lanes_bits(found);
}

static uint64_t meet(zs_loops *loops)
{
  uint64_t found = 0;
  for (unsigned i = loops->count; i % ZS_LANES; i++)
    loops->length[i] = 0;
  for (unsigned i = 0; i < loops->count; i += ZS_WIDTH)
    found |= (uint64_t)meet_several(loops, i) << i;
  return loops->count < ZS_LOOPS ? found & ((UINT64_C(1) << loops->count) - 1) : found;
}

/* ---- Settling -------------------------------------------------------------------- */

static void find_rooms(zs_settling *s, const zs_room *room)
{
  for (int k = 0; k < 3; k++) {
    const zs_lanes first = zs_lanes_all(room->first[k]), last = zs_lanes_all(room->last[k]);
    for (unsigned i = 0; i < s->count; i += ZS_WIDTH) {
      const zs_lanes corner = room->side[k] * zs_lanes_load(s->corner[k] + i);
      const zs_lanes lo = zs_lanes_clamped(corner - room->below[k], first, last);
      const zs_lanes hi = zs_lanes_clamped(corner + room->above[k], first, last);
      zs_lanes_store(s->lo[k] + i, lo);
      zs_lanes_store(s->hi[k] + i, hi);
      zs_lanes_store(s->from[k] + i, zs_lanes_clamped(zs_lanes_load(s->place[k] + i), lo, hi));
    }
  }
}

static void end_lines(zs_settling *s, float reach)
{
  for (unsigned i = 0; i < s->count; i += ZS_WIDTH) {
    const zs_lanes side =
      zs_lanes_select(zs_lanes_load(s->f_from + i) >= 0, zs_lanes_all(1), zs_lanes_all(-1));
    vector from, step, lo, hi, to;
    load(s->from[0] + i, ZS_BLOCK, from);
    load(s->normal[0] + i, ZS_BLOCK, step);
    load(s->lo[0] + i, ZS_BLOCK, lo);
    load(s->hi[0] + i, ZS_BLOCK, hi);
    zs_lanes length = zs_lanes_all(reach);
    for (int k = 0; k < 3; k++) {
      step[k] *= side;
      const zs_lanes wall = zs_lanes_select(step[k] > 0, hi[k], lo[k]);
      const zs_lanes most = (wall - from[k]) / step[k];
      length = zs_lanes_select(step[k] != 0, zs_lanes_smaller(most, length), length);
    }
    length = zs_lanes_larger(length, zs_lanes_all(0));
    for (int k = 0; k < 3; k++)
      to[k] = zs_lanes_clamped(from[k] + length * step[k], lo[k], hi[k]);
    store(s->to[0] + i, ZS_BLOCK, to);
  }
}

const zs_crease_kernels ZS_KERNELS(zs_crease_kernels) = {
  .meet = meet, .rooms = find_rooms, .lines = end_lines};
