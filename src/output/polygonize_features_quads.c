/* The features method's triangles: two for every crossing edge.
 *
 * A quad can be cut along either diagonal: its four cells have nothing but the
 * edge in common, so that no other quad has the same diagonal. */
#include "output/polygonize.h"

#include "base/diagnostic.h"
#include "base/threads.h"

#include <math.h>
#include <stdlib.h>

/* The patches of a cell of a brick or just below it. */
typedef struct cell_patches {
  zs_patch *first;
  uint32_t vertex; /* of the first one */
} cell_patches;

/* By cell: -1 .. 15 in every axis.  Cells without patches are never looked at. */
typedef cell_patches reach_patches[ZS_REACH_CORNERS];

static size_t cell_offset(unsigned cell, const unsigned below[3])
{
  unsigned at[3];
  for (unsigned k = 0; k < 3; k++, cell /= ZS_BRICK)
    at[k] = below[k] ? 0 : cell % ZS_BRICK + 1;
  return zs_reach_offset(at[0], at[1], at[2]);
}

/* Enter the patches of a row of cells of the owner; `below` says along which axes
 * it is the brick before, whose last cells alone are of interest. */
static void enter_row(const zs_brick *owner, unsigned row, const unsigned below[3],
                      reach_patches patches)
{
  for (unsigned i = owner->patch_rows[row]; i < owner->patch_rows[row + 1]; i++) {
    zs_patch *patch = &owner->patches[i];
    const bool is_first = i == 0 || patch[-1].cell != patch->cell;
    if (is_first && (!below[0] || patch->cell % ZS_BRICK == ZS_BRICK - 1))
      patches[cell_offset(patch->cell, below)] =
        (cell_patches){patch, (uint32_t)(owner->first_patch + i)};
  }
}

static void enter_patches(const zs_polygonize_job *job, const zs_brick *brick,
                          reach_patches patches)
{
  for (unsigned d = 0; d < 8; d++) {
    const unsigned below[3] = {d & 1, d >> 1 & 1, d >> 2};
    uint32_t at[3];
    for (int k = 0; k < 3; k++)
      at[k] = brick->index[k] - below[k]; /* below 0: no brick's index */
    const zs_brick *owner = zs_lattice_brick(job, at);
    if (!owner->patch_count)
      continue;
    for (unsigned z = below[2] ? ZS_BRICK - 1 : 0; z < ZS_BRICK; z++)
      for (unsigned y = below[1] ? ZS_BRICK - 1 : 0; y < ZS_BRICK; y++)
        enter_row(owner, z * ZS_BRICK + y, below, patches);
  }
}

/* ---- Triangles ------------------------------------------------------------------- */

/* A corner of a quad. */
typedef struct corner {
  uint32_t vertex;
  zs_patch *patch;
  const float *position, *normal;
} corner;

static void put(uint32_t *triangle, const corner *a, const corner *b, const corner *c)
{
  triangle[0] = a->vertex;
  triangle[1] = b->vertex;
  triangle[2] = c->vertex;
}

/* How many of the normals at its corners a triangle turns its back on; all when it is
 * no more than a line. */
static unsigned disagreements(const corner *a, const corner *b, const corner *c)
{
  static const float flattest = 1e-3f; /* height by length */
  float u[3], v[3], n[3], square = 0;
  for (int k = 0; k < 3; k++) {
    u[k] = b->position[k] - a->position[k];
    v[k] = c->position[k] - a->position[k];
    square += u[k] * u[k] + v[k] * v[k];
  }
  for (int k = 0; k < 3; k++)
    n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
  const float least = flattest * square;
  unsigned count = 0;
  count += n[0] * a->normal[0] + n[1] * a->normal[1] + n[2] * a->normal[2] < least;
  count += n[0] * b->normal[0] + n[1] * b->normal[1] + n[2] * b->normal[2] < least;
  count += n[0] * c->normal[0] + n[1] * c->normal[1] + n[2] * c->normal[2] < least;
  return count;
}

static float square_distance(const corner *a, const corner *b)
{
  float sum = 0;
  for (int k = 0; k < 3; k++) {
    float difference = a->position[k] - b->position[k];
    sum += difference * difference;
  }
  return sum;
}

/* How wrong it is to cut a quad from a corner to the opposite one: FOLDED and more
 * when a triangle turns its back on all three normals, or is no more than a line. */
enum { FOLDED = 16 };
static unsigned wrongness(const corner q[4], unsigned from)
{
  const corner *to = &q[(from + 2) % 4];
  unsigned one = disagreements(&q[from], &q[from + 1], to);
  unsigned other = disagreements(&q[from], to, &q[(from + 3) % 4]);
  return one + other + (one == 3 || other == 3 ? FOLDED : 0);
}

/* The corner, first or second, from which to cut a quad: from one sharp edge to
 * another, or else along the shorter diagonal; but where the other way agrees
 * better with the normals, that. */
static unsigned choose_cut(const corner q[4], bool *is_folded)
{
  const int sharp = (int)(q[1].patch->sharp + q[3].patch->sharp) -
                    (int)(q[0].patch->sharp + q[2].patch->sharp);
  const unsigned from =
    sharp ? sharp > 0 : square_distance(&q[1], &q[3]) < square_distance(&q[0], &q[2]);
  const unsigned wrong = wrongness(q, from);
  *is_folded = false;
  if (!wrong)
    return from;
  const unsigned other = wrongness(q, 1 - from);
  *is_folded = wrong >= FOLDED && other >= FOLDED;
  return other < wrong ? 1 - from : from;
}

static void write_quad(const zs_polygonize_job *job, const reach_patches patches,
                       const unsigned start[3], unsigned axis, bool inside, uint32_t *triangles)
{
  static const unsigned around[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const unsigned u = (axis + 1) % 3, v = (axis + 2) % 3;
  corner q[4];
  for (unsigned i = 0; i < 4; i++) {
    unsigned at[3] = {start[0] + 1, start[1] + 1, start[2] + 1};
    at[u] -= around[i][0];
    at[v] -= around[i][1];
    const unsigned edge = 4 * axis + around[i][0] + 2 * around[i][1];
    const cell_patches *cell = &patches[zs_reach_offset(at[0], at[1], at[2])];
    unsigned n = 0;
    while (!(cell->first[n].edges >> edge & 1))
      n++;
    const uint32_t vertex = cell->vertex + n;
    q[inside ? i : 3 - i] = (corner){.vertex = vertex,
                                     .patch = &cell->first[n],
                                     .position = job->dual->positions + 3 * (size_t)vertex,
                                     .normal = job->dual->normals + 3 * (size_t)vertex};
  }
  bool is_folded;
  const unsigned from = choose_cut(q, &is_folded);
  for (unsigned i = 0; is_folded && i < 4; i++) {
#pragma omp atomic write
    q[i].patch->suspect = true;
  }
  put(triangles, &q[from], &q[from + 1], &q[from + 2]);
  put(triangles + 3, &q[from], &q[from + 2], &q[(from + 3) % 4]);
}

static void write_quads(const zs_polygonize_job *job, const zs_brick *brick,
                        reach_patches patches)
{
  uint32_t *triangles = job->dual->triangles + 3 * brick->first_triangle;
  enter_patches(job, brick, patches);
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    for (unsigned axis = 0; axis < 3; axis++)
      for (unsigned edges = brick->crossing[axis][row]; edges; edges &= edges - 1) {
        const unsigned x = (unsigned)__builtin_ctz(edges);
        const unsigned start[3] = {x, row % ZS_BRICK, row / ZS_BRICK};
        write_quad(job, patches, start, axis, brick->signs[row] >> x & 1, triangles);
        triangles += 6;
      }
}

static bool write_all(const zs_polygonize_job *job)
{
  reach_patches *scratch = malloc(job->threads * sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
  for (size_t i = 0; i < job->active_count; i++)
    write_quads(job, job->active[i], scratch[zs_thread_number()]);
  free(scratch);
  return true;
}

/* Where triangles are folded even so, vertices lie wrong: they are moved, and all
 * quads are written again. */
bool zs_polygonize_quads(zs_polygonize_job *job)
{
  enum { ROUNDS = 4 };
  bool done = true, again = true;
  for (unsigned round = 1; done && again && round <= ROUNDS; round++)
    done = write_all(job) && zs_polygonize_turn(job) &&
           zs_polygonize_unfold(job, round == ROUNDS, &again);
  return done;
}
