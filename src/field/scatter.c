/* Points all over the place: many of them, for a program that is shorter near each.
 *
 * The points are split into sixteen groups, each by the middle of the longest side of its box;
 * bounds over these boxes give every group a program of its own, and groups that are still
 * large, of programs still long, are split again.  A point costs what is near it, and its share
 * of the bounds: n points of a program of length l, of which a few instructions matter at each,
 * cost O(n log n + l) instead of O(n l). */
#include "field/field.h"

#include <math.h>
#include <string.h>

/* Bounds of sixteen boxes and programs for them take as long as about a thousand points; to group
 * points takes as long as some hundred instructions for each. */
enum {
  LEAST_LENGTH = 600,  /* of programs worth shortening, ... */
  LEAST_POINTS = 2048, /* ... for so many points */
  MOST_FAILURES = 2,   /* in a row to make it shorter */
  MOST_LEVELS = 24
};

typedef struct scatter {
  zs_eval *eval;
  zs_frame frame;
  const zs_points *points;
  size_t first; /* point of the chunk */
  uint32_t *index;
} scatter;

/* Points from .. to - 1 of the index, and the box around them. */
typedef struct group {
  uint32_t from, to;
  float lo[3], hi[3];
} group;

static float coordinate(const scatter *s, uint32_t at, int axis)
{
  return s->points->at[axis][s->first + s->index[at]];
}

static void find_box(const scatter *s, group *g)
{
  for (int k = 0; k < 3; k++) {
    float lo = INFINITY, hi = -INFINITY;
    for (uint32_t i = g->from; i < g->to; i++) {
      const float t = coordinate(s, i, k);
      lo = t < lo ? t : lo;
      hi = t > hi ? t : hi;
    }
    g->lo[k] = lo;
    g->hi[k] = hi;
  }
}

/* Split a group into itself and another one; false when all its points are in one place. */
static bool split_group(const scatter *s, group *g, group *other)
{
  int axis = 0;
  for (int k = 1; k < 3; k++)
    if (g->hi[k] - g->lo[k] > g->hi[axis] - g->lo[axis])
      axis = k;
  const float middle = g->lo[axis] / 2 + g->hi[axis] / 2;
  uint32_t below = g->from;
  for (uint32_t i = g->from; i < g->to; i++)
    if (coordinate(s, i, axis) < middle) {
      const uint32_t index = s->index[i];
      s->index[i] = s->index[below];
      s->index[below++] = index;
    }
  if (below == g->from || below == g->to)
    return false;
  *other = (group){.from = below, .to = g->to};
  g->to = below;
  find_box(s, g);
  find_box(s, other);
  return true;
}

/* As many groups as bounds are taken of at once, or fewer, in the index's order; the largest are
 * split first. */
static unsigned split_all(const scatter *s, const group *whole, group groups[ZS_LANES])
{
  unsigned count = 1;
  groups[0] = *whole;
  while (count < ZS_LANES) {
    unsigned largest = 0;
    for (unsigned l = 1; l < count; l++)
      if (groups[l].to - groups[l].from > groups[largest].to - groups[largest].from)
        largest = l;
    group other;
    if (!split_group(s, &groups[largest], &other))
      break;
    memmove(&groups[largest + 2], &groups[largest + 1], (count - largest - 1) * sizeof *groups);
    groups[largest + 1] = other;
    count++;
  }
  return count;
}

static void evaluate(const scatter *s, const zs_program *program, uint32_t from, uint32_t to)
{
  zs_points_evaluate(s->eval, program, &s->frame, s->points, s->first, s->index + from, to - from);
}

static void set_boxes(const group *groups, unsigned count, zs_boxes *boxes)
{
  for (unsigned l = 0; l < ZS_LANES; l++)
    for (int k = 0; k < 3; k++) {
      boxes->axis[k].lo[l] = groups[l < count ? l : 0].lo[k];
      boxes->axis[k].hi[l] = groups[l < count ? l : 0].hi[k];
    }
}

static bool is_worth_it(const zs_program *program, uint32_t count, unsigned failures)
{
  return count >= LEAST_POINTS && failures < MOST_FAILURES && zs_program_choices(program) &&
         zs_program_length(program) >= LEAST_LENGTH;
}

/* What becomes of a group. */
typedef struct fate {
  const zs_program *program;
  unsigned failures; /* levels in a row, this one the last, at which it did not get shorter */
  bool goes_on;      /* it is split again */
} fate;

static void find_fates(const scatter *s, const zs_program *program, const group *groups,
                       unsigned count, unsigned failures, fate fates[ZS_LANES])
{
  const zs_program *programs[ZS_LANES];
  const zs_request request = s->points->rows > 1 ? ZS_REQUEST_GRADIENT : ZS_REQUEST_VALUE;
  zs_boxes boxes;
  zs_bounds f;
  set_boxes(groups, count, &boxes);
  zs_program_bounds(s->eval, program, &s->frame, &boxes, &f);
  zs_program_restrict_choices(s->eval, program, (1u << count) - 1, request, &s->eval->arena,
                              programs);
  for (unsigned l = 0; l < count; l++) {
    const unsigned failed = programs[l] == program ? failures + 1 : 0;
    const uint32_t points = groups[l].to - groups[l].from;
    fates[l] = (fate){programs[l], failed, count > 1 && is_worth_it(programs[l], points, failed)};
  }
}

static void visit(const scatter *s, const zs_program *program, const group *whole, unsigned level,
                  unsigned failures)
{
  group groups[ZS_LANES];
  fate fates[ZS_LANES];
  const unsigned count = split_all(s, whole, groups);
  const zs_arena_mark mark = zs_arena_mark_here(&s->eval->arena);
  find_fates(s, program, groups, count, failures, fates);
  for (unsigned l = 0, next; l < count; l = next) {
    next = l + 1;
    if (fates[l].goes_on && level < MOST_LEVELS) {
      visit(s, fates[l].program, &groups[l], level + 1, fates[l].failures);
      continue;
    }
    while (next < count && fates[next].program == fates[l].program && !fates[next].goes_on)
      next++;
    evaluate(s, fates[l].program, groups[l].from, groups[next - 1].to);
  }
  zs_arena_rewind(&s->eval->arena, mark);
}

/* The points with three numbers first; how many these are. */
static uint32_t list_points(const scatter *s, uint32_t count)
{
  uint32_t known = 0, unknown = count;
  for (uint32_t i = 0; i < count; i++) {
    bool finite = true;
    for (int k = 0; k < 3; k++)
      finite = finite && isfinite(s->points->at[k][s->first + i]);
    s->index[finite ? known++ : --unknown] = i;
  }
  return known;
}

bool zs_scatter_pays(const zs_program *program, size_t count)
{
  return is_worth_it(program, count < ZS_SCATTER_CHUNK ? (uint32_t)count : ZS_SCATTER_CHUNK, 0);
}

void zs_scatter_evaluate(zs_eval *eval, const zs_program *program, const zs_frame *frame,
                         const zs_points *points, size_t count)
{
  scatter s = {.eval = eval, .frame = *frame, .points = points, .index = eval->index};
  for (; s.first < count; s.first += ZS_SCATTER_CHUNK) {
    const size_t left = count - s.first;
    const uint32_t chunk = left < ZS_SCATTER_CHUNK ? (uint32_t)left : ZS_SCATTER_CHUNK;
    group all = {.to = list_points(&s, chunk)};
    find_box(&s, &all);
    if (all.to)
      visit(&s, program, &all, 0, 0);
    evaluate(&s, program, all.to, chunk);
  }
}
