/* The features method: topology whatever the field, sharp edges, no folds. */
#include "meshes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double PI = 3.14159265358979323846;

static const char SPHERE[] = "0.8 - sqrt(x*x + y*y + z*z)";
static const char BOX[] = "min(min(0.7 - abs(x), 0.6 - abs(y)), 0.5 - abs(z))";

/* Solids with sharp edges in coordinates p, q, r turned against the lattice. */
#define TURNED                                                                                    \
  "let c = cos(0.4); let s = sin(0.4); let u = c*x + s*y; let q = c*y - s*x;"                     \
  "let p = c*u + s*z; let r = c*z - s*u;"
static const char CUBE[] = TURNED "min(min(0.6 - abs(p), 0.6 - abs(q)), 0.6 - abs(r))";
static const char CYLINDER[] = TURNED "min(0.6 - hypot(p, q), 0.7 - abs(r))";
/* A cube less a ball, and less two round bars that meet in it. */
static const char DIFFERENCE[] =
  TURNED "min(min(min(min(0.6 - abs(p), 0.6 - abs(q)), 0.6 - abs(r)),"
         "hypot(hypot(p - 0.6, q - 0.6), r - 0.6) - 0.5),"
         "min(hypot(p, q) - 0.25, hypot(q, r) - 0.2))";
/* Two levels of holes, all edges along the axes. */
static const char MENGER[] =
  "let k = 3; let a = 0.9; let t = 0.3; let w = 0.1;"
  "let u = abs(abs(x) - 0.6); let v = abs(abs(y) - 0.6); let h = abs(abs(z) - 0.6);"
  "let bu = min(abs(x), u); let bv = min(abs(y), v); let bh = min(abs(z), h);"
  "let box = min(min(a - abs(x), a - abs(y)), a - abs(z));"
  "let one = max(max(min(t - abs(x), t - abs(y)), min(t - abs(y), t - abs(z))),"
  "              min(t - abs(z), t - abs(x)));"
  "let two = max(max(min(w - bu, w - bv), min(w - bv, w - bh)), min(w - bh, w - bu));"
  "min(box, min(-one, -two))";

static zs_mesh *polygonize(const char *formula, const zs_grid *grid, bool cap, unsigned threads)
{
  return mesh_formula(formula, grid, ZS_MESH_FEATURES, cap, threads, false, NULL);
}

/* ---- Topology ------------------------------------------------------------------ */

/* Whatever the field and wherever the grid cuts it, through faces, edges and
 * corners: sound, and still so when coinciding vertices are welded. */
static void every_mesh_is_a_closed_manifold(void **state)
{
  (void)state;
  static const char *const formulas[] = {SPHERE, BOX, CUBE, DIFFERENCE, MENGER, NOISE, "x",
                                         "0.3 - abs(z)", "x + y - 0.1", "x*y*z",
                                         "sin(9*x)*sin(9*y)*sin(9*z)", "1 + x*x",
                                         "x < 0.123 ? 1 : -1"};
  static const double boxes[][2] = {{-1, 1}, {-0.63, 0.71}, {-0.5, 0.5}, {-0.9, 0.1}};
  for (size_t i = 0; i < sizeof formulas / sizeof *formulas; i++)
    for (size_t b = 0; b < sizeof boxes / sizeof *boxes; b++)
      assert_sound_in(formulas[i], ZS_MESH_FEATURES, boxes[b], 22);
}

static void grids_of_any_shape_are_sound(void **state)
{
  (void)state;
  assert_noise_is_sound(ZS_MESH_FEATURES);
}

/* Without caps only the box's faces bound the surface. */
static void open_meshes_end_at_the_box(void **state)
{
  (void)state;
  zs_grid grid = cube_grid(-0.5, 0.5, 24);
  zs_mesh *mesh = polygonize(NOISE, &grid, false, 2);
  assert_non_null(mesh);
  zs_mesh_report report = check_mesh(mesh);
  assert_false(report.closed);
  assert_true(report.manifold);
  assert_true(report.oriented);
  assert_distinct(mesh);
  zs_mesh_free(mesh);
  /* Of a plane all is there: to the box's faces. */
  mesh = polygonize("x + 0.1*y - 0.05*z - 0.03", &grid, false, 2);
  assert_non_null(mesh);
  report = check_mesh(mesh);
  assert_true(report.manifold && report.oriented && report.boundary_edges > 0);
  assert_int_equal(report.euler_characteristic, 1);
  assert_true(fabs(report.area - sqrt(1 + 0.01 + 0.0025)) < 1e-5);
  zs_mesh_free(mesh);
  grid = cube_grid(-1, 1, 24);
  mesh = polygonize(SPHERE, &grid, false, 2);
  assert_sound(mesh);
  zs_mesh_free(mesh);
}

static void meshes_are_the_same_however_they_are_made(void **state)
{
  (void)state;
  static const char *const formulas[] = {SPHERE, CYLINDER, DIFFERENCE, NOISE};
  for (size_t i = 0; i < sizeof formulas / sizeof *formulas; i++)
    assert_same_however_made(formulas[i], ZS_MESH_FEATURES, 53);
}

/* ---- Places ---------------------------------------------------------------------- */

/* Whether f changes its sign within a distance of a vertex along its normal. */
static bool is_on_surface(zs_eval *eval, const zs_mesh *mesh, size_t vertex, double distance)
{
  double inner[3], outer[3];
  for (size_t k = 0; k < 3; k++) {
    inner[k] = mesh->positions[3 * vertex + k] - distance * mesh->normals[3 * vertex + k];
    outer[k] = mesh->positions[3 * vertex + k] + distance * mesh->normals[3 * vertex + k];
  }
  return zs_eval_point(eval, inner) >= 0 && zs_eval_point(eval, outer) < 0;
}

/* The lattice lies so much aside of the grid, in cells. */
static const double ASIDE[3] = {0x1p-15, 0x1.6p-15, 0x1.4p-16};

/* Where in the lattice a place in the grid is, both in cells: the outermost half cells are
 * stretched so that faces are the grid's. */
static double in_lattice(double place, double count, int axis)
{
  const double stretch = 2 * ASIDE[axis];
  return place < 0.5           ? place / (1 + stretch)
         : place > count - 0.5 ? count - (count - place) / (1 - stretch)
                               : place - ASIDE[axis];
}

/* Every vertex lies strictly within a cell that holds surface: its corners have both
 * signs, or the vertex itself is where a sharp edge reaches in between them. */
static void vertices_stay_in_their_cells(void **state)
{
  (void)state;
  static const char *const formulas[] = {SPHERE, CUBE, CYLINDER, DIFFERENCE, NOISE};
  for (size_t i = 0; i < sizeof formulas / sizeof *formulas; i++) {
    zs_grid grid = cube_grid(-1.113, 1.109, 40);
    zs_mesh *mesh = polygonize(formulas[i], &grid, false, 2);
    zs_field *field = formula_field(formulas[i]);
    zs_eval *eval = zs_eval_new(field, NULL);
    assert_non_null(mesh);
    for (size_t v = 0; v < mesh->vertex_count; v++) {
      double corner[3], point[3];
      bool on_face = false;
      for (int k = 0; k < 3; k++) {
        double at = in_lattice((mesh->positions[3 * v + k] - grid.lo[k]) / grid.cell[k], 40, k);
        corner[k] = floor(at);
        on_face = on_face || at < 1e-5 || at > 40 - 1e-5;
        assert_true(on_face || (at - corner[k] > 1e-6 && at - corner[k] < 1 - 1e-6));
      }
      unsigned inside = 0;
      for (unsigned c = 0; c < 8; c++) {
        for (unsigned k = 0; k < 3; k++)
          point[k] = grid.lo[k] + grid.cell[k] * (corner[k] + ASIDE[k] + (c >> k & 1));
        inside += zs_eval_point(eval, point) >= 0;
      }
      assert_true(on_face || (inside > 0 && inside < 8) ||
                  is_on_surface(eval, mesh, v, 1e-3 * grid.cell[0]));
    }
    zs_eval_free(eval);
    zs_field_unref(field);
    zs_mesh_free(mesh);
  }
}

/* On smooth surfaces vertices lie on f = 0 to a millionth of the box, and of
 * hostile fields a sign change lies within that distance. */
static void vertices_are_certified_roots(void **state)
{
  (void)state;
  static const char *const formulas[] = {
    SPHERE, "0.64 - x*x - y*y - z*z", "(0.8 - sqrt(x*x + y*y + z*z))^3",
    "let d = 0.8 - sqrt(x*x + y*y + z*z); sign(d)*abs(d)^(1/3)",
    "0.8 - sqrt(x*x + y*y + z*z) < 0 ? -1 : 1",
    "let d = 0.8 - sqrt(x*x + y*y + z*z); d < 0 ? 1e-3*d : d",
    "(0.8 - sqrt(x*x + y*y + z*z)) * 1e30", "(0.8 - sqrt(x*x + y*y + z*z)) * 1e-30"};
  const double tolerance = 2e-6; /* 1e-6 of a box of side 2 */
  zs_grid grid = cube_grid(-1, 1, 40);
  for (size_t i = 0; i < sizeof formulas / sizeof *formulas; i++) {
    zs_mesh *mesh = polygonize(formulas[i], &grid, true, 2);
    assert_sound(mesh);
    assert_distinct(mesh);
    for (size_t v = 0; v < mesh->vertex_count; v++) {
      const float *p = mesh->positions + 3 * v;
      double r = sqrt((double)p[0] * p[0] + (double)p[1] * p[1] + (double)p[2] * p[2]);
      assert_true(fabs(r - 0.8) <= tolerance);
    }
    zs_mesh_free(mesh);
  }
}

/* The coordinates in which the turned solids are given: rows of a rotation. */
static void turned_axes(double axes[3][3])
{
  const double c = cos(0.4), s = sin(0.4);
  const double rows[3][3] = {{c * c, c * s, s}, {-s, c, 0}, {-s * c, -s * s, c}};
  memcpy(axes, rows, sizeof rows);
}

/* An edge of the turned cube, and what one cell has of it. */
typedef struct edge {
  double from[3], along[3]; /* in the grid's frame; to its other end */
} edge;

static edge cube_edge(unsigned number)
{
  double axes[3][3], at[3];
  const unsigned axis = number / 4;
  edge e;
  turned_axes(axes);
  at[axis] = -0.6;
  at[(axis + 1) % 3] = number & 1 ? 0.6 : -0.6;
  at[(axis + 2) % 3] = number & 2 ? 0.6 : -0.6;
  for (int k = 0; k < 3; k++) {
    e.from[k] = at[0] * axes[0][k] + at[1] * axes[1][k] + at[2] * axes[2][k];
    e.along[k] = 1.2 * axes[axis][k];
  }
  return e;
}

/* The part of the edge within a cell, of 1. */
static double part_within(const edge *e, const zs_grid *grid, const double cell[3])
{
  double from = 0, to = 1;
  for (int k = 0; k < 3; k++) {
    double a = (grid->lo[k] + cell[k] * grid->cell[k] - e->from[k]) / e->along[k];
    double b = a + grid->cell[k] / e->along[k];
    from = fmax(from, fmin(a, b));
    to = fmin(to, fmax(a, b));
  }
  return fmax(0, to - from);
}

/* From a point to the edge's line. */
static double line_distance(const edge *e, const float *p)
{
  double cross[3], square = 0, length = 0;
  for (int k = 0; k < 3; k++) {
    int i = (k + 1) % 3, j = (k + 2) % 3;
    cross[k] = (p[i] - e->from[i]) * e->along[j] - (p[j] - e->from[j]) * e->along[i];
    square += cross[k] * cross[k];
    length += e->along[k] * e->along[k];
  }
  return sqrt(square / length);
}

/* In every cell that one edge of a turned cube passes through, away from the
 * cube's corners, the vertex lies on the edge, to a thousandth of the cell; one in
 * a hundred may be off, where a corner of the cell says that nothing is there. */
static void edges_of_a_turned_cube_are_met(void **state)
{
  (void)state;
  for (uint32_t resolution = 20; resolution <= 80; resolution += 20) {
    zs_grid grid = cube_grid(-1.113, 1.109, resolution);
    zs_mesh *mesh = polygonize(CUBE, &grid, true, 2);
    unsigned passed = 0, off = 0;
    for (size_t v = 0; v < mesh->vertex_count; v++) {
      const float *p = mesh->positions + 3 * v;
      double cell[3];
      unsigned edges = 0, near = 0;
      for (int k = 0; k < 3; k++)
        cell[k] = floor((p[k] - grid.lo[k]) / grid.cell[k]);
      for (unsigned n = 0; n < 12; n++) {
        const edge e = cube_edge(n);
        const bool within = part_within(&e, &grid, cell) > 0.05 * grid.cell[0];
        edges += within;
        near += within && line_distance(&e, p) <= 1e-3 * grid.cell[0];
      }
      passed += edges == 1;
      off += edges == 1 && !near;
    }
    assert_true(passed > 4 * resolution);
    assert_true(off <= 1 + passed / 100);
    zs_mesh_report report = check_mesh(mesh);
    assert_int_equal(report.euler_characteristic, 2);
    assert_true(fabs(report.volume / 1.728 - 1) < 0.05 / resolution);
    assert_true(fabs(report.area / 8.64 - 1) < 0.15 / resolution);
    zs_mesh_free(mesh);
  }
}

/* ---- Sharp edges along their whole length ------------------------------------------- */

enum { CUBE_EDGES = 12 };

/* A cube of half a side `half`, turned and moved at random. */
typedef struct cube {
  double axes[3][3], at[3], half;
  double ends[CUBE_EDGES][2][3];
} cube;

static void find_ends(cube *c)
{
  for (unsigned n = 0; n < CUBE_EDGES; n++)
    for (unsigned end = 0; end < 2; end++) {
      double local[3];
      local[n / 4] = end ? c->half : -c->half;
      local[(n / 4 + 1) % 3] = n & 1 ? c->half : -c->half;
      local[(n / 4 + 2) % 3] = n & 2 ? c->half : -c->half;
      for (int k = 0; k < 3; k++)
        c->ends[n][end][k] = c->at[k] + local[0] * c->axes[0][k] + local[1] * c->axes[1][k] +
                             local[2] * c->axes[2][k];
    }
}

static void random_cube(uint64_t *seed, cube *c)
{
  double q[4], square;
  do {
    square = 0;
    for (int i = 0; i < 4; i++) {
      q[i] = random_between(seed, -1, 1);
      square += q[i] * q[i];
    }
  } while (square > 1 || square < 0.1);
  for (int i = 0; i < 3; i++) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    c->axes[i][i] = 1 - 2 * (q[j] * q[j] + q[k] * q[k]) / square;
    c->axes[i][j] = 2 * (q[i] * q[j] - q[k] * q[3]) / square;
    c->axes[i][k] = 2 * (q[i] * q[k] + q[j] * q[3]) / square;
    c->at[i] = random_between(seed, -0.02, 0.02);
  }
  c->half = 0.55;
  find_ends(c);
}

static zs_mesh *mesh_cube(const cube *c, const zs_grid *grid)
{
  char text[1024];
  int length = snprintf(text, sizeof text, "let u = x - (%.17g); let v = y - (%.17g); "
                        "let w = z - (%.17g);", c->at[0], c->at[1], c->at[2]);
  for (int i = 0; i < 3; i++)
    length += snprintf(text + length, sizeof text - (size_t)length,
                       "let %c = %.17g - abs((%.17g)*u + (%.17g)*v + (%.17g)*w);", "pqr"[i],
                       c->half, c->axes[i][0], c->axes[i][1], c->axes[i][2]);
  snprintf(text + length, sizeof text - (size_t)length, "min(p, min(q, r))");
  return polygonize(text, grid, true, 2);
}

/* From a point to the cube's surface. */
static double surface_distance(const cube *c, const double point[3])
{
  double outside = 0, most = -INFINITY;
  for (int i = 0; i < 3; i++) {
    double local = 0;
    for (int k = 0; k < 3; k++)
      local += c->axes[i][k] * (point[k] - c->at[k]);
    const double over = fabs(local) - c->half;
    most = fmax(most, over);
    outside += over > 0 ? over * over : 0;
  }
  return most > 0 ? sqrt(outside) : -most;
}

static double segment_distance(const double point[3], double ends[2][3])
{
  double along = 0, length = 0, square = 0;
  for (int k = 0; k < 3; k++) {
    along += (point[k] - ends[0][k]) * (ends[1][k] - ends[0][k]);
    length += (ends[1][k] - ends[0][k]) * (ends[1][k] - ends[0][k]);
  }
  const double part = length > 0 ? fmin(fmax(along / length, 0), 1) : 0;
  for (int k = 0; k < 3; k++) {
    const double step = ends[0][k] + part * (ends[1][k] - ends[0][k]) - point[k];
    square += step * step;
  }
  return sqrt(square);
}

static void unit_normal(const zs_mesh *mesh, size_t triangle, double n[3])
{
  const float *p[3];
  double square = 0;
  for (size_t c = 0; c < 3; c++)
    p[c] = mesh->positions + 3 * (size_t)mesh->triangles[3 * triangle + c];
  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    n[k] = ((double)p[1][i] - p[0][i]) * ((double)p[2][j] - p[0][j]) -
           ((double)p[1][j] - p[0][j]) * ((double)p[2][i] - p[0][i]);
    square += n[k] * n[k];
  }
  for (int k = 0; k < 3 && square > 0; k++)
    n[k] /= sqrt(square);
}

typedef struct half_edge {
  uint32_t least, most, triangle;
} half_edge;

static int compare_half_edges(const void *a, const void *b)
{
  const half_edge *p = a, *q = b;
  if (p->least != q->least)
    return p->least < q->least ? -1 : 1;
  return (p->most > q->most) - (p->most < q->most);
}

/* The mesh edges between triangles that differ by 30 degrees or more. */
static size_t sharp_mesh_edges(const zs_mesh *mesh, double (*edges)[2][3])
{
  const size_t count = 3 * mesh->triangle_count;
  size_t sharp = 0;
  half_edge *half = malloc(count * sizeof *half);
  assert_non_null(half);
  for (size_t h = 0; h < count; h++) {
    const uint32_t a = mesh->triangles[h], b = mesh->triangles[h % 3 == 2 ? h - 2 : h + 1];
    half[h] = (half_edge){a < b ? a : b, a < b ? b : a, (uint32_t)(h / 3)};
  }
  qsort(half, count, sizeof *half, compare_half_edges);
  for (size_t h = 0; h < count; h += 2) {
    double n[3], m[3];
    unit_normal(mesh, half[h].triangle, n);
    unit_normal(mesh, half[h + 1].triangle, m);
    if (n[0] * m[0] + n[1] * m[1] + n[2] * m[2] > cos(PI / 6))
      continue;
    for (int k = 0; k < 3; k++) {
      edges[sharp][0][k] = mesh->positions[3 * (size_t)half[h].least + k];
      edges[sharp][1][k] = mesh->positions[3 * (size_t)half[h].most + k];
    }
    sharp++;
  }
  free(half);
  return sharp;
}

/* How many of the points that cut segments into equal steps are farther than `most`
 * from all of some other segments. */
static size_t count_far(double (*from)[2][3], size_t from_count, unsigned steps,
                        double (*to)[2][3], size_t to_count, double most)
{
  size_t far = 0;
  for (size_t i = 0; i < from_count; i++)
    for (unsigned step = 0; step <= steps; step++) {
      double point[3], least = INFINITY;
      for (int k = 0; k < 3; k++)
        point[k] = from[i][0][k] + (from[i][1][k] - from[i][0][k]) * step / steps;
      for (size_t j = 0; j < to_count && least > most; j++)
        least = fmin(least, segment_distance(point, to[j]));
      far += least > most;
    }
  return far;
}

/* How many triangles have their middle, or that of a side, off the cube's surface. */
static size_t count_off(const zs_mesh *mesh, const cube *c, double most)
{
  size_t off = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    bool is_off = false;
    for (size_t i = 0; i < 4; i++) {
      double point[3] = {0};
      for (size_t j = 0; j < 3; j++)
        for (int k = 0; k < 3 && (i == 3 || i != j); k++)
          point[k] += mesh->positions[3 * (size_t)mesh->triangles[3 * t + j] + (size_t)k] /
                      (i == 3 ? 3.0 : 2.0);
      is_off = is_off || surface_distance(c, point) > most;
    }
    off += is_off;
  }
  return off;
}

/* The mesh of a cube turned at random has the cube's edges for its own, all along and
 * into the corners, and no others, and its triangles lie on the cube: to a thousandth
 * of a cell.  Where a corner of the lattice in a tip of the cube is cut off from the
 * others inside, the tip is another component of the mesh; and where the edge passes
 * through a cell whose corners tell of two sheets, they keep it apart: one cube in
 * twenty may have a spot of the one kind or the other. */
static void cubes_have_their_edges_along_all_their_length(void **state)
{
  (void)state;
  enum { CUBES = 60, STEPS = 120 };
  uint64_t seed = 2;
  unsigned flawed = 0;
  size_t far = 0;
  for (int i = 0; i < CUBES; i++) {
    cube c;
    random_cube(&seed, &c);
    const zs_grid grid = cube_grid(-1.013, 1.009, 12 + random_below(&seed, 36));
    const double most = 1e-3 * grid.cell[0];
    zs_mesh *mesh = mesh_cube(&c, &grid);
    assert_sound(mesh);
    double(*edges)[2][3] = malloc(3 * mesh->triangle_count * sizeof *edges);
    assert_non_null(edges);
    const size_t count = sharp_mesh_edges(mesh, edges);
    const size_t missed = count_far(c.ends, CUBE_EDGES, STEPS, edges, count, most);
    flawed += missed || count_far(edges, count, 4, c.ends, CUBE_EDGES, most) ||
              count_off(mesh, &c, most);
    far += missed;
    free(edges);
    zs_mesh_free(mesh);
  }
  assert_true(flawed <= CUBES / 20);
  assert_true(far <= (size_t)CUBES * CUBE_EDGES * STEPS / 1000);
}

/* So has a cube with two faces in planes of the grid, turned by an eighth about their axis. */
static void cubes_in_planes_of_the_grid_have_their_edges(void **state)
{
  (void)state;
  enum { STEPS = 240 };
  const double turn = sqrt(0.5);
  for (int axis = 0; axis < 3; axis++)
    for (uint32_t resolution = 16; resolution <= 64; resolution *= 2) {
      const int next = (axis + 1) % 3, last = (axis + 2) % 3;
      cube c = {.half = 0.5};
      c.axes[0][axis] = 1;
      c.axes[1][next] = c.axes[1][last] = c.axes[2][last] = turn;
      c.axes[2][next] = -turn;
      find_ends(&c);
      const zs_grid grid = cube_grid(-1, 1, resolution);
      zs_mesh *mesh = mesh_cube(&c, &grid);
      assert_sound(mesh);
      double(*edges)[2][3] = malloc(3 * mesh->triangle_count * sizeof *edges);
      assert_non_null(edges);
      const size_t count = sharp_mesh_edges(mesh, edges);
      assert_int_equal(count_far(c.ends, CUBE_EDGES, STEPS, edges, count, 1e-3 * grid.cell[0]), 0);
      free(edges);
      zs_mesh_free(mesh);
    }
}

/* Solids with faces in planes of the grid keep their vertices apart, and no triangle is folded. */
static void solids_in_planes_of_the_grid_are_sound(void **state)
{
  (void)state;
  static const char box[] = "min(min(0.5 - abs(x), 0.5 - abs(y)), 0.5 - abs(z))";
  static const char slotted[] =
    "let s = 0.125; let u = abs(x); let v = abs(y); let w = abs(z);"
    "min(min(min(0.5 - u, 0.5 - v), 0.5 - w), "
    "min(max(u - s, v - s), min(max(v - s, w - s), max(w - s, u - s))))";
  const char *const formulas[] = {box, slotted};
  for (int i = 0; i < 2; i++)
    for (uint32_t resolution = 8; resolution <= 64; resolution *= 2) {
      const zs_grid grid = cube_grid(-1, 1, resolution);
      zs_mesh *mesh = polygonize(formulas[i], &grid, true, 2);
      assert_sound(mesh);
      assert_distinct(mesh);
      for (size_t t = 0; t < mesh->triangle_count; t++)
        assert_true(sharpest_angle(mesh, t) > 1e-6);
      zs_mesh_free(mesh);
    }
}

/* With its edges where they belong, hardly more is left of a cube than its twelve
 * triangles when what is flat is collapsed: nothing moves by more than the error. */
static void flat_parts_collapse(void **state)
{
  (void)state;
  zs_grid grid = cube_grid(-1.113, 1.109, 60);
  zs_mesh *mesh = polygonize(CUBE, &grid, true, 2);
  assert_sound(mesh);
  assert_true(mesh->triangle_count > 10000);
  assert_true(zs_mesh_simplify(mesh, 1e-4, NULL, NULL));
  assert_sound(mesh);
  assert_true(mesh->triangle_count <= 24);
  zs_mesh_report report = check_mesh(mesh);
  assert_int_equal(report.euler_characteristic, 2);
  assert_true(fabs(report.volume / 1.728 - 1) < 1e-5);
  assert_true(fabs(report.area / 8.64 - 1) < 1e-5);
  zs_mesh_free(mesh);
}

/* The rims of a turned cylinder are sharp all around. */
static void rims_of_a_cylinder_are_sharp(void **state)
{
  (void)state;
  double axes[3][3];
  turned_axes(axes);
  zs_grid grid = cube_grid(-1.113, 1.109, 64);
  zs_mesh *mesh = polygonize(CYLINDER, &grid, true, 2);
  assert_sound(mesh);
  enum { SECTORS = 36 };
  unsigned on_rim[2][SECTORS] = {{0}};
  const double near = 0.01 * grid.cell[0];
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    double p[3] = {0};
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < 3; k++)
        p[i] += axes[i][k] * mesh->positions[3 * v + k];
    if (fabs(hypot(p[0], p[1]) - 0.6) > near || fabs(fabs(p[2]) - 0.7) > near)
      continue;
    on_rim[p[2] > 0][(unsigned)((atan2(p[1], p[0]) + PI) / (2 * PI) * SECTORS) % SECTORS]++;
  }
  for (unsigned i = 0; i < 2 * SECTORS; i++)
    assert_true(on_rim[i / SECTORS][i % SECTORS] > 0);
  zs_mesh_report report = check_mesh(mesh);
  assert_true(fabs(report.volume / (PI * 0.36 * 1.4) - 1) < 0.001);
  assert_true(fabs(report.area / (2 * PI * 0.36 + 2 * PI * 0.6 * 1.4) - 1) < 0.001);
  zs_mesh_free(mesh);
}

/* Solids along the axes are exact, at any resolution. */
static void boxes_along_the_axes_are_exact(void **state)
{
  (void)state;
  for (uint32_t resolution = 8; resolution <= 64; resolution *= 2) {
    zs_grid grid = cube_grid(-1.113, 1.109, resolution);
    zs_mesh *mesh = polygonize(BOX, &grid, true, 2);
    assert_sound(mesh);
    zs_mesh_report report = check_mesh(mesh);
    assert_true(fabs(report.volume / 1.68 - 1) < 1e-6);
    assert_true(fabs(report.area / 8.56 - 1) < 1e-6);
    zs_mesh_free(mesh);
  }
}

/* Far from the origin single precision has few digits left; the mesh is coarser
 * but as sound. */
static void places_far_from_the_origin_are_sound(void **state)
{
  (void)state;
  const double at[3] = {4000, -3000, 2000};
  zs_field *field = formula_field_at(DIFFERENCE, at);
  zs_grid grid = cube_grid(-1, 1, 40);
  zs_mesh_options options;
  zs_mesh_options_init(&options);
  options.method = ZS_MESH_FEATURES;
  for (int k = 0; k < 3; k++)
    grid.lo[k] += at[k];
  zs_mesh *mesh = zs_polygonize(field, &grid, &options, NULL, NULL, NULL);
  assert_sound(mesh);
  assert_distinct(mesh);
  zs_mesh_free(mesh);
  options.normals = false;
  zs_mesh *bare = zs_polygonize(field, &grid, &options, NULL, NULL, NULL);
  assert_sound(bare);
  assert_null(zs_mesh_normals(bare));
  zs_mesh_free(bare);
  zs_field_unref(field);
}

/* ---- Faces -------------------------------------------------------------------------- */

/* Whether a triangle of more than no area turns its back on the gradients at all
 * of its corners. */
static bool is_folded(const zs_mesh *mesh, size_t triangle, double least_area)
{
  const uint32_t *v = mesh->triangles + 3 * triangle;
  double n[3], square = 0;
  for (size_t k = 0; k < 3; k++) {
    const size_t i = (k + 1) % 3, j = (k + 2) % 3;
    const float *a = mesh->positions + 3 * (size_t)v[0], *b = mesh->positions + 3 * (size_t)v[1],
                *c = mesh->positions + 3 * (size_t)v[2];
    n[k] = ((double)b[i] - a[i]) * ((double)c[j] - a[j]) -
           ((double)b[j] - a[j]) * ((double)c[i] - a[i]);
    square += n[k] * n[k];
  }
  unsigned back = 0;
  for (unsigned c = 0; c < 3; c++) {
    const float *normal = mesh->normals + 3 * (size_t)v[c];
    back += n[0] * normal[0] + n[1] * normal[1] + n[2] * normal[2] < 0;
  }
  return back == 3 && sqrt(square) > 2 * least_area;
}

static void no_face_is_folded(void **state)
{
  (void)state;
  static const char *const formulas[] = {SPHERE, BOX, CUBE, CYLINDER, DIFFERENCE, MENGER};
  for (size_t i = 0; i < sizeof formulas / sizeof *formulas; i++)
    for (uint32_t resolution = 20; resolution <= 80; resolution += 20) {
      zs_grid grid = cube_grid(-1.113, 1.109, resolution);
      zs_mesh *mesh = polygonize(formulas[i], &grid, true, 2);
      assert_sound(mesh);
      for (size_t t = 0; t < mesh->triangle_count; t++)
        assert_false(is_folded(mesh, t, 1e-6 * grid.cell[0] * grid.cell[0]));
      zs_mesh_free(mesh);
    }
}

/* Most triangles are far from slivers, and none of a sphere is one. */
static void a_sphere_has_no_slivers(void **state)
{
  (void)state;
  zs_grid grid = cube_grid(-1.013, 1.009, 64);
  zs_mesh *mesh = polygonize(SPHERE, &grid, true, 2);
  assert_sound(mesh);
  for (size_t t = 0; t < mesh->triangle_count; t++)
    assert_true(sharpest_angle(mesh, t) > 5 * PI / 180);
  zs_mesh_free(mesh);
}

/* ---- Failures ------------------------------------------------------------------------- */

/* Short of memory, and cancelled. */
static void failures_are_reported(void **state)
{
  (void)state;
  zs_field *field = formula_field(CUBE);
  zs_grid grid = cube_grid(-1, 1, 40);
  zs_mesh_options options;
  zs_mesh_options_init(&options);
  options.method = ZS_MESH_FEATURES;
  zs_control control;
  zs_control_init(&control);
  for (uint64_t limit = 100; limit < 3000000; limit *= 3) {
    zs_diag diag = {0};
    control.memory_limit = limit;
    zs_mesh *mesh = zs_polygonize(field, &grid, &options, &control, NULL, &diag);
    assert_int_equal(mesh ? ZS_OK : ZS_ERROR_MEMORY, diag.status);
    assert_true(mesh || limit < 1000000);
    zs_mesh_free(mesh);
  }
  assert_cancellable(field, &grid, &options);
  zs_field_unref(field);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(every_mesh_is_a_closed_manifold),
    cmocka_unit_test(grids_of_any_shape_are_sound),
    cmocka_unit_test(open_meshes_end_at_the_box),
    cmocka_unit_test(meshes_are_the_same_however_they_are_made),
    cmocka_unit_test(vertices_stay_in_their_cells),
    cmocka_unit_test(vertices_are_certified_roots),
    cmocka_unit_test(edges_of_a_turned_cube_are_met),
    cmocka_unit_test(cubes_have_their_edges_along_all_their_length),
    cmocka_unit_test(cubes_in_planes_of_the_grid_have_their_edges),
    cmocka_unit_test(solids_in_planes_of_the_grid_are_sound),
    cmocka_unit_test(flat_parts_collapse),
    cmocka_unit_test(rims_of_a_cylinder_are_sharp),
    cmocka_unit_test(boxes_along_the_axes_are_exact),
    cmocka_unit_test(places_far_from_the_origin_are_sound),
    cmocka_unit_test(no_face_is_folded),
    cmocka_unit_test(a_sphere_has_no_slivers),
    cmocka_unit_test(failures_are_reported),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
