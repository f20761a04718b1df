/* The laws of the contour table, for all 256 cases. */
#include "output/contour_table.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

/* The two cell faces of an edge, by what a face is: a plane of four corners. */
static unsigned faces_of(unsigned edge)
{
  unsigned start = zs_cell_edge_start(edge), end = start | 1u << edge / 4, faces = 0;
  for (unsigned axis = 0; axis < 3; axis++)
    for (unsigned side = 0; side < 2; side++)
      if ((start >> axis & 1) == side && (end >> axis & 1) == side)
        faces |= 1u << (2 * axis + side);
  return faces;
}

static bool crosses(unsigned inside, unsigned edge)
{
  unsigned start = zs_cell_edge_start(edge), end = start | 1u << edge / 4;
  return (inside >> start & 1) != (inside >> end & 1);
}

/* How often a case's triangles run from one edge's vertex to another's. */
static void count_sides(const zs_cell_case *cell, unsigned sides[ZS_CELL_EDGES][ZS_CELL_EDGES])
{
  for (unsigned a = 0; a < ZS_CELL_EDGES; a++)
    for (unsigned b = 0; b < ZS_CELL_EDGES; b++)
      sides[a][b] = 0;
  for (unsigned t = 0; t < cell->triangle_count; t++)
    for (unsigned k = 0; k < 3; k++)
      sides[cell->triangles[3 * t + k]][cell->triangles[3 * t + (k + 1) % 3]]++;
}

static void edges_are_twelve_different_ones(void **state)
{
  (void)state;
  bool seen[8][8] = {{false}};
  for (unsigned e = 0; e < ZS_CELL_EDGES; e++) {
    unsigned start = zs_cell_edge_start(e), end = start | 1u << e / 4;
    assert_true(start < 8 && end < 8 && start != end);
    assert_false(seen[start][end]);
    seen[start][end] = true;
    assert_int_equal(__builtin_popcount(faces_of(e)), 2);
  }
}

/* Every crossing edge has a vertex, no other edge has. */
static void vertices_are_the_crossing_edges(void **state)
{
  (void)state;
  zs_contour_table table;
  zs_contour_table_make(&table);
  for (unsigned inside = 0; inside < ZS_CELL_CASES; inside++) {
    const zs_cell_case *cell = &table.cases[inside];
    unsigned used = 0, crossing = 0;
    assert_true(cell->triangle_count <= ZS_CELL_TRIANGLES);
    for (unsigned i = 0; i < 3u * cell->triangle_count; i++)
      used |= 1u << cell->triangles[i];
    for (unsigned e = 0; e < ZS_CELL_EDGES; e++)
      crossing |= (unsigned)crosses(inside, e) << e;
    assert_int_equal(used, crossing);
  }
}

/* A side of a triangle is a diagonal, run through once each way and never in a
 * face, or a cut of a face, run through once. */
static void sides_are_cuts_or_legal_diagonals(void **state)
{
  (void)state;
  zs_contour_table table;
  zs_contour_table_make(&table);
  for (unsigned inside = 0; inside < ZS_CELL_CASES; inside++) {
    unsigned sides[ZS_CELL_EDGES][ZS_CELL_EDGES];
    count_sides(&table.cases[inside], sides);
    for (unsigned a = 0; a < ZS_CELL_EDGES; a++)
      for (unsigned b = 0; b < ZS_CELL_EDGES; b++) {
        if (!sides[a][b])
          continue;
        assert_int_equal(sides[a][b], 1);
        assert_int_not_equal(a, b);
        bool common_face = faces_of(a) & faces_of(b);
        assert_int_equal(sides[b][a], common_face ? 0 : 1);
      }
  }
}

/* Two cells on both sides of a face cut it alike, in opposite senses: shown for
 * every pair of cases that agree on the four corners of the face. */
static void neighbours_share_the_cuts_of_a_face(void **state)
{
  (void)state;
  zs_contour_table table;
  zs_contour_table_make(&table);
  for (unsigned axis = 0; axis < 3; axis++)
    for (unsigned below = 0; below < ZS_CELL_CASES; below++) {
      unsigned lower[ZS_CELL_EDGES][ZS_CELL_EDGES], upper[ZS_CELL_EDGES][ZS_CELL_EDGES];
      count_sides(&table.cases[below], lower);
      for (unsigned above = 0; above < ZS_CELL_CASES; above++) {
        bool agree = true;
        for (unsigned c = 0; c < 8; c++)
          if (!(c >> axis & 1))
            agree = agree && (above >> c & 1) == (below >> (c | 1u << axis) & 1);
        if (!agree)
          continue;
        count_sides(&table.cases[above], upper);
        /* Edges of the face: start corner on the far side of `below`, on the
         * near side of `above`. */
        unsigned far[4], near[4], n = 0;
        for (unsigned e = 0; e < ZS_CELL_EDGES; e++)
          for (unsigned f = 0; f < ZS_CELL_EDGES; f++)
            if (e / 4 == f / 4 && e / 4 != axis &&
                zs_cell_edge_start(e) == (zs_cell_edge_start(f) | 1u << axis) &&
                !(zs_cell_edge_start(f) >> axis & 1)) {
              far[n] = e;
              near[n++] = f;
            }
        assert_int_equal(n, 4);
        for (unsigned i = 0; i < 4; i++)
          for (unsigned j = 0; j < 4; j++)
            assert_int_equal(lower[far[i]][far[j]], upper[near[j]][near[i]]);
      }
    }
}

/* Loops lie in one cell once: around the vertex of every edge the triangles of
 * a cell form one open fan. */
static void a_vertex_has_one_fan_in_a_cell(void **state)
{
  (void)state;
  zs_contour_table table;
  zs_contour_table_make(&table);
  for (unsigned inside = 0; inside < ZS_CELL_CASES; inside++) {
    unsigned sides[ZS_CELL_EDGES][ZS_CELL_EDGES];
    count_sides(&table.cases[inside], sides);
    for (unsigned e = 0; e < ZS_CELL_EDGES; e++) {
      unsigned leaving = 0, arriving = 0;
      for (unsigned other = 0; other < ZS_CELL_EDGES; other++) {
        leaving += sides[e][other] && !sides[other][e];
        arriving += sides[other][e] && !sides[e][other];
      }
      assert_int_equal(leaving, crosses(inside, e) ? 1 : 0);
      assert_int_equal(arriving, leaving);
    }
  }
}

/* The loops are the outlines of their triangles: a side that is run through one
 * way only is a step of a loop, and the other way round. */
static void loops_outline_their_triangles(void **state)
{
  (void)state;
  zs_contour_table table;
  zs_contour_table_make(&table);
  for (unsigned inside = 0; inside < ZS_CELL_CASES; inside++) {
    const zs_cell_case *cell = &table.cases[inside];
    unsigned first_edge = 0, first_triangle = 0, sides[ZS_CELL_EDGES][ZS_CELL_EDGES];
    assert_true(cell->loop_count <= ZS_CELL_LOOPS);
    for (unsigned l = 0; l < cell->loop_count; l++) {
      unsigned n = cell->loop_lengths[l];
      assert_true(n >= 3 && n <= 7);
      zs_cell_case part = {.triangle_count = (uint8_t)(n - 2)};
      for (unsigned i = 0; i < 3 * (n - 2); i++)
        part.triangles[i] = cell->triangles[3 * first_triangle + i];
      count_sides(&part, sides);
      unsigned outline = 0;
      for (unsigned a = 0; a < ZS_CELL_EDGES; a++)
        for (unsigned b = 0; b < ZS_CELL_EDGES; b++)
          outline += sides[a][b] && !sides[b][a];
      assert_int_equal(outline, n);
      for (unsigned i = 0; i < n; i++) {
        unsigned a = cell->loops[first_edge + i], b = cell->loops[first_edge + (i + 1) % n];
        assert_true(sides[a][b] && !sides[b][a]);
      }
      first_edge += n;
      first_triangle += n - 2;
    }
    assert_int_equal(first_triangle, cell->triangle_count);
  }
}

/* Triangles of a single inside corner face away from it. */
static void triangles_face_outward(void **state)
{
  (void)state;
  zs_contour_table table;
  zs_contour_table_make(&table);
  for (unsigned corner = 0; corner < 8; corner++)
    for (unsigned flip = 0; flip < 2; flip++) {
      const zs_cell_case *cell = &table.cases[flip ? 0xff ^ 1u << corner : 1u << corner];
      int p[3][3], n[3], out = 0;
      assert_int_equal(cell->triangle_count, 1);
      for (unsigned i = 0; i < 3; i++) {
        unsigned start = zs_cell_edge_start(cell->triangles[i]);
        for (unsigned k = 0; k < 3; k++)
          p[i][k] = 2 * (int)(start >> k & 1) + (cell->triangles[i] / 4 == k);
      }
      for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        n[k] = (p[1][i] - p[0][i]) * (p[2][j] - p[0][j]) -
               (p[1][j] - p[0][j]) * (p[2][i] - p[0][i]);
        out += n[k] * (p[0][k] - 2 * (int)(corner >> k & 1));
      }
      assert_true(flip ? out < 0 : out > 0);
    }
}

/* The loops of the dual mesh are those of the triangles, as sets; and with the
 * face that one loop meets twice cut the other way, none meets any face twice. */
static void dual_loops_meet_faces_once(void **state)
{
  (void)state;
  zs_contour_table contour;
  zs_loop_table table;
  zs_contour_table_make(&contour);
  zs_loop_table_make(&table);
  unsigned parted = 0;
  for (unsigned inside = 0; inside < ZS_CELL_CASES; inside++) {
    const zs_cell_case *cell = &contour.cases[inside];
    const uint8_t *loop = cell->loops;
    assert_int_equal(table.loops[inside].count, cell->loop_count);
    for (unsigned l = 0; l < cell->loop_count; loop += cell->loop_lengths[l++]) {
      unsigned edges = 0;
      for (unsigned i = 0; i < cell->loop_lengths[l]; i++)
        edges |= 1u << loop[i];
      assert_int_equal(table.loops[inside].edges[l], edges);
    }
    bool twice = table.twice[inside] != ZS_NO_FACE;
    parted += twice;
    const zs_cell_loops *loops = twice ? &table.parted[inside] : &table.loops[inside];
    unsigned all = 0;
    for (unsigned l = 0; l < loops->count; l++) {
      assert_true((all & loops->edges[l]) == 0);
      all |= loops->edges[l];
      for (unsigned face = 0; face < ZS_NO_FACE; face++) {
        unsigned met = 0;
        for (unsigned e = 0; e < ZS_CELL_EDGES; e++)
          met += (loops->edges[l] >> e & 1) && (faces_of(e) >> face & 1);
        assert_true(met == 0 || met == 2);
      }
    }
    for (unsigned e = 0; e < ZS_CELL_EDGES; e++)
      assert_int_equal(all >> e & 1, crosses(inside, e));
  }
  assert_int_equal(parted, 36);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(edges_are_twelve_different_ones),
    cmocka_unit_test(vertices_are_the_crossing_edges),
    cmocka_unit_test(sides_are_cuts_or_legal_diagonals),
    cmocka_unit_test(neighbours_share_the_cuts_of_a_face),
    cmocka_unit_test(a_vertex_has_one_fan_in_a_cell),
    cmocka_unit_test(loops_outline_their_triangles),
    cmocka_unit_test(triangles_face_outward),
    cmocka_unit_test(dual_loops_meet_faces_once),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
