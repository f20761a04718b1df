/* Topology and measures of a mesh. */
#include "mesh/mesh.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Corner 3t + k is corner k of triangle t.  What is known of a vertex follows from
 * the corners at it: the vertices before and after each are the other ends of its
 * edges.  Vertices are looked at range by range, so that the lists of corners need
 * little memory however large the mesh is. */
enum { RANGE_CORNERS = 1 << 24 /* about as many in the lists of a range */ };

/* An end of an edge at the vertex at hand. */
typedef struct spoke {
  uint32_t end;    /* the edge's other vertex */
  uint32_t corner; /* place in the vertex's list */
  bool outward;    /* the triangle runs along the edge from the vertex at hand */
} spoke;

typedef struct checker {
  const zs_mesh *mesh;
  uint32_t lo, hi;   /* vertices of the range: lo <= v < hi */
  uint32_t *first;   /* by vertex of the range: its corners begin here; one more */
  uint32_t *corners;
  uint32_t *piece;   /* by vertex: union-find of connected vertices */
  spoke *spokes;     /* of one vertex */
  uint32_t *fan;     /* by corner of one vertex: union-find */
  size_t most;       /* corners at one vertex that there is room for */
  size_t used, edges;
} checker;

static uint32_t next_corner(uint32_t corner)
{
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

/* Whether a triangle has three different vertices.  Others cover nothing, and
 * leaving them out leaves their neighbours joined. */
static bool is_proper(const uint32_t v[3])
{
  return v[0] != v[1] && v[1] != v[2] && v[2] != v[0];
}

/* ---- Union-find, by path halving ------------------------------------------- */

static uint32_t root(uint32_t *parent, uint32_t i)
{
  while (parent[i] != i) {
    parent[i] = parent[parent[i]];
    i = parent[i];
  }
  return i;
}

/* The lower number becomes the root. */
static void unite(uint32_t *parent, uint32_t a, uint32_t b)
{
  a = root(parent, a);
  b = root(parent, b);
  if (a < b)
    parent[b] = a;
  else
    parent[a] = b;
}

/* ---- Corners -------------------------------------------------------------------- */

static bool in_range(const checker *c, uint32_t vertex)
{
  return vertex >= c->lo && vertex < c->hi;
}

/* Corners at every vertex. */
static void count_corners(const zs_mesh *mesh, uint32_t *count)
{
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t *v = &mesh->triangles[3 * t];
    for (unsigned k = 0; k < 3 && is_proper(v); k++)
      count[v[k]]++;
  }
}

/* List the corners at the vertices of the range, by counting.  `counts` are those
 * of the range. */
static void list_corners(checker *c, const uint32_t *counts)
{
  const zs_mesh *mesh = c->mesh;
  const uint32_t n = c->hi - c->lo;
  c->first[0] = 0;
  for (uint32_t i = 0; i < n; i++)
    c->first[i + 1] = c->first[i] + counts[i];
  /* Filling from the back moves the ends of the lists to their beginnings. */
  for (size_t t = mesh->triangle_count; t-- > 0;) {
    const uint32_t *v = &mesh->triangles[3 * t];
    if (!is_proper(v))
      continue;
    for (unsigned k = 3; k-- > 0;)
      if (in_range(c, v[k]))
        c->corners[--c->first[v[k] - c->lo + 1]] = (uint32_t)(3 * t + k);
  }
  /* Now first[i + 1] is where the list of i begins. */
  const uint32_t all = n ? c->first[n] + counts[n - 1] : 0;
  memmove(c->first, c->first + 1, n * sizeof *c->first);
  c->first[n] = all;
}

static int compare_spokes(const void *a, const void *b)
{
  const spoke *p = a, *q = b;
  return (p->end > q->end) - (p->end < q->end);
}

/* Few at most vertices. */
static void sort_spokes(spoke *spokes, size_t n)
{
  enum { FEW = 32 };
  if (n > FEW) {
    qsort(spokes, n, sizeof *spokes, compare_spokes);
    return;
  }
  for (size_t i = 1; i < n; i++) {
    const spoke moving = spokes[i];
    size_t j = i;
    for (; j > 0 && spokes[j - 1].end > moving.end; j--)
      spokes[j] = spokes[j - 1];
    spokes[j] = moving;
  }
}

/* ---- Edges and vertices ---------------------------------------------------------- */

/* An edge of `n` triangles, seen from one of its ends. */
static void visit_edge(checker *c, uint32_t vertex, const spoke *spokes, size_t n,
                       zs_mesh_report *report)
{
  size_t outward = 0;
  for (size_t i = 0; i < n; i++)
    outward += spokes[i].outward;
  const size_t inward = n - outward;
  for (size_t i = 1; i < n; i++) /* its triangles are neighbours around the vertex */
    unite(c->fan, spokes[0].corner, spokes[i].corner);
  if (vertex > spokes[0].end)
    return; /* its lower end reports it */
  c->edges++;
  report->boundary_edges += n == 1;
  report->nonmanifold_edges += n > 2;
  if (outward > inward + 1 || inward > outward + 1)
    report->oriented = false;
  unite(c->piece, vertex, spokes[0].end);
}

/* False when memory is out. */
static bool make_room(checker *c, size_t corners)
{
  if (corners <= c->most)
    return true;
  free(c->spokes);
  free(c->fan);
  c->most = 2 * corners;
  c->spokes = malloc(2 * c->most * sizeof *c->spokes);
  c->fan = malloc(c->most * sizeof *c->fan);
  return c->spokes && c->fan;
}

static bool visit_vertex(checker *c, uint32_t vertex, zs_mesh_report *report)
{
  const uint32_t *triangles = c->mesh->triangles;
  const uint32_t *list = c->corners + c->first[vertex - c->lo];
  const uint32_t n = c->first[vertex - c->lo + 1] - c->first[vertex - c->lo];
  if (!n)
    return true;
  if (!make_room(c, n))
    return false;
  for (uint32_t i = 0; i < n; i++) {
    const uint32_t after = next_corner(list[i]);
    c->spokes[2 * i] = (spoke){triangles[after], i, true};
    c->spokes[2 * i + 1] = (spoke){triangles[next_corner(after)], i, false};
    c->fan[i] = i;
  }
  sort_spokes(c->spokes, 2 * (size_t)n);
  for (size_t i = 0, same; i < 2 * (size_t)n; i += same) {
    for (same = 1; i + same < 2 * (size_t)n && c->spokes[i + same].end == c->spokes[i].end; same++)
      ;
    visit_edge(c, vertex, c->spokes + i, same, report);
  }
  uint32_t fans = 0;
  for (uint32_t i = 0; i < n; i++)
    fans += c->fan[i] == i;
  c->used++;
  report->nonmanifold_vertices += fans > 1;
  return true;
}

/* All vertices, range by range.  False when memory is out. */
static bool visit_vertices(checker *c, const uint32_t *counts, zs_mesh_report *report)
{
  const uint32_t all = (uint32_t)c->mesh->vertex_count;
  for (c->lo = 0; c->lo < all; c->lo = c->hi) {
    uint64_t corners = 0;
    for (c->hi = c->lo; c->hi < all && (c->hi == c->lo || corners < RANGE_CORNERS); c->hi++)
      corners += counts[c->hi];
    c->corners = malloc((corners + 1) * sizeof *c->corners);
    c->first = malloc(((size_t)c->hi - c->lo + 1) * sizeof *c->first);
    bool done = c->corners && c->first;
    if (done)
      list_corners(c, counts + c->lo);
    for (uint32_t v = c->lo; done && v < c->hi; v++)
      done = visit_vertex(c, v, report);
    free(c->corners);
    free(c->first);
    if (!done)
      return false;
  }
  for (uint32_t v = 0; v < all; v++)
    report->components += counts[v] && c->piece[v] == v;
  return true;
}

static void subtract(const float *a, const double b[3], double difference[3])
{
  for (int k = 0; k < 3; k++)
    difference[k] = a[k] - b[k];
}

/* Volume and area in double precision, about the first vertex so that meshes
 * far from the origin lose nothing. */
static void measure(const zs_mesh *mesh, double *volume, double *area)
{
  *volume = *area = 0;
  if (!mesh->triangle_count)
    return;
  const float *at = mesh->positions + 3 * (size_t)mesh->triangles[0];
  const double origin[3] = {at[0], at[1], at[2]};
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    double p[3][3], n[3];
    for (size_t k = 0; k < 3; k++)
      subtract(mesh->positions + 3 * (size_t)mesh->triangles[3 * t + k], origin, p[k]);
    for (int k = 0; k < 3; k++) {
      int i = (k + 1) % 3, j = (k + 2) % 3;
      n[k] = (p[1][i] - p[0][i]) * (p[2][j] - p[0][j]) - (p[1][j] - p[0][j]) * (p[2][i] - p[0][i]);
    }
    *area += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
    *volume += (p[0][0] * n[0] + p[0][1] * n[1] + p[0][2] * n[2]) / 6;
  }
}

static size_t count_proper(const zs_mesh *mesh)
{
  size_t proper = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++)
    proper += is_proper(&mesh->triangles[3 * t]);
  return proper;
}

/* Everything but the measures.  False when memory is out. */
static bool check_topology(const zs_mesh *mesh, zs_mesh_report *report)
{
  checker c = {.mesh = mesh};
  uint32_t *counts = calloc(mesh->vertex_count + 1, sizeof *counts);
  c.piece = malloc((mesh->vertex_count + 1) * sizeof *c.piece);
  bool done = counts && c.piece;
  if (done) {
    for (size_t v = 0; v < mesh->vertex_count; v++)
      c.piece[v] = (uint32_t)v;
    count_corners(mesh, counts);
    done = visit_vertices(&c, counts, report);
  }
  report->euler_characteristic =
    (int64_t)c.used - (int64_t)c.edges + (int64_t)count_proper(mesh);
  free(counts);
  free(c.piece);
  free(c.spokes);
  free(c.fan);
  return done;
}

bool zs_mesh_check(const zs_mesh *mesh, zs_mesh_report *report, zs_diag *diag)
{
  *report = (zs_mesh_report){.oriented = true};
  if (mesh->triangle_count > UINT32_MAX / 3 || mesh->vertex_count > UINT32_MAX)
    return zs_fail(diag, ZS_ERROR_UNABLE, NULL,
                   "the mesh has %zu vertices and %zu triangles; meshes of up to %u triangles "
                   "can be checked", mesh->vertex_count, mesh->triangle_count, UINT32_MAX / 3);
  if (!check_topology(mesh, report))
    return zs_fail_memory(diag);
  report->closed = report->boundary_edges == 0 && count_proper(mesh) > 0;
  report->manifold = report->nonmanifold_edges == 0 && report->nonmanifold_vertices == 0;
  measure(mesh, &report->volume, &report->area);
  if (!report->closed)
    report->volume = 0;
  return true;
}

bool zs_mesh_require_manifold(const zs_mesh *mesh, const char *purpose, zs_diag *diag)
{
  zs_mesh_report report;
  if (mesh->vertex_count > INT32_MAX || mesh->triangle_count > INT32_MAX / 3)
    return zs_fail(diag, ZS_ERROR_UNABLE, NULL,
                   "the mesh has %zu vertices and %zu triangles: too many to %s",
                   mesh->vertex_count, mesh->triangle_count, purpose);
  if (!zs_mesh_check(mesh, &report, diag))
    return false;
  size_t repeated = mesh->triangle_count - count_proper(mesh);
  if (report.manifold && report.oriented && !repeated)
    return true;
  return zs_fail(diag, ZS_ERROR_UNABLE, NULL,
                 "the mesh is no oriented manifold, which it has to be to %s: %zu edges and %zu "
                 "vertices are not manifold, %zu triangles have a repeated corner%s",
                 purpose, report.nonmanifold_edges, report.nonmanifold_vertices, repeated,
                 report.oriented ? "" : ", neighbours disagree on their outside");
}
