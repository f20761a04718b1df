/* Creases of different cells can meet in one point, as at the corner of a box,
 * and a crease can hit the vertex of an edge.  The mesh would still be a
 * manifold, but no longer once coinciding vertices are welded, as every reader
 * of an STL file does: all but one are given up. */
#include "output/polygonize.h"

#include "base/diagnostic.h"

#include <stdlib.h>
#include <string.h>

/* A crease by its position: its number, and another part of the position's hash
 * so that most others are told apart without a look at it. */
typedef struct entry {
  uint32_t tag;
  uint32_t crease; /* 1 + its number; 0: free */
} entry;

/* Open addressing. */
typedef struct table {
  entry *entries;
  size_t count;         /* a power of two */
  zs_crease **creases;  /* by number */
  float (*positions)[3];
} table;

static bool equal(const float *a, const float *b)
{
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

static uint64_t hash(const float position[3])
{
  uint64_t h = 0;
  for (int k = 0; k < 3; k++) {
    float coordinate = position[k] + 0.0f; /* -0 becomes 0 */
    uint32_t bits;
    memcpy(&bits, &coordinate, sizeof bits);
    h = (h ^ bits) * UINT64_C(0x9e3779b97f4a7c15);
    h ^= h >> 29;
  }
  return h;
}

/* Where a position is in the table, or the free entry where it belongs. */
static entry *find(const table *t, const float position[3], uint64_t h)
{
  const uint32_t tag = (uint32_t)(h >> 32);
  for (size_t at = (size_t)h;; at++) {
    entry *e = &t->entries[at & (t->count - 1)];
    if (!e->crease || (e->tag == tag && equal(t->positions[e->crease - 1], position)))
      return e;
  }
}

/* The table is larger than caches: what will be looked at is asked for in time. */
enum { AHEAD = 64 };

static uint64_t ask_for(const table *t, const float position[3])
{
  const uint64_t h = hash(position);
  __builtin_prefetch(&t->entries[h & (t->count - 1)]);
  return h;
}

/* Enter all creases, giving up those at the place of an earlier one. */
static void enter(table *t, size_t creases)
{
  uint64_t h[AHEAD];
  for (size_t at = 0; at < creases; at += AHEAD) {
    const size_t n = creases - at < AHEAD ? creases - at : AHEAD;
    for (size_t i = 0; i < n; i++)
      h[i] = ask_for(t, t->positions[at + i]);
    for (size_t i = 0; i < n; i++) {
      entry *e = find(t, t->positions[at + i], h[i]);
      if (e->crease)
        t->creases[at + i]->edges = 0;
      else
        *e = (entry){(uint32_t)(h[i] >> 32), (uint32_t)(at + i + 1)};
    }
  }
}

static void list_creases(const zs_brick *brick, const zs_frame *frame, table *t)
{
  for (uint32_t c = 0; c < brick->crease_count; c++) {
    const size_t number = brick->first_crease + c;
    for (int k = 0; k < 3; k++)
      t->positions[number][k] = (float)(frame->origin[k] + (double)brick->creases[c].place[k]);
    t->creases[number] = &brick->creases[c];
  }
}

static void compact_creases(zs_brick *brick)
{
  uint32_t kept = 0;
  for (uint32_t i = 0; i < brick->crease_count; i++)
    if (brick->creases[i].edges)
      brick->creases[kept++] = brick->creases[i];
  brick->crease_count = kept;
}

/* Give up creases at the place of an edge's vertex. */
static void compare_vertices(const zs_polygonize_job *job, const table *t)
{
  const size_t vertices = job->vertex_count;
#pragma omp parallel for schedule(static) num_threads(job->threads)
  for (size_t at = 0; at < vertices; at += AHEAD) {
    const float *positions = job->mesh->positions + 3 * at;
    const size_t n = vertices - at < AHEAD ? vertices - at : AHEAD;
    uint64_t h[AHEAD];
    for (size_t i = 0; i < n; i++)
      h[i] = ask_for(t, positions + 3 * i);
    for (size_t i = 0; i < n; i++) {
      const uint32_t crease = find(t, positions + 3 * i, h[i])->crease;
      if (crease) {
#pragma omp atomic write
        t->creases[crease - 1]->edges = 0;
      }
    }
  }
}

bool zs_polygonize_distinct(zs_polygonize_job *job)
{
  size_t creases = 0;
  for (size_t i = 0; i < job->active_count; i++) {
    job->active[i]->first_crease = creases; /* numbers of their own for now */
    creases += job->active[i]->crease_count;
  }
  table t = {.count = 16};
  while (t.count < 3 * creases)
    t.count *= 2;
  t.entries = calloc(t.count, sizeof *t.entries);
  t.creases = malloc((creases + 1) * sizeof *t.creases);
  t.positions = malloc((creases + 1) * sizeof *t.positions);
  bool done = t.entries && t.creases && t.positions;
  if (done) {
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
    for (size_t i = 0; i < job->active_count; i++) {
      const zs_frame frame = zs_brick_frame(job, job->active[i]);
      list_creases(job->active[i], &frame, &t);
    }
    enter(&t, creases);
    compare_vertices(job, &t);
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
    for (size_t i = 0; i < job->active_count; i++)
      compact_creases(job->active[i]);
  }
  free(t.entries);
  free(t.creases);
  free(t.positions);
  return done || zs_fail_memory(job->diag);
}
