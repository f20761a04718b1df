/* The features method's vertices, made fewer where the surface is simple.
 *
 * The cells of a brick are taken together in cubes of twice, four, eight and sixteen times
 * their side.  A cube gets one vertex in the place of all of its own when their planes
 * agree on a place within it, up to the distance asked for, and when its surface is one
 * disc that leaves it in the simplest way: no edge of the cube is cut twice, no face by
 * more than one curve.  Two cubes, of whatever sizes, then meet in one curve at most, which
 * becomes one edge of the mesh, and the mesh stays a closed manifold.  (S. Schaefer, T. Ju,
 * J. Warren, "Manifold dual contouring", 2007.)
 *
 * Cells where edges of the mesh were turned keep their vertices, since what joins them is
 * no longer what their faces say; and so do cubes that hold a vertex of a cell elsewhere
 * (polygonize_features_claims.c), with which theirs could coincide.  Where a triangle
 * is folded, the cubes at its corners are divided again. */
#include "output/polygonize.h"
#include "output/quadric.h"

#include "base/array.h"
#include "base/diagnostic.h"
#include "base/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  MOST_PATCHES = ZS_BRICK_CORNERS * ZS_CELL_LOOPS,
  CUBE_EDGES = 12,
  SIZES = 4,                     /* of cubes: sides of 2, 4, 8 and 16 cells */
  CUBES = 8 * 8 * 8 + 4 * 4 * 4 + 2 * 2 * 2 + 1, /* of all sizes in a brick */
  CUBE_BYTES = (CUBES + 7) / 8   /* one bit each */
};

/* A cell that holds the vertex of another one. */
typedef struct guest {
  const zs_brick *brick;
  unsigned cell;
} guest;

/* The vertices of all patches. */
typedef struct collapsing {
  uint32_t *into;  /* by vertex: the one that stands for it, or itself */
  uint8_t *states; /* by vertex: the size of the cube that it stands for, from 1 on; 0: none */
  uint8_t *divided; /* by brick: which of its cubes are to have no vertex */
  float *places, *normals;
  guest *guests; /* by brick */
  size_t guest_count;
} collapsing;

/* Of places, in cells: a vertex this close to its cell is in it. */
static const double ROUNDING = 1e-3;

/* Added to the state when there is a folded triangle. */
enum { FOLDED = 8 };

/* One thread's working data. */
typedef struct collapser {
  zs_edge_numbers numbers;
  zs_brick_rows rows;
  uint16_t first[ZS_BRICK_CORNERS];  /* by cell: 1 + its first patch, or 0 */
  uint16_t parent[MOST_PATCHES];     /* by patch: another one that it is joined to */
  uint16_t list[MOST_PATCHES];       /* patches of a cube, ascending */
  size_t vertices[MOST_PATCHES * ZS_CELL_EDGES / ZS_CELL_LOOPS]; /* of their edges */
  unsigned count, vertex_count;
  bool simple[2][ZS_BRICK_CORNERS];  /* cubes that have one vertex or none, by size in turn */
} collapser;

/* What one brick is collapsed with. */
typedef struct collapse {
  const zs_polygonize_job *job;
  const zs_brick *brick;
  collapsing *all;
  uint8_t *divided;    /* of the brick */
  const guest *guests; /* of the brick */
  size_t guest_count;
  collapser *own;
  zs_frame frame;
  size_t offsets[ZS_CELL_EDGES];
} collapse;

/* Cells first <= i < first + side; side = 2^size. */
typedef struct cube {
  unsigned first[3], side, size;
} cube;

/* ---- The surface in a cube ------------------------------------------------------------ */

/* Signs of the corners along x of a cube's row y, z: side + 1 bits. */
static uint32_t row_signs(const collapse *s, const cube *c, unsigned y, unsigned z)
{
  return s->own->rows[c->first[2] + z][c->first[1] + y] >> c->first[0] & ((2u << c->side) - 1);
}

static unsigned corner_sign(const collapse *s, const cube *c, const unsigned at[3])
{
  return row_signs(s, c, at[1], at[2]) >> at[0] & 1;
}

/* Whether the surface cuts an edge of the cube more than once. */
static bool is_cut_again(const collapse *s, const cube *c, unsigned edge)
{
  const unsigned axis = edge / 4, start = zs_cell_edge_start(edge);
  unsigned at[3], changes = 0;
  for (unsigned k = 0; k < 3; k++)
    at[k] = (start >> k & 1) * c->side;
  unsigned before = corner_sign(s, c, at);
  while (at[axis] < c->side) {
    at[axis]++;
    const unsigned sign = corner_sign(s, c, at);
    changes += sign != before;
    before = sign;
  }
  return changes > 1;
}

/* The case of a cube as if it were a cell. */
static unsigned cube_case(const collapse *s, const cube *c)
{
  unsigned inside = 0;
  for (unsigned i = 0; i < 8; i++)
    inside |= corner_sign(s, c, (const unsigned[3]){(i & 1) * c->side, (i >> 1 & 1) * c->side,
                                                    (i >> 2) * c->side})
              << i;
  return inside;
}

/* Crossing edges less mixed faces of the cells of a cube: of a surface whose curves in
 * cell faces are the mixed faces, its vertices less its edges. */
static int vertices_less_edges(const collapse *s, const cube *c)
{
  const uint32_t corners = (2u << c->side) - 1, cells = corners >> 1;
  int sum = 0;
  for (unsigned z = 0; z <= c->side; z++)
    for (unsigned y = 0; y <= c->side; y++) {
      const uint32_t own = row_signs(s, c, y, z);
      const uint32_t right = y < c->side ? row_signs(s, c, y + 1, z) : 0;
      const uint32_t up = z < c->side ? row_signs(s, c, y, z + 1) : 0;
      sum += __builtin_popcount((own ^ own >> 1) & cells);
      if (y < c->side)
        sum += __builtin_popcount(own ^ right) -
               __builtin_popcount(((own ^ own >> 1) | (own ^ right) | (own ^ right >> 1)) & cells);
      if (z < c->side)
        sum += __builtin_popcount(own ^ up) -
               __builtin_popcount(((own ^ own >> 1) | (own ^ up) | (own ^ up >> 1)) & cells);
      if (y < c->side && z < c->side) {
        const uint32_t across = row_signs(s, c, y + 1, z + 1);
        sum -= __builtin_popcount((own ^ right) | (own ^ up) | (own ^ across));
      }
    }
  return sum;
}

/* ---- Patches of a cube ------------------------------------------------------------------ */

/* List the patches of a cube; false when there are none. */
static bool list_patches(const collapse *s, const cube *c)
{
  const zs_brick *brick = s->brick;
  collapser *own = s->own;
  own->count = 0;
  for (unsigned z = 0; z < c->side; z++)
    for (unsigned y = 0; y < c->side; y++) {
      const unsigned row = (c->first[2] + z) * ZS_BRICK + c->first[1] + y;
      const unsigned from = row * ZS_BRICK + c->first[0];
      for (unsigned i = brick->patch_rows[row]; i < brick->patch_rows[row + 1]; i++)
        if (brick->patches[i].cell >= from && brick->patches[i].cell < from + c->side)
          own->list[own->count++] = (uint16_t)i;
    }
  return own->count > 0;
}

static uint16_t root_of(collapser *own, uint16_t patch)
{
  while (own->parent[patch] != patch)
    patch = own->parent[patch] = own->parent[own->parent[patch]];
  return patch;
}

/* The edges of a cell that lie on its upper side across an axis, and on the lower one. */
static unsigned side_edges(unsigned axis, bool upper)
{
  unsigned edges = 0;
  for (unsigned e = 0; e < ZS_CELL_EDGES; e++)
    if (e / 4 != axis && (zs_cell_edge_start(e) >> axis & 1) == upper)
      edges |= 1u << e;
  return edges;
}

/* Join a patch to the one across the upper side of its cell, if its loop goes there and
 * the cell is in the cube. */
static void join_across(const collapse *s, const cube *c, unsigned patch, unsigned axis)
{
  const zs_brick *brick = s->brick;
  const unsigned cell = brick->patches[patch].cell;
  if (!(brick->patches[patch].edges & side_edges(axis, true)) ||
      (cell >> 4 * axis & (ZS_BRICK - 1)) + 1 == c->first[axis] + c->side)
    return;
  const unsigned next = cell + (1u << 4 * axis), below = side_edges(axis, false);
  for (unsigned i = s->own->first[next]; i && i <= brick->patch_count; i++) {
    if (brick->patches[i - 1].cell != next)
      return;
    if (brick->patches[i - 1].edges & below)
      s->own->parent[root_of(s->own, (uint16_t)(i - 1))] = root_of(s->own, (uint16_t)patch);
  }
}

/* Whether the surface of a cube is one disc; its cells have no faces with four
 * crossings. */
static bool is_disc(const collapse *s, const cube *c)
{
  collapser *own = s->own;
  unsigned parts = 0;
  if (vertices_less_edges(s, c) + (int)own->count != 1)
    return false;
  for (unsigned i = 0; i < own->count; i++)
    own->parent[own->list[i]] = own->list[i];
  for (unsigned i = 0; i < own->count; i++)
    for (unsigned axis = 0; axis < 3; axis++)
      join_across(s, c, own->list[i], axis);
  for (unsigned i = 0; i < own->count; i++)
    parts += own->parent[own->list[i]] == own->list[i];
  return parts == 1;
}

/* Whether a cube may have one vertex, for all that is known of signs. */
static bool is_simple(const collapse *s, const zs_loop_table *table, const cube *c)
{
  const unsigned inside = cube_case(s, c);
  if (table->loops[inside].count != 1 || table->crowded[inside])
    return false;
  for (unsigned edge = 0; edge < CUBE_EDGES; edge++)
    if (is_cut_again(s, c, edge))
      return false;
  return is_disc(s, c);
}

/* ---- The vertex of a cube --------------------------------------------------------------- */

/* Where the vertex of a crossing edge is in the arrays of the first stages' mesh. */
static size_t edge_vertex(const collapse *s, unsigned cell, unsigned edge)
{
  const uint32_t *numbers =
    s->own->numbers + zs_reach_offset(cell & 15, cell >> 4 & 15, cell >> 8);
  return 3 * (size_t)numbers[s->offsets[edge]];
}

/* List the vertices of the crossing edges of the patches listed. */
static void list_vertices(const collapse *s)
{
  collapser *own = s->own;
  own->vertex_count = 0;
  for (unsigned i = 0; i < own->count; i++) {
    const zs_patch *patch = &s->brick->patches[own->list[i]];
    for (unsigned edges = patch->edges; edges; edges &= edges - 1)
      own->vertices[own->vertex_count++] =
        edge_vertex(s, patch->cell, (unsigned)__builtin_ctz(edges));
  }
}

static double distance_of(const zs_mesh *mesh, size_t vertex, const double place[3])
{
  double distance = 0;
  for (unsigned k = 0; k < 3; k++)
    distance += mesh->normals[vertex + k] * (place[k] - mesh->positions[vertex + k]);
  return distance;
}

/* The middle of the vertices listed, and the direction that their normals have in the
 * mean: false when they have none. */
static bool find_middle(const collapse *s, double middle[3], double normal[3])
{
  const collapser *own = s->own;
  const zs_mesh *mesh = s->job->mesh;
  memset(middle, 0, 3 * sizeof *middle);
  memset(normal, 0, 3 * sizeof *normal);
  for (unsigned i = 0; i < own->vertex_count; i++)
    for (unsigned k = 0; k < 3; k++) {
      middle[k] += mesh->positions[own->vertices[i] + k] / (double)own->vertex_count;
      normal[k] += mesh->normals[own->vertices[i] + k];
    }
  const double length = hypot(hypot(normal[0], normal[1]), normal[2]);
  for (int k = 0; k < 3; k++)
    normal[k] /= length;
  return length > 0;
}

/* The place in a cube where the planes of its crossing edges meet best.  False when one
 * of them is farther than the distance allowed. */
static bool find_place(const collapse *s, const cube *c, const double middle[3], double place[3])
{
  const collapser *own = s->own;
  const zs_mesh *mesh = s->job->mesh;
  zs_quadric planes = {{{0}}, {0}};
  double lo[3], hi[3], farthest = 0;
  for (int k = 0; k < 3; k++) {
    const double side = s->job->cell[k], margin = fmin(s->job->apart, side / 4);
    const double corner = s->frame.origin[k] + side * ((int)c->first[k] - ZS_BRICK / 2);
    lo[k] = corner + margin - middle[k];
    hi[k] = corner + side * c->side - margin - middle[k];
  }
  for (unsigned i = 0; i < own->vertex_count; i++)
    zs_quadric_add(&planes, mesh->normals + own->vertices[i],
                   -distance_of(mesh, own->vertices[i], middle));
  zs_quadric_minimize(&planes, lo, hi, place);
  for (int k = 0; k < 3; k++)
    place[k] += middle[k];
  for (unsigned i = 0; i < own->vertex_count; i++)
    farthest = fmax(farthest, fabs(distance_of(mesh, own->vertices[i], place)));
  return farthest <= s->job->collapse;
}

/* Let the first patch of a cube stand for all. */
static void merge(const collapse *s, const cube *c, const double place[3],
                  const double normal[3])
{
  const size_t first = s->brick->first_patch, stands = first + s->own->list[0];
  for (unsigned i = 0; i < s->own->count; i++)
    s->all->into[first + s->own->list[i]] = (uint32_t)stands;
  for (size_t k = 0; k < 3; k++) {
    s->all->places[3 * stands + k] = (float)place[k];
    s->all->normals[3 * stands + k] = (float)normal[k];
  }
  s->all->states[stands] = (uint8_t)c->size;
}

static bool has_guest(const collapse *s, const cube *c)
{
  bool has = false;
  for (size_t i = 0; i < s->guest_count && !has; i++) {
    has = true;
    for (unsigned k = 0; k < 3; k++)
      has = has && (s->guests[i].cell >> 4 * k & (ZS_BRICK - 1)) - c->first[k] < c->side;
  }
  return has;
}

static bool collapse_cube(const collapse *s, const zs_loop_table *table, const cube *c)
{
  double middle[3], place[3], normal[3];
  if (has_guest(s, c) || !is_simple(s, table, c))
    return false;
  list_vertices(s);
  if (!find_middle(s, middle, normal) || !find_place(s, c, middle, place))
    return false;
  merge(s, c, place, normal);
  return true;
}

/* ---- Bricks ------------------------------------------------------------------------------ */

/* Whether a cell may be part of a cube. */
static bool is_plain(const collapse *s, const zs_loop_table *table, unsigned cell)
{
  const unsigned x = cell & 15, y = cell >> 4 & 15, z = cell >> 8;
  if (!s->own->first[cell])
    return true;
  if (table->crowded[zs_brick_cell_case((const uint32_t(*)[ZS_REACH])s->own->rows, x, y, z)] ||
      (s->brick->at_face && zs_brick_is_pad_cell(s->job, s->brick, x, y, z)))
    return false;
  bool plain = true;
  for (unsigned i = s->own->first[cell] - 1u;
       i < s->brick->patch_count && s->brick->patches[i].cell == cell; i++)
    plain = plain && !s->brick->patches[i].turned;
  return plain;
}

/* The number of the cube of a size that holds a cell, among those of all sizes. */
static unsigned cube_number(unsigned size, const unsigned cell[3])
{
  unsigned before = 0, n = ZS_BRICK / 2;
  for (unsigned i = 1; i < size; i++, n /= 2)
    before += n * n * n;
  return before + ((cell[2] >> size) * n + (cell[1] >> size)) * n + (cell[0] >> size);
}

/* Collapse the cubes of one size whose eighths are simple. */
static void collapse_size(const collapse *s, const zs_loop_table *table, unsigned size,
                          const bool *eighths, bool *simple)
{
  const unsigned side = 1u << size, n = ZS_BRICK >> size;
  for (unsigned i = 0; i < n * n * n; i++) {
    const unsigned at[3] = {i % n, i / n % n, i / (n * n)};
    const cube c = {{at[0] * side, at[1] * side, at[2] * side}, side, size};
    const unsigned number = cube_number(size, c.first);
    simple[i] = !(s->divided[number / 8] >> number % 8 & 1);
    for (unsigned e = 0; e < 8; e++)
      simple[i] = simple[i] && eighths[((2 * at[2] + (e >> 2)) * 2 * n + 2 * at[1] + (e >> 1 & 1)) *
                                         2 * n + 2 * at[0] + (e & 1)];
    if (simple[i] && list_patches(s, &c))
      simple[i] = collapse_cube(s, table, &c);
  }
}

static void collapse_brick(const collapse *s, const zs_loop_table *table)
{
  collapser *own = s->own;
  zs_brick_gather_signs(s->job, s->brick, own->rows);
  zs_brick_number_edges(s->job, s->brick, own->numbers);
  memset(own->first, 0, sizeof own->first);
  for (uint32_t p = s->brick->patch_count; p-- > 0;)
    own->first[s->brick->patches[p].cell] = (uint16_t)(p + 1);
  for (unsigned cell = 0; cell < ZS_BRICK_CORNERS; cell++)
    own->simple[0][cell] = is_plain(s, table, cell);
  for (unsigned size = 1; size <= SIZES; size++)
    collapse_size(s, table, size, own->simple[(size - 1) % 2], own->simple[size % 2]);
}

/* Note which cubes have folded triangles, and make all vertices of the brick what they
 * were.  False when there are none. */
static bool divide_folded(const collapse *s)
{
  const zs_mesh *mesh = s->job->dual;
  const size_t first = s->brick->first_patch, count = s->brick->patch_count;
  collapsing *all = s->all;
  bool any = false;
  for (size_t p = 0; p < count; p++) {
    const unsigned cell = s->brick->patches[p].cell;
    const unsigned at[3] = {cell & 15, cell >> 4 & 15, cell >> 8};
    if (!(all->states[first + p] & FOLDED))
      continue;
    const unsigned number = cube_number(all->states[first + p] & ~FOLDED, at);
    s->divided[number / 8] |= (uint8_t)(1u << number % 8);
    any = true;
  }
  for (size_t v = first; any && v < first + count; v++) {
    all->into[v] = (uint32_t)v;
    all->states[v] = 0;
    memcpy(all->places + 3 * v, mesh->positions + 3 * v, 3 * sizeof *all->places);
    memcpy(all->normals + 3 * v, mesh->normals + 3 * v, 3 * sizeof *all->normals);
  }
  return any;
}

/* ---- Guests -------------------------------------------------------------------------------- */

/* Where a vertex is, when that is not the cell of its patch; it is never at a pad. */
static bool find_guest(const zs_polygonize_job *job, const zs_brick *brick, uint32_t patch,
                       guest *found)
{
  const float *place = job->dual->positions + 3 * (brick->first_patch + patch);
  uint32_t index[3];
  unsigned number = 0;
  bool home = true;
  for (int k = 2; k >= 0; k--) {
    const double cells = (place[k] - job->lo[k]) / job->cell[k];
    const unsigned own = brick->patches[patch].cell >> 4 * k & (ZS_BRICK - 1);
    const double part = cells + 1 - zs_lattice_index(brick, k, own);
    const uint32_t at = cells > 0 ? (uint32_t)cells + 1 : 0;
    home = home && part > -ROUNDING && part < 1 + ROUNDING;
    index[k] = at / ZS_BRICK;
    number = number * ZS_BRICK + at % ZS_BRICK;
  }
  *found = (guest){zs_lattice_brick(job, index), number};
  return !home;
}

static int compare_guests(const void *a, const void *b)
{
  const guest *p = a, *q = b;
  return ((uintptr_t)p->brick > (uintptr_t)q->brick) - ((uintptr_t)p->brick < (uintptr_t)q->brick);
}

/* List all guests.  False when memory is out. */
static bool list_guests(const zs_polygonize_job *job, collapsing *all)
{
  size_t capacity = 0;
  for (size_t i = 0; i < job->active_count; i++)
    for (uint32_t p = 0; p < job->active[i]->patch_count; p++) {
      guest found;
      if (!job->active[i]->patches[p].sharp || !find_guest(job, job->active[i], p, &found))
        continue;
      guest *guests =
        zs_array_grown(all->guests, all->guest_count + 1, &capacity, sizeof *guests);
      if (!guests)
        return false;
      all->guests = guests;
      guests[all->guest_count++] = found;
    }
  if (all->guest_count)
    qsort(all->guests, all->guest_count, sizeof *all->guests, compare_guests);
  return true;
}

/* Those of a brick. */
static void find_guests(collapse *s)
{
  const collapsing *all = s->all;
  size_t lo = 0, hi = all->guest_count;
  while (lo < hi) {
    const size_t middle = lo + (hi - lo) / 2;
    if ((uintptr_t)all->guests[middle].brick < (uintptr_t)s->brick)
      lo = middle + 1;
    else
      hi = middle;
  }
  s->guests = all->guests + lo;
  while (lo + s->guest_count < all->guest_count &&
         all->guests[lo + s->guest_count].brick == s->brick)
    s->guest_count++;
}

/* ---- All bricks ---------------------------------------------------------------------------- */

/* Collapse all bricks, or again those with folded triangles. */
static bool collapse_bricks(zs_polygonize_job *job, collapsing *all, bool again)
{
  zs_loop_table table;
  collapser *scratch = malloc(job->threads * sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
  zs_loop_table_make(&table);
#pragma omp parallel for schedule(dynamic, 4) num_threads(job->threads)
  for (size_t i = 0; i < job->active_count; i++) {
    collapse s = {.job = job,
                  .brick = job->active[i],
                  .all = all,
                  .divided = all->divided + i * CUBE_BYTES,
                  .own = &scratch[zs_thread_number()],
                  .frame = zs_brick_frame(job, job->active[i])};
    if (!s.brick->patch_count || (again && !divide_folded(&s)))
      continue;
    zs_cell_edge_offsets(s.offsets);
    find_guests(&s);
    collapse_brick(&s, &table);
  }
  free(scratch);
  return true;
}

/* ---- The mesh ----------------------------------------------------------------------------- */

static bool is_degenerate(const uint32_t corners[3])
{
  return corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0];
}

static void find_corners(const collapsing *all, const uint32_t *triangle, uint32_t corners[3])
{
  for (int k = 0; k < 3; k++)
    corners[k] = all->into[triangle[k]];
}

/* Whether a triangle turns its back on the normal at one of its corners. */
static bool is_folded(const collapsing *all, const uint32_t corners[3])
{
  const float *p = all->places + 3 * (size_t)corners[0], *q = all->places + 3 * (size_t)corners[1],
              *r = all->places + 3 * (size_t)corners[2];
  double n[3];
  for (int k = 0; k < 3; k++) {
    const int u = (k + 1) % 3, v = (k + 2) % 3;
    n[k] = (double)(q[u] - p[u]) * (r[v] - p[v]) - (double)(q[v] - p[v]) * (r[u] - p[u]);
  }
  bool folded = false;
  for (int i = 0; i < 3; i++) {
    const float *m = all->normals + 3 * (size_t)corners[i];
    folded = folded || n[0] * m[0] + n[1] * m[1] + n[2] * m[2] < 0;
  }
  return folded;
}

/* Mark the vertices of cubes at the corners of folded triangles; says whether there are
 * any. */
static bool mark_folded(const zs_polygonize_job *job, collapsing *all)
{
  const zs_mesh *mesh = job->dual;
  bool any = false;
#pragma omp parallel for schedule(static) num_threads(job->threads) reduction(|| : any)
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    uint32_t corners[3];
    find_corners(all, mesh->triangles + 3 * t, corners);
    if (is_degenerate(corners) || !is_folded(all, corners))
      continue;
    for (int k = 0; k < 3; k++) {
      uint8_t *state = &all->states[corners[k]], before;
#pragma omp atomic read
      before = *state;
      if (!before)
        continue;
      any = true;
#pragma omp atomic
      *state |= FOLDED;
    }
  }
  return any;
}

/* Leave out the vertices that others stand for, and the triangles between those of one
 * cube. */
static bool compact(const zs_polygonize_job *job, collapsing *all)
{
  zs_mesh *mesh = job->dual;
  size_t vertices = 0, triangles = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    uint32_t corners[3];
    find_corners(all, mesh->triangles + 3 * t, corners);
    if (!is_degenerate(corners))
      memcpy(mesh->triangles + 3 * triangles++, corners, sizeof corners);
  }
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    if (all->into[v] != v)
      continue;
    memcpy(mesh->positions + 3 * vertices, all->places + 3 * v, 3 * sizeof *all->places);
    memcpy(mesh->normals + 3 * vertices, all->normals + 3 * v, 3 * sizeof *all->normals);
    all->into[v] = (uint32_t)vertices++;
  }
  for (size_t i = 0; i < 3 * triangles; i++)
    mesh->triangles[i] = all->into[mesh->triangles[i]];
  return zs_mesh_resize(mesh, vertices, triangles, job->diag);
}

static bool allocate(const zs_polygonize_job *job, collapsing *all)
{
  const zs_mesh *mesh = job->dual;
  const size_t count = mesh->vertex_count, bytes = 3 * count * sizeof(float);
  all->into = malloc((count + 1) * sizeof *all->into);
  all->states = calloc(count + 1, sizeof *all->states);
  all->divided = calloc(job->active_count, CUBE_BYTES);
  all->places = malloc(bytes + 1);
  all->normals = malloc(bytes + 1);
  if (!all->into || !all->states || !all->divided || !all->places || !all->normals)
    return false;
  for (size_t v = 0; v < count; v++)
    all->into[v] = (uint32_t)v;
  memcpy(all->places, mesh->positions, bytes);
  memcpy(all->normals, mesh->normals, bytes);
  return true;
}

bool zs_polygonize_collapse(zs_polygonize_job *job)
{
  collapsing all = {0};
  bool done = (allocate(job, &all) && list_guests(job, &all)) || zs_fail_memory(job->diag);
  done = done && collapse_bricks(job, &all, false);
  while (done && mark_folded(job, &all))
    done = collapse_bricks(job, &all, true);
  done = done && compact(job, &all);
  free(all.into);
  free(all.states);
  free(all.divided);
  free(all.guests);
  free(all.places);
  free(all.normals);
  return done;
}
