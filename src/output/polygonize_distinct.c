/* Creases of different cells can meet in one point, as at the corner of a box,
 * and a crease can hit the vertex of an edge.  The mesh would still be a
 * manifold, but no longer once coinciding vertices are welded, as every reader
 * of an STL file does: all but one are given up. */
#include "output/polygonize.h"

#include "base/diagnostic.h"

#include <stdlib.h>
#include <string.h>

/* Creases by position: open addressing. */
typedef struct entry {
  zs_crease *crease; /* NULL: free */
  float position[3];
} entry;

typedef struct table {
  entry *entries;
  size_t count; /* a power of two */
} table;

static void crease_position(const zs_frame *frame, const zs_crease *crease, float position[3])
{
  for (int k = 0; k < 3; k++)
    position[k] = (float)(frame->origin[k] + (double)crease->place[k]);
}

static bool equal(const float *a, const float *b)
{
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Where a position is in the table, or the free entry where it belongs. */
static entry *find(const table *t, const float position[3])
{
  uint64_t h = 0;
  for (int k = 0; k < 3; k++) {
    float coordinate = position[k] + 0.0f; /* -0 becomes 0 */
    uint32_t bits;
    memcpy(&bits, &coordinate, sizeof bits);
    h = (h ^ bits) * UINT64_C(0x9e3779b97f4a7c15);
    h ^= h >> 29;
  }
  for (size_t at = (size_t)h;; at++) {
    entry *e = &t->entries[at & (t->count - 1)];
    if (!e->crease || equal(e->position, position))
      return e;
  }
}

/* Enter all creases, giving up those at the place of an earlier one. */
static void enter(const zs_polygonize_job *job, table *t)
{
  for (size_t i = 0; i < job->active_count; i++) {
    const zs_brick *brick = job->active[i];
    const zs_frame frame = zs_brick_frame(job, brick);
    for (uint32_t c = 0; c < brick->crease_count; c++) {
      float position[3];
      crease_position(&frame, &brick->creases[c], position);
      entry *e = find(t, position);
      if (e->crease) {
        brick->creases[c].edges = 0;
        continue;
      }
      e->crease = &brick->creases[c];
      memcpy(e->position, position, sizeof position);
    }
  }
}

void zs_brick_compact_creases(zs_brick *brick)
{
  uint32_t kept = 0;
  for (uint32_t i = 0; i < brick->crease_count; i++)
    if (brick->creases[i].edges)
      brick->creases[kept++] = brick->creases[i];
  brick->crease_count = kept;
}

bool zs_polygonize_distinct(zs_polygonize_job *job)
{
  size_t creases = 0;
  for (size_t i = 0; i < job->active_count; i++)
    creases += job->active[i]->crease_count;
  table t = {.count = 16};
  while (t.count < 2 * creases)
    t.count *= 2;
  t.entries = calloc(t.count, sizeof *t.entries);
  if (!t.entries)
    return zs_fail_memory(job->diag);
  enter(job, &t);
#pragma omp parallel for schedule(static) num_threads(job->threads)
  for (size_t v = 0; v < job->mesh->vertex_count; v++) {
    zs_crease *crease = find(&t, job->mesh->positions + 3 * v)->crease;
    if (crease) {
#pragma omp atomic write
      crease->edges = 0;
    }
  }
  free(t.entries);
  for (size_t i = 0; i < job->active_count; i++)
    zs_brick_compact_creases(job->active[i]);
  return true;
}
