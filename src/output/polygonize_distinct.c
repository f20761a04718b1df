/* Creases of different cells can meet in one point, as at the corner of a box,
 * and a crease can hit the vertex of an edge.  The mesh would still be a
 * manifold, but no longer once coinciding vertices are welded, as every reader
 * of an STL file does: all but one are given up.
 *
 * Most creases lie by themselves within a cell, where nothing else can be.  The
 * others are looked up in a table of positions. */
#include "output/polygonize.h"

#include "base/diagnostic.h"
#include "base/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Which are alone -------------------------------------------------------------- */

/* Whether a crease is well within its cell, and not near one of its edges:
 * vertices are as far from those as corners are moved.  Other creases are there
 * only if they belong to the same cell, since it holds surface. */
static bool is_inside(const zs_crease *crease, const double cell[3], const float margin[3])
{
  unsigned near_edge = 0;
  bool inside = true;
  for (int k = 0; k < 3; k++) {
    const int corner = (crease->cell >> 4 * k & (ZS_BRICK - 1)) - ZS_BRICK / 2;
    const float part = crease->place[k] / (float)cell[k] - (float)corner;
    const float off = fminf(part, 1 - part); /* the closer side, in cells */
    inside = inside && off > margin[k];
    near_edge += off <= ZS_REPULSION + margin[k];
  }
  return inside && near_edge < 2;
}

void zs_creases_compare(const zs_polygonize_job *job, zs_brick *brick)
{
  const float rounding = 1e-4f; /* of places, in cells */
  float margin[3];
  for (int k = 0; k < 3; k++)
    margin[k] = rounding + (float)(job->apart / job->cell[k]);
  brick->crowded_count = 0;
  for (uint32_t c = 0; c < brick->crease_count; c++) {
    zs_crease *crease = &brick->creases[c];
    const bool shares =
      (c > 0 && crease[-1].cell == crease->cell) ||
      (c + 1 < brick->crease_count && crease[1].cell == crease->cell);
    crease->alone = !shares && is_inside(crease, job->cell, margin);
    brick->crowded_count += !crease->alone;
  }
}

/* ---- Positions ---------------------------------------------------------------------- */

/* A crease by its position: its number, and another part of the position's hash
 * so that most others are told apart without a look at it. */
typedef struct entry {
  uint32_t tag;
  uint32_t crease; /* 1 + its number; 0: free */
} entry;

/* Open addressing. */
typedef struct table {
  entry *entries;
  unsigned bits;        /* there are 2^bits */
  zs_crease **creases;  /* by number */
  float (*positions)[3];
} table;

static bool equal(const float *a, const float *b)
{
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

static uint64_t hash(const float position[3])
{
  static const uint64_t factors[3] = {UINT64_C(0x9e3779b97f4a7c15), UINT64_C(0xd6e8feb86659fd93),
                                      UINT64_C(0xca5a826395121157)};
  uint64_t h = 0;
  for (int k = 0; k < 3; k++) {
    float coordinate = position[k] + 0.0f; /* -0 becomes 0 */
    uint32_t bits;
    memcpy(&bits, &coordinate, sizeof bits);
    h += bits * factors[k];
  }
  return h;
}

static size_t first_entry(const table *t, uint64_t h)
{
  return (size_t)(h >> (64 - t->bits)); /* the upper bits depend on all others */
}

/* Where a position is in the table, or the free entry where it belongs. */
static entry *find(const table *t, const float position[3], uint64_t h)
{
  const uint32_t tag = (uint32_t)(h >> 16);
  const size_t last = ((size_t)1 << t->bits) - 1;
  for (size_t at = first_entry(t, h);; at = (at + 1) & last) {
    entry *e = &t->entries[at];
    if (!e->crease || (e->tag == tag && equal(t->positions[e->crease - 1], position)))
      return e;
  }
}

/* The table can be larger than caches: what will be looked at is asked for in
 * time. */
enum { AHEAD = 64 };

static uint64_t ask_for(const table *t, const float position[3])
{
  const uint64_t h = hash(position);
  __builtin_prefetch(&t->entries[first_entry(t, h)]);
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
        *e = (entry){(uint32_t)(h[i] >> 16), (uint32_t)(at + i + 1)};
    }
  }
}

static void list_crowded(const zs_brick *brick, const zs_frame *frame, size_t number, table *t)
{
  for (uint32_t c = 0; c < brick->crease_count; c++) {
    zs_crease *crease = &brick->creases[c];
    if (crease->alone)
      continue;
    for (int k = 0; k < 3; k++)
      t->positions[number][k] = (float)(frame->origin[k] + (double)crease->place[k]);
    t->creases[number++] = crease;
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
  size_t crowded = 0;
  for (size_t i = 0; i < job->active_count; i++) {
    job->active[i]->first_crease = crowded; /* numbers of their own for now */
    crowded += job->active[i]->crowded_count;
  }
  if (!crowded)
    return true;
  table t = {.bits = 4};
  while ((size_t)1 << t.bits < 3 * crowded)
    t.bits++;
  t.entries = calloc((size_t)1 << t.bits, sizeof *t.entries);
  t.creases = malloc(crowded * sizeof *t.creases);
  t.positions = malloc(crowded * sizeof *t.positions);
  bool done = t.entries && t.creases && t.positions;
  if (done) {
    zs_memory_is_large(t.entries, sizeof *t.entries << t.bits);
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
    for (size_t i = 0; i < job->active_count; i++) {
      const zs_frame frame = zs_brick_frame(job, job->active[i]);
      list_crowded(job->active[i], &frame, job->active[i]->first_crease, &t);
    }
    enter(&t, crowded);
    compare_vertices(job, &t);
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
    for (size_t i = 0; i < job->active_count; i++)
      if (job->active[i]->crowded_count)
        compact_creases(job->active[i]);
  }
  free(t.entries);
  free(t.creases);
  free(t.positions);
  return done || zs_fail_memory(job->diag);
}
