/* Closed surfaces from meshes of files: vertices joined, holes filled. */
#include "mesh/mesh.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A side of a triangle. */
typedef struct side {
  uint32_t from, to;
} side;

typedef struct closer {
  const zs_mesh *mesh;
  uint32_t *same;      /* by vertex: the first one at its place */
  side *sides;         /* later: those without a partner, by `from` */
  size_t side_count;
  uint32_t *rim;       /* vertices of the hole at hand */
  uint32_t *place;     /* by vertex: 1 + where it is in the rim; 0: it is not */
  size_t *next;        /* by vertex: the side that leads on from it */
  zs_mesh *closed;     /* the result */
  zs_mesh_holes *holes;
  zs_diag *diag;
} closer;

/* ---- Vertices at the same place --------------------------------------------------- */

typedef struct spot {
  float p[3];
  uint32_t vertex;
} spot;

static int compare_spots(const void *a, const void *b)
{
  const spot *p = a, *q = b;
  for (int k = 0; k < 3; k++)
    if (p->p[k] != q->p[k])
      return p->p[k] < q->p[k] ? -1 : 1;
  return p->vertex < q->vertex ? -1 : 1;
}

static bool join_vertices(closer *c)
{
  const size_t count = c->mesh->vertex_count;
  spot *spots = malloc(count * sizeof *spots);
  if (!spots)
    return zs_fail_memory(c->diag);
  for (size_t v = 0; v < count; v++) {
    memcpy(spots[v].p, c->mesh->positions + 3 * v, sizeof spots[v].p);
    spots[v].vertex = (uint32_t)v;
  }
  qsort(spots, count, sizeof *spots, compare_spots);
  for (size_t i = 0; i < count; i++) {
    const spot *s = &spots[i];
    const bool first = i == 0 || s->p[0] != s[-1].p[0] || s->p[1] != s[-1].p[1] ||
                       s->p[2] != s[-1].p[2];
    c->same[s->vertex] = first ? s->vertex : c->same[s[-1].vertex];
  }
  free(spots);
  return true;
}

/* ---- Holes --------------------------------------------------------------------------- */

static int compare_sides(const void *a, const void *b)
{
  const side *p = a, *q = b;
  const uint32_t p_lo = p->from < p->to ? p->from : p->to, p_hi = p->from ^ p->to ^ p_lo;
  const uint32_t q_lo = q->from < q->to ? q->from : q->to, q_hi = q->from ^ q->to ^ q_lo;
  if (p_lo != q_lo)
    return p_lo < q_lo ? -1 : 1;
  if (p_hi != q_hi)
    return p_hi < q_hi ? -1 : 1;
  return p->from < q->from ? -1 : p->from > q->from;
}

static int compare_from(const void *a, const void *b)
{
  const side *p = a, *q = b;
  if (p->from != q->from)
    return p->from < q->from ? -1 : 1;
  return p->to < q->to ? -1 : p->to > q->to;
}

/* Keep the sides that are run along more often one way than the other: as many leave
 * every vertex as arrive there, since those of a triangle do. */
static void keep_unmatched(closer *c)
{
  size_t kept = 0;
  qsort(c->sides, c->side_count, sizeof *c->sides, compare_sides);
  for (size_t i = 0, end; i < c->side_count; i = end) {
    const side first = c->sides[i];
    size_t along = 0, back = 0;
    for (end = i; end < c->side_count; end++) {
      const side *s = &c->sides[end];
      if (s->from == first.from && s->to == first.to)
        along++;
      else if (s->from == first.to && s->to == first.from)
        back++;
      else
        break;
    }
    const side way = along > back ? first : (side){first.to, first.from};
    for (size_t n = along > back ? along - back : back - along; n > 0; n--)
      c->sides[kept++] = way;
  }
  c->side_count = kept;
  qsort(c->sides, kept, sizeof *c->sides, compare_from);
}

static void add_triangle(zs_mesh *m, uint32_t a, uint32_t b, uint32_t c)
{
  const uint32_t corners[3] = {a, b, c};
  memcpy(m->triangles + 3 * m->triangle_count++, corners, sizeof corners);
}

/* Fill a hole with a fan of triangles about the middle of its rim, which the sides of its
 * neighbours run along. */
static void fill_hole(closer *c, size_t first, size_t count)
{
  zs_mesh *m = c->closed;
  const uint32_t *rim = c->rim + first;
  c->holes->count++;
  c->holes->sides += count;
  if (count == 3) {
    add_triangle(m, rim[2], rim[1], rim[0]);
    return;
  }
  double middle[3] = {0, 0, 0}, total = 0;
  for (size_t i = 0; i < count; i++) {
    const float *p = m->positions + 3 * (size_t)rim[i];
    const float *q = m->positions + 3 * (size_t)rim[(i + 1) % count];
    double length = 0;
    for (int k = 0; k < 3; k++)
      length = hypot(length, (double)q[k] - (double)p[k]);
    for (int k = 0; k < 3; k++)
      middle[k] += length * ((double)p[k] + (double)q[k]) / 2;
    total += length;
  }
  const uint32_t centre = (uint32_t)m->vertex_count++;
  for (size_t k = 0; k < 3; k++)
    m->positions[3 * (size_t)centre + k] = (float)(middle[k] / total);
  for (size_t i = 0; i < count; i++)
    add_triangle(m, rim[(i + 1) % count], rim[i], centre);
}

/* Follow unmatched sides from vertex to vertex; a vertex met for the second time closes a
 * hole. */
static void fill_holes(closer *c)
{
  size_t length = 0;
  for (size_t i = 0; i < c->side_count; i++)
    if (i == 0 || c->sides[i].from != c->sides[i - 1].from)
      c->next[c->sides[i].from] = i;
  for (size_t start = 0; start < c->side_count || length > 0;) {
    if (length == 0) {
      const uint32_t from = c->sides[start].from;
      if (c->next[from] != start) { /* has been followed */
        start++;
        continue;
      }
      c->rim[length++] = from;
      c->place[from] = 1;
    }
    const uint32_t at = c->rim[length - 1];
    const uint32_t to = c->sides[c->next[at]++].to;
    if (!c->place[to]) {
      c->rim[length++] = to;
      c->place[to] = (uint32_t)length;
      continue;
    }
    const size_t first = c->place[to] - 1;
    fill_hole(c, first, length - first);
    while (length > first + 1)
      c->place[c->rim[--length]] = 0;
    if (first == 0) { /* back at the start */
      c->place[to] = 0;
      length = 0;
    }
  }
}

/* ---- The surface ----------------------------------------------------------------------- */

/* Triangles of three different vertices, with their sides. */
static void copy_triangles(closer *c)
{
  for (size_t t = 0; t < c->mesh->triangle_count; t++) {
    uint32_t v[3];
    for (size_t k = 0; k < 3; k++)
      v[k] = c->same[c->mesh->triangles[3 * t + k]];
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
      continue;
    add_triangle(c->closed, v[0], v[1], v[2]);
    for (int k = 0; k < 3; k++)
      c->sides[c->side_count++] = (side){v[k], v[(k + 1) % 3]};
  }
}

/* Six times the volume inside. */
static double volume_of(const zs_mesh *m)
{
  double volume = 0;
  for (size_t t = 0; t < m->triangle_count; t++) {
    double v[3][3];
    for (size_t i = 0; i < 3; i++)
      for (size_t k = 0; k < 3; k++)
        v[i][k] = (double)m->positions[3 * (size_t)m->triangles[3 * t + i] + k] -
                  (double)m->positions[k];
    for (int k = 0; k < 3; k++)
      volume += v[0][k] * (v[1][(k + 1) % 3] * v[2][(k + 2) % 3] -
                           v[1][(k + 2) % 3] * v[2][(k + 1) % 3]);
  }
  return volume;
}

static bool close_mesh(closer *c)
{
  const zs_mesh *m = c->mesh;
  const size_t vertices = m->vertex_count, sides = 3 * m->triangle_count;
  c->same = malloc(vertices * sizeof *c->same);
  c->sides = malloc((sides + 1) * sizeof *c->sides);
  c->rim = malloc((vertices + 1) * sizeof *c->rim);
  c->place = calloc(vertices, sizeof *c->place);
  c->next = calloc(vertices, sizeof *c->next);
  /* Every hole has three sides at least, and a triangle for each. */
  c->closed = zs_mesh_new(vertices + m->triangle_count, m->triangle_count + sides, false, c->diag);
  if (!c->closed)
    return false;
  if (!c->same || !c->sides || !c->rim || !c->place || !c->next)
    return zs_fail_memory(c->diag);
  if (!join_vertices(c))
    return false;
  memcpy(c->closed->positions, m->positions, 3 * vertices * sizeof *m->positions);
  c->closed->vertex_count = vertices;
  c->closed->triangle_count = 0;
  copy_triangles(c);
  keep_unmatched(c);
  fill_holes(c);
  if (volume_of(c->closed) < 0) {
    c->holes->inside_out = true;
    for (size_t t = 0; t < c->closed->triangle_count; t++) {
      uint32_t *v = c->closed->triangles + 3 * t, first = v[0];
      v[0] = v[1];
      v[1] = first;
    }
  }
  return true;
}

zs_mesh *zs_mesh_close(const zs_mesh *mesh, zs_mesh_holes *holes, zs_diag *diag)
{
  closer c = {.mesh = mesh, .holes = holes, .diag = diag};
  *holes = (zs_mesh_holes){0};
  const bool done = close_mesh(&c);
  free(c.same);
  free(c.sides);
  free(c.rim);
  free(c.place);
  free(c.next);
  if (done)
    return c.closed;
  zs_mesh_free(c.closed);
  return NULL;
}
