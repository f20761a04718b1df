/* Topology and measures of a mesh. */
#include "mesh/mesh.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A triangle has the half-edges 3t, 3t + 1, 3t + 2, each from the corner of the
 * same number to the next.  An entry stands for a half-edge in the list of its
 * edge's lower vertex. */
typedef struct entry {
  uint32_t higher;   /* the edge's other vertex */
  uint32_t halfedge;
} entry;

typedef struct checker {
  const zs_mesh *mesh;
  size_t *first;     /* by lower vertex: its entries begin here; one more */
  entry *entries;
  uint32_t *fan;     /* by corner: union-find of the corners around a vertex */
  uint32_t *piece;   /* by vertex: union-find of connected vertices */
  uint32_t *fans;    /* by vertex: how many fans of triangles it has */
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

/* ---- Edges ------------------------------------------------------------------ */

static void edge_of(const zs_mesh *mesh, uint32_t halfedge, uint32_t *lower, uint32_t *higher)
{
  uint32_t a = mesh->triangles[halfedge], b = mesh->triangles[next_corner(halfedge)];
  *lower = a < b ? a : b;
  *higher = a < b ? b : a;
}

/* Sort half-edges by their lower vertex (counting), into `entries`. */
static void collect_edges(checker *c, size_t proper)
{
  const zs_mesh *mesh = c->mesh;
  uint32_t lower, higher;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    if (!is_proper(&mesh->triangles[3 * t]))
      continue;
    for (unsigned k = 0; k < 3; k++) {
      edge_of(mesh, (uint32_t)(3 * t + k), &lower, &higher);
      c->first[lower + 1]++;
    }
  }
  for (size_t v = 0; v < mesh->vertex_count; v++)
    c->first[v + 1] += c->first[v];
  /* Filling from the back moves the ends of the lists to their beginnings. */
  for (size_t t = mesh->triangle_count; t-- > 0;) {
    if (!is_proper(&mesh->triangles[3 * t]))
      continue;
    for (unsigned k = 3; k-- > 0;) {
      uint32_t halfedge = (uint32_t)(3 * t + k);
      edge_of(mesh, halfedge, &lower, &higher);
      c->entries[--c->first[lower + 1]] = (entry){higher, halfedge};
    }
  }
  /* Now first[v + 1] is where the list of v begins. */
  memmove(c->first, c->first + 1, mesh->vertex_count * sizeof *c->first);
  c->first[mesh->vertex_count] = 3 * proper;
}

static int compare_entries(const void *a, const void *b)
{
  const entry *p = a, *q = b;
  if (p->higher != q->higher)
    return p->higher < q->higher ? -1 : 1;
  return (p->halfedge > q->halfedge) - (p->halfedge < q->halfedge);
}

/* Two triangles share an edge: join their corners at both of its ends. */
static void join_fans(checker *c, uint32_t p, uint32_t q)
{
  const uint32_t *vertices = c->mesh->triangles;
  if (vertices[p] == vertices[q]) {
    unite(c->fan, p, q);
    unite(c->fan, next_corner(p), next_corner(q));
  } else {
    unite(c->fan, p, next_corner(q));
    unite(c->fan, next_corner(p), q);
  }
}

/* One edge: `n` half-edges between the same vertices, the first one's lower
 * vertex being `lower`. */
static void visit_edge(checker *c, uint32_t lower, const entry *e, size_t n, zs_mesh_report *report)
{
  size_t upward = 0;
  for (size_t i = 0; i < n; i++)
    upward += c->mesh->triangles[e[i].halfedge] == lower;
  size_t downward = n - upward;
  if (n == 1)
    report->boundary_edges++;
  if (n > 2)
    report->nonmanifold_edges++;
  if (upward > downward + 1 || downward > upward + 1)
    report->oriented = false;
  for (size_t i = 1; i < n; i++)
    join_fans(c, e[0].halfedge, e[i].halfedge);
  unite(c->piece, lower, e[0].higher);
}

/* Every edge once; returns how many there are. */
static size_t visit_edges(checker *c, zs_mesh_report *report)
{
  size_t edges = 0;
  for (size_t v = 0; v < c->mesh->vertex_count; v++) {
    entry *list = c->entries + c->first[v];
    size_t n = c->first[v + 1] - c->first[v];
    qsort(list, n, sizeof *list, compare_entries);
    for (size_t i = 0, same; i < n; i += same) {
      for (same = 1; i + same < n && list[i + same].higher == list[i].higher; same++)
        ;
      visit_edge(c, (uint32_t)v, list + i, same, report);
      edges++;
    }
  }
  return edges;
}

/* ---- Vertices and measures --------------------------------------------------- */

/* Count fans and pieces once all edges are known. */
static void visit_vertices(checker *c, size_t edges, size_t triangles, zs_mesh_report *report)
{
  const zs_mesh *mesh = c->mesh;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    if (!is_proper(&mesh->triangles[3 * t]))
      continue;
    for (unsigned k = 0; k < 3; k++)
      if (c->fan[3 * t + k] == 3 * t + k)
        c->fans[mesh->triangles[3 * t + k]]++;
  }
  size_t used = 0;
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    if (!c->fans[v])
      continue;
    used++;
    report->nonmanifold_vertices += c->fans[v] > 1;
    report->components += c->piece[v] == v;
  }
  report->euler_characteristic = (int64_t)used - (int64_t)edges + (int64_t)triangles;
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

static bool allocate(checker *c, size_t proper)
{
  size_t vertices = c->mesh->vertex_count, corners = 3 * c->mesh->triangle_count;
  c->first = calloc(vertices + 1, sizeof *c->first);
  c->entries = malloc((3 * proper + 1) * sizeof *c->entries);
  c->fan = malloc((corners + 1) * sizeof *c->fan);
  c->piece = malloc((vertices + 1) * sizeof *c->piece);
  c->fans = calloc(vertices + 1, sizeof *c->fans);
  return c->first && c->entries && c->fan && c->piece && c->fans;
}

static void release(checker *c)
{
  free(c->first);
  free(c->entries);
  free(c->fan);
  free(c->piece);
  free(c->fans);
}

bool zs_mesh_check(const zs_mesh *mesh, zs_mesh_report *report, zs_diag *diag)
{
  *report = (zs_mesh_report){0};
  if (mesh->triangle_count > UINT32_MAX / 3)
    return zs_fail(diag, ZS_ERROR_UNABLE, NULL,
                   "the mesh has %zu triangles; meshes of up to %u can be checked",
                   mesh->triangle_count, UINT32_MAX / 3);
  checker c = {.mesh = mesh};
  size_t proper = count_proper(mesh);
  if (!allocate(&c, proper)) {
    release(&c);
    return zs_fail_memory(diag);
  }
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
    c.fan[i] = (uint32_t)i;
  for (size_t v = 0; v < mesh->vertex_count; v++)
    c.piece[v] = (uint32_t)v;
  report->oriented = true;
  collect_edges(&c, proper);
  size_t edges = visit_edges(&c, report);
  visit_vertices(&c, edges, proper, report);
  release(&c);
  report->closed = proper > 0 && report->boundary_edges == 0;
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
