/* The features method's vertices of cells whose planes meet in another cell.
 *
 * A sharp edge or a corner can reach into a cell between its corners, so that their
 * signs do not tell.  A cell near it that sees the planes claims the place where they
 * meet for its vertex.  A corner is claimed wherever it is: the cell that sees all its
 * planes is where the sharp edges come together in the mesh.  Of a sharp edge only
 * what lies in cells without vertices is claimed; otherwise there are vertices on it
 * nearby.  A cell goes to one claim, and never to a second vertex in a corner.  Who
 * claims in vain keeps standing aside. */
#include "output/polygonize.h"
#include "output/polygonize_roots.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The surface is looked for within this part of a cell from where the planes meet,
 * and may lie beyond the cell by this part of what is left of that within. */
static const double NEAR = 0.15, BEYOND = 0.02;

/* By cell, then those with most planes first. */
static int compare_claims(const void *a, const void *b)
{
  const zs_claim *p = a, *q = b;
  for (int k = 2; k >= 0; k--)
    if (p->cell[k] != q->cell[k])
      return p->cell[k] < q->cell[k] ? -1 : 1;
  if (p->rank != q->rank)
    return p->rank > q->rank ? -1 : 1;
  return (p->vertex > q->vertex) - (p->vertex < q->vertex);
}

static bool same_cell(const zs_claim *a, const zs_claim *b)
{
  return !memcmp(a->cell, b->cell, sizeof a->cell);
}

/* All workers' claims in order; NULL when memory is out. */
static zs_claim *sort_claims(const zs_polygonize_job *job, size_t *count)
{
  *count = 0;
  for (unsigned t = 0; t < job->threads; t++)
    *count += job->workers[t].claims.count;
  zs_claim *claims = malloc((*count + 1) * sizeof *claims), *end = claims;
  if (!claims)
    return NULL;
  for (unsigned t = 0; t < job->threads; t++) {
    const zs_claims *some = &job->workers[t].claims;
    if (some->count)
      memcpy(end, some->items, some->count * sizeof *end);
    end += some->count;
  }
  qsort(claims, *count, sizeof *claims, compare_claims);
  return claims;
}

/* The brick that holds a claimed cell, when it was sampled and the cell is none of
 * those to pads. */
static const zs_brick *brick_of(const zs_polygonize_job *job, const uint32_t cell[3],
                                unsigned local[3])
{
  uint32_t at[3];
  for (int k = 0; k < 3; k++) {
    if (cell[k] < 1 || cell[k] >= job->corners[k] - 2)
      return NULL;
    at[k] = cell[k] / ZS_BRICK;
    local[k] = cell[k] % ZS_BRICK;
  }
  const zs_brick *brick = zs_lattice_brick(job, at);
  return brick->sampled ? brick : NULL;
}

/* How far a place is from where a box ends in a direction, at most `reach`. */
static double room_along(const double place[3], const double direction[3], const double lo[3],
                         const double hi[3], double reach)
{
  for (int k = 0; k < 3; k++)
    if (direction[k] != 0)
      reach = fmin(reach, ((direction[k] > 0 ? hi[k] : lo[k]) - place[k]) / direction[k]);
  return fmax(reach, 0);
}

/* A claimed cell, in its brick's frame. */
typedef struct site {
  const zs_brick *brick;
  unsigned local[3];
  zs_frame frame;
  double lo[3], hi[3]; /* the space for vertices */
} site;

static void look_at_site(const zs_polygonize_job *job, site *s)
{
  s->frame = zs_brick_frame(job, s->brick);
  for (int k = 0; k < 3; k++) {
    const double margin = fmin(job->apart, job->cell[k] / 4);
    s->lo[k] = zs_brick_place(job, k, s->local[k]) + margin;
    s->hi[k] = zs_brick_place(job, k, s->local[k] + 1) - margin;
  }
}

/* The ends of the line along a claim's normal, inner one first, where its surface is
 * looked for. */
static void find_ends(const zs_polygonize_job *job, const site *s, const zs_claim *claim,
                      float ends[2][3])
{
  const double near = NEAR * fmin(job->cell[0], fmin(job->cell[1], job->cell[2]));
  double place[3], direction[3];
  for (int k = 0; k < 3; k++)
    place[k] = fmin(fmax(claim->place[k] - s->frame.origin[k], s->lo[k]), s->hi[k]);
  for (int i = 0; i < 2; i++) {
    for (int k = 0; k < 3; k++)
      direction[k] = i ? claim->normal[k] : -claim->normal[k];
    const double room = room_along(place, direction, s->lo, s->hi, near);
    for (int k = 0; k < 3; k++)
      ends[i][k] = (float)(place[k] + room * direction[k]);
  }
}

/* Settle a claimed place on the surface, along its normal and within the cell. */
static bool settle(zs_polygonize_job *job, const zs_claim *claim, const site *s, zs_roots *roots,
                   float settled[3])
{
  zs_polygonize_worker *worker = &job->workers[0];
  float ends[2][3];
  find_ends(job, s, claim, ends);
  for (int k = 0; k < 3; k++)
    for (int i = 0; i < 2; i++)
      roots->at[k][i] = ends[i][k];
  zs_program_values(worker->eval, s->brick->program, &s->frame, 2, roots->at[0], roots->at[1],
                    roots->at[2], roots->f);
  worker->evaluations += 2;
  const float inner = roots->f[0], outer = roots->f[1];
  const float *found = NULL;
  float root[3];
  if (inner >= 0 && outer < 0) {
    roots->count = 0;
    zs_roots_add(roots, ends[0], ends[1], inner, outer);
    worker->evaluations += zs_roots_solve(roots, worker->eval, s->brick->program, &s->frame,
                                          (float)job->tolerance, 0);
    for (int k = 0; k < 3; k++)
      root[k] = roots->found[k][0];
    found = root;
  } else if (inner >= 0 && outer <= BEYOND * (inner - outer)) {
    found = ends[1];
  } else if (outer < 0 && -inner <= BEYOND * (inner - outer)) {
    found = ends[0];
  }
  for (int k = 0; k < 3 && found; k++)
    settled[k] = (float)(s->frame.origin[k] + (double)found[k]);
  return found;
}

/* Whether a claim may be granted for all that is in the cell. */
static bool is_free(const zs_claim *claim, const site *s)
{
  const unsigned row = s->local[2] * ZS_BRICK + s->local[1], cell = row * ZS_BRICK + s->local[0];
  if (!s->brick->patch_count)
    return true;
  for (unsigned i = s->brick->patch_rows[row]; i < s->brick->patch_rows[row + 1]; i++) {
    const zs_patch *patch = &s->brick->patches[i];
    if (patch->cell == cell && (claim->rank < 3 || patch->corner))
      return false;
  }
  return true;
}

/* Try to grant a claim. */
static bool grant(zs_polygonize_job *job, const zs_claim *claim, zs_roots *roots)
{
  site s;
  float place[3];
  s.brick = brick_of(job, claim->cell, s.local);
  if (!s.brick || !is_free(claim, &s))
    return false;
  look_at_site(job, &s);
  if (!settle(job, claim, &s, roots, place))
    return false;
  claim->patch->sharp = true;
  claim->patch->corner = claim->rank == 3;
  claim->patch->aside = false;
  memcpy(job->dual->positions + 3 * (size_t)claim->vertex, place, sizeof place);
  memcpy(job->dual->normals + 3 * (size_t)claim->vertex, claim->normal, sizeof claim->normal);
  return true;
}

bool zs_polygonize_claims(zs_polygonize_job *job)
{
  size_t count;
  zs_claim *claims = sort_claims(job, &count);
  zs_roots *roots = aligned_alloc(64, sizeof *roots);
  const bool done = claims && roots;
  for (size_t i = 0, next; done && i < count; i = next) {
    bool granted = false;
    for (next = i; next < count && same_cell(&claims[next], &claims[i]); next++)
      granted = granted || grant(job, &claims[next], roots);
  }
  free(claims);
  free(roots);
  return done || zs_fail_memory(job->diag);
}
