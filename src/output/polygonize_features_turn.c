/* The features method's sharp edges, where they pass by cells.
 *
 * Where the planes of a cell meet outside of it, its vertex stands aside, on one of
 * the sides of the sharp edge.  A mesh edge from there to a vertex on another side
 * cuts the sharp edge off.  Between two vertices on the sharp edge all mesh edges
 * from side to side follow one another in a strip; turning one in the quadrilateral
 * of its two triangles, from either end of the strip on, makes it lead from a vertex
 * on the sharp edge along one side, and the last one along the sharp edge itself.
 * Triangles that are folded or no more than a line are mended by turning too.
 *
 * Every turn leaves less to mend, so that turning comes to an end.  It replaces two
 * triangles by two with the same outline; as long as the new mesh edge is not in the
 * mesh already, a closed oriented manifold stays one. */
#include "output/polygonize.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Triangles with less height for their length are no more than lines. */
static const float FLATTEST = 1e-3f;

/* The sine of the angle at which a mesh edge leaves a side of a sharp edge. */
static const float STEEPEST = 0.2f;

/* What a vertex is: on a sharp edge; where there may be something to mend; and near
 * one of those, so that all of its triangles are looked at. */
enum { SHARP = 1, SUSPECT = 2, KNOWN = 4 };

/* Mesh edges are turned to lie along sharp edges first, and then whatever mends. */
typedef enum aim { SHARPEN, MEND } aim;

static const uint32_t NONE = UINT32_MAX;

/* The triangles around the vertices in question.  Half-edge 3 i + k leads from
 * corner k of triangle faces[i] to the next corner. */
typedef struct turning {
  const zs_polygonize_job *job;
  const zs_mesh *mesh;
  aim aim;
  uint8_t *kinds;   /* of all vertices of the mesh */
  uint32_t *faces;  /* numbers of triangles of the mesh, ascending */
  uint32_t *across; /* by half-edge: the one in the triangle on its other side, or NONE */
  size_t face_count;
  uint32_t *queue;  /* of half-edges to look at */
  size_t begin, end;
} turning;

/* ---- Half-edges ----------------------------------------------------------------- */

static uint32_t next_in_face(uint32_t h)
{
  return h % 3 == 2 ? h - 2 : h + 1;
}

static uint32_t before_in_face(uint32_t h)
{
  return h % 3 == 0 ? h + 2 : h - 1;
}

static uint32_t *corner(const turning *t, uint32_t h)
{
  return &t->mesh->triangles[3 * (size_t)t->faces[h / 3] + h % 3];
}

static uint32_t from(const turning *t, uint32_t h)
{
  return *corner(t, h);
}

static uint32_t to(const turning *t, uint32_t h)
{
  return from(t, next_in_face(h));
}

static uint32_t apex(const turning *t, uint32_t h)
{
  return from(t, before_in_face(h));
}

static void join(turning *t, uint32_t h, uint32_t other)
{
  t->across[h] = other;
  if (other != NONE)
    t->across[other] = h;
}

/* Whether a mesh edge joins a known vertex, where half-edge `out` begins, to another
 * one. */
static bool is_joined(const turning *t, uint32_t out, uint32_t other)
{
  uint32_t h = out;
  do {
    if (to(t, h) == other || apex(t, h) == other)
      return true;
    h = t->across[before_in_face(h)];
  } while (h != out && h != NONE);
  if (h == out)
    return false;
  /* The mesh ends here: go on the other way around. */
  for (h = t->across[out]; h != NONE; h = t->across[next_in_face(h)])
    if (apex(t, next_in_face(h)) == other || apex(t, h) == other)
      return true;
  return false;
}

static zs_patch *patch_of(const zs_polygonize_job *job, uint32_t vertex)
{
  size_t lo = 0, hi = job->active_count;
  while (hi - lo > 1) {
    const size_t middle = lo + (hi - lo) / 2;
    *(job->active[middle]->first_patch <= vertex ? &lo : &hi) = middle;
  }
  return &job->active[lo]->patches[vertex - job->active[lo]->first_patch];
}

/* ---- What there is to mend ---------------------------------------------------------- */

static const float *position_of(const turning *t, uint32_t vertex)
{
  return t->mesh->positions + 3 * (size_t)vertex;
}

static const float *normal_of(const turning *t, uint32_t vertex)
{
  return t->mesh->normals + 3 * (size_t)vertex;
}

static float dot(const float a[3], const float b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Vertices that were given up have none (see unfold_patch). */
static bool has_normal(const turning *t, uint32_t vertex)
{
  return dot(normal_of(t, vertex), normal_of(t, vertex)) > 0;
}

/* Whether the way from a vertex on one side of a sharp edge to a sharp one leaves the
 * plane of the side. */
static bool leaves(const turning *t, uint32_t side, uint32_t sharp)
{
  const float *p = position_of(t, side), *q = position_of(t, sharp);
  const float way[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
  const float above = dot(normal_of(t, side), way);
  return above * above > STEEPEST * STEEPEST * dot(way, way);
}

/* Whether a mesh edge between two vertices leads from one side of a sharp edge to
 * another. */
static bool cuts(const turning *t, uint32_t a, uint32_t b)
{
  const bool sharp_a = t->kinds[a] & SHARP, sharp_b = t->kinds[b] & SHARP;
  if (sharp_a != sharp_b)
    return sharp_a ? leaves(t, b, a) : leaves(t, a, b);
  return !sharp_a && has_normal(t, a) && has_normal(t, b) &&
         zs_crease_between(normal_of(t, a), normal_of(t, b));
}

/* A triangle, and how it lies to the normals at its corners. */
typedef struct attitude {
  float along[3]; /* its doubled area by the cosine of the angle to the normal */
  float square;   /* of its length, about */
} attitude;

static attitude look_at(const turning *t, const uint32_t corners[3])
{
  attitude a = {.square = 0};
  float u[3], v[3], n[3];
  const float *p = position_of(t, corners[0]), *q = position_of(t, corners[1]),
              *r = position_of(t, corners[2]);
  for (int k = 0; k < 3; k++) {
    u[k] = q[k] - p[k];
    v[k] = r[k] - p[k];
  }
  for (int k = 0; k < 3; k++)
    n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
  a.square = dot(u, u) + dot(v, v);
  for (int i = 0; i < 3; i++)
    a.along[i] = dot(n, normal_of(t, corners[i]));
  return a;
}

static bool is_folded(const attitude *a)
{
  return a->along[0] < 0 && a->along[1] < 0 && a->along[2] < 0;
}

/* Whether a triangle turns its back on its side, which vertices off the sharp edge
 * know best, or is no more than a line.  Triangles that cut a sharp edge off are
 * mended as that is; only after that counts whether they are folded. */
static bool is_wrong(const turning *t, uint32_t a, uint32_t b, uint32_t c)
{
  /* In one order, or rounding would give another answer another time. */
  if (b < a || c < a)
    return b < c ? is_wrong(t, b, c, a) : is_wrong(t, c, a, b);
  const uint32_t corners[3] = {a, b, c};
  const attitude at = look_at(t, corners);
  float side = 0, sharp = 0;
  bool on_side = false, any = false;
  if (cuts(t, a, b) || cuts(t, b, c) || cuts(t, c, a))
    return t->aim == MEND && is_folded(&at);
  for (int i = 0; i < 3; i++) {
    const bool is_sharp = t->kinds[corners[i]] & SHARP, known = has_normal(t, corners[i]);
    *(is_sharp ? &sharp : &side) += at.along[i];
    on_side = on_side || (known && !is_sharp);
    any = any || known;
  }
  return any && !((on_side ? side : sharp) > FLATTEST * at.square);
}

/* ---- Turning ---------------------------------------------------------------------- */

/* Whether less would be left to mend with the mesh edge a - b of triangles a, b, p
 * and b, a, q turned. */
static bool would_mend(const turning *t, uint32_t a, uint32_t b, uint32_t p, uint32_t q)
{
  int now = cuts(t, a, b);
  if (t->aim == SHARPEN) {
    if (!now || !((t->kinds[p] | t->kinds[q]) & SHARP))
      return false;
  } else {
    now += is_wrong(t, a, b, p) + is_wrong(t, b, a, q);
  }
  return now && cuts(t, p, q) + is_wrong(t, a, q, p) + is_wrong(t, q, b, p) < now;
}

/* Turn the mesh edge of a half-edge if that mends, and may be done. */
static bool turn(turning *t, uint32_t h)
{
  const uint32_t g = t->across[h];
  if (g == NONE)
    return false;
  const uint32_t a = from(t, h), b = to(t, h), p = apex(t, h), q = apex(t, g);
  if (p == q || !would_mend(t, a, b, p, q))
    return false;
  if (t->kinds[p] & KNOWN) {
    if (is_joined(t, before_in_face(h), q))
      return false;
  } else if (!(t->kinds[q] & KNOWN) || is_joined(t, before_in_face(g), p)) {
    return false;
  }
  const uint32_t one = h / 3 * 3, two = g / 3 * 3;
  const uint32_t aq = t->across[next_in_face(g)], pa = t->across[before_in_face(h)],
                 qb = t->across[before_in_face(g)], bp = t->across[next_in_face(h)];
  memcpy(corner(t, one), (const uint32_t[3]){a, q, p}, 3 * sizeof a);
  memcpy(corner(t, two), (const uint32_t[3]){q, b, p}, 3 * sizeof a);
  join(t, one, aq);
  join(t, one + 1, two + 2);
  join(t, one + 2, pa);
  join(t, two, qb);
  join(t, two + 1, bp);
  const uint32_t all[4] = {a, b, p, q};
  for (int i = 0; i < 4; i++)
    patch_of(t->job, all[i])->turned = true;
  return true;
}

static bool is_bad(const turning *t, uint32_t h)
{
  return cuts(t, from(t, h), to(t, h)) || is_wrong(t, from(t, h), to(t, h), apex(t, h));
}

enum { SIDES = 6 }; /* half-edges of two triangles */

static void turn_all(turning *t)
{
  while (t->begin < t->end) {
    const uint32_t h = t->queue[t->begin++], g = t->across[h];
    if (!turn(t, h))
      continue;
    for (uint32_t i = 0; i < SIDES; i++) {
      const uint32_t side = (i < 3 ? h : g) / 3 * 3 + i % 3;
      if (is_bad(t, side))
        t->queue[t->end++] = side;
    }
  }
}

/* All half-edges with something to mend.  There are at least as many of them as
 * turns to come, every one of which adds six at most. */
static bool fill_queue(turning *t)
{
  size_t count = 0;
  for (uint32_t h = 0; h < 3 * t->face_count; h++)
    count += is_bad(t, h);
  free(t->queue);
  t->begin = t->end = 0;
  t->queue = malloc(((SIDES + 1) * count + 1) * sizeof *t->queue);
  for (uint32_t h = 0; t->queue && h < 3 * t->face_count; h++)
    if (is_bad(t, h))
      t->queue[t->end++] = h;
  return t->queue;
}

/* ---- Gathering ----------------------------------------------------------------------- */

/* What the vertices are; whether there may be something to mend. */
static bool find_kinds(const zs_polygonize_job *job, uint8_t *kinds)
{
  bool any = false;
  for (size_t i = 0; i < job->active_count; i++) {
    const zs_brick *brick = job->active[i];
    for (uint32_t p = 0; p < brick->patch_count; p++) {
      const zs_patch *patch = &brick->patches[p];
      const bool suspect = patch->aside || patch->suspect;
      kinds[brick->first_patch + p] =
        (uint8_t)((patch->sharp ? SHARP : 0) | (suspect ? SUSPECT : 0));
      any = any || suspect;
    }
  }
  return any;
}

static unsigned kinds_of(const turning *t, size_t triangle)
{
  const uint32_t *v = t->mesh->triangles + 3 * triangle;
  return t->kinds[v[0]] | t->kinds[v[1]] | t->kinds[v[2]];
}

/* Gather all triangles around the vertices in question and around those that
 * triangles join to them. */
static bool find_faces(turning *t)
{
  const size_t all = t->mesh->triangle_count;
  size_t count = 0;
  for (size_t i = 0; i < all; i++)
    for (int k = 0; k < 3 && kinds_of(t, i) & SUSPECT; k++)
      t->kinds[t->mesh->triangles[3 * i + (size_t)k]] |= KNOWN;
  for (size_t i = 0; i < all; i++)
    count += (kinds_of(t, i) & KNOWN) != 0;
  if (count > UINT32_MAX / 3 || !(t->faces = malloc((count + 1) * sizeof *t->faces)))
    return false;
  for (size_t i = 0; i < all; i++)
    if (kinds_of(t, i) & KNOWN)
      t->faces[t->face_count++] = (uint32_t)i;
  return true;
}

/* Where to look first for a mesh edge among a power of two slots. */
static size_t slot_of(uint32_t a, uint32_t b, size_t slots)
{
  const uint64_t key = a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
  return (size_t)(key * UINT64_C(0x9e3779b97f4a7c15) >> 32) & (slots - 1);
}

/* Find each half-edge's other side, by a hash of its ends. */
static bool find_across(turning *t)
{
  const size_t count = 3 * t->face_count;
  size_t size = 16;
  while (size < 2 * count)
    size *= 2;
  uint32_t *slots = malloc(size * sizeof *slots);
  t->across = malloc((count + 1) * sizeof *t->across);
  if (!slots || !t->across) {
    free(slots);
    return false;
  }
  for (size_t i = 0; i < size; i++)
    slots[i] = NONE;
  for (uint32_t h = 0; h < count; h++) {
    const uint32_t a = from(t, h), b = to(t, h);
    size_t slot = slot_of(a, b, size);
    while (slots[slot] != NONE && !(from(t, slots[slot]) == b && to(t, slots[slot]) == a))
      slot = (slot + 1) & (size - 1);
    join(t, h, slots[slot]);
    if (slots[slot] == NONE)
      slots[slot] = h;
  }
  free(slots);
  return true;
}

/* ---- Folds --------------------------------------------------------------------------- */

static void mark_folds(const turning *t)
{
  for (size_t i = 0; i < t->face_count; i++) {
    const uint32_t *corners = t->mesh->triangles + 3 * (size_t)t->faces[i];
    const attitude a = look_at(t, corners);
    for (int k = 0; k < 3 && is_folded(&a); k++)
      patch_of(t->job, corners[k])->folded = true;
  }
}

bool zs_polygonize_turn(zs_polygonize_job *job)
{
  turning t = {.job = job, .mesh = job->dual, .kinds = malloc(job->patch_count)};
  bool done = t.kinds;
  if (done && find_kinds(job, t.kinds)) {
    done = find_faces(&t) && find_across(&t);
    for (t.aim = SHARPEN; done && t.aim <= MEND; t.aim++)
      if ((done = fill_queue(&t)))
        turn_all(&t);
    if (done)
      mark_folds(&t);
  }
  free(t.kinds);
  free(t.faces);
  free(t.across);
  free(t.queue);
  return done || zs_fail_memory(job->diag);
}
