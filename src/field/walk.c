/* The hierarchical walk that every back end on a lattice is driven by. */
#include "field/program.h"

#include "base/array.h"
#include "base/diagnostic.h"
#include "base/memory.h"
#include "base/threads.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { TASKS_PER_THREAD = 16 /* so that threads finish together */ };

/* Bricks lo <= i < hi, and the program that serves them. */
typedef struct range {
  uint32_t lo[3], hi[3];
  const zs_program *program;
} range;

/* A growing list of ranges. */
typedef struct range_list {
  range *ranges;
  size_t count, capacity;
} range_list;

/* One thread's part of a walk, in cache lines of its own: its arena changes all the time. */
typedef struct walker {
  _Alignas(64) const zs_walk *walk;
  zs_eval *eval;
  zs_arena own;
  zs_arena *arena; /* of programs: `own`, or the caller's */
  unsigned thread;
} walker;

double zs_seconds(void)
{
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

unsigned zs_control_threads(const zs_control *control)
{
  if (control && control->threads)
    return control->threads < ZS_MOST_THREADS ? control->threads : ZS_MOST_THREADS;
  return zs_processors();
}

bool zs_control_allows(const zs_control *control, double bytes)
{
  return !control || !control->memory_limit || bytes <= (double)control->memory_limit;
}

static bool is_brick(const range *r)
{
  return r->hi[0] - r->lo[0] == 1 && r->hi[1] - r->lo[1] == 1 && r->hi[2] - r->lo[2] == 1;
}

/* Sizes of the parts that a range splits into, in bricks: the longest side is
 * halved until there are as many parts as lanes. */
static void part_size(const range *r, uint32_t size[3])
{
  for (int k = 0; k < 3; k++)
    size[k] = r->hi[k] - r->lo[k];
  for (unsigned parts = 1; parts < ZS_LANES; parts *= 2) {
    int longest = 2;
    for (int k = 1; k >= 0; k--)
      if (size[k] > size[longest])
        longest = k;
    size[longest] = (size[longest] + 1) / 2;
  }
}

/* Split a range; the parts are in z, y, x order. */
static unsigned split(const range *whole, range parts[ZS_LANES])
{
  uint32_t size[3], at[3];
  unsigned count = 0;
  part_size(whole, size);
  for (at[2] = whole->lo[2]; at[2] < whole->hi[2]; at[2] += size[2])
    for (at[1] = whole->lo[1]; at[1] < whole->hi[1]; at[1] += size[1])
      for (at[0] = whole->lo[0]; at[0] < whole->hi[0]; at[0] += size[0]) {
        range *part = &parts[count++];
        *part = (range){.program = whole->program};
        for (int k = 0; k < 3; k++) {
          part->lo[k] = at[k];
          part->hi[k] = whole->hi[k] - at[k] < size[k] ? whole->hi[k] : at[k] + size[k];
        }
      }
  return count;
}

/* The boxes of the ranges, with their margins, relative to `origin`, rounded outward;
 * idle lanes repeat the last. */
static void range_boxes(const zs_walk *walk, const range *ranges, unsigned n,
                        const double origin[3], zs_boxes *boxes)
{
  for (unsigned l = 0; l < ZS_LANES; l++) {
    const range *r = &ranges[l < n ? l : n - 1];
    double lo[3], hi[3];
    for (int k = 0; k < 3; k++) {
      lo[k] = walk->lo[k] + walk->size[k] * r->lo[k] - walk->margin[k];
      hi[k] = walk->lo[k] + walk->size[k] * r->hi[k] + walk->margin[k];
    }
    zs_boxes_set(boxes, l, lo, hi, origin);
  }
}

/* Decide what bounds can for the parts of one range; what is left
 * gets its regional program in `w->arena` and moves to the front.  Returns how
 * many are left. */
static unsigned decide(walker *w, range *parts, unsigned n)
{
  const zs_walk *walk = w->walk;
  const zs_program *program = parts[0].program;
  double origin[3];
  for (int k = 0; k < 3; k++)
    origin[k] = walk->lo[k] + walk->size[k] * 0.5 * (parts[0].lo[k] + (double)parts[n - 1].hi[k]);
  zs_frame frame = zs_frame_at(origin);
  zs_boxes boxes;
  zs_bounds f;
  range_boxes(walk, parts, n, origin, &boxes);
  zs_program_bounds(w->eval, program, &frame, &boxes, &f);
  unsigned undecided = 0, left = 0;
  for (unsigned l = 0; l < n; l++) {
    if (walk->uniform && (f.lo[l] >= 0 || f.hi[l] < 0))
      walk->uniform(walk->visitor, parts[l].lo, parts[l].hi, f.lo[l] >= 0);
    else
      undecided |= 1u << l;
  }
  if (!undecided)
    return 0;
  const zs_program *programs[ZS_LANES];
  zs_program_restrict_lanes(w->eval, program, undecided, walk->request, w->arena, programs);
  for (unsigned l = 0; l < n; l++) {
    if (undecided >> l & 1) {
      parts[left] = parts[l];
      parts[left++].program = programs[l];
    }
  }
  return left;
}

/* What is left of a range when it is split. */
typedef struct refined {
  range parts[ZS_LANES];
  unsigned count;
} refined;

static void refine_range(walker *w, const range *whole, refined *result)
{
  if (is_brick(whole)) {
    result->parts[0] = *whole;
    result->count = 1;
    return;
  }
  result->count = split(whole, result->parts);
  if (!w->walk->control || !w->walk->control->brute)
    result->count = decide(w, result->parts, result->count);
}

static void walk_range(walker *w, const range *whole)
{
  if (is_brick(whole)) {
    w->walk->brick(w->walk->visitor, w->thread, whole->lo, w->eval, whole->program);
    return;
  }
  refined r;
  zs_arena_mark mark = zs_arena_mark_here(w->arena);
  refine_range(w, whole, &r);
  for (unsigned l = 0; l < r.count; l++)
    walk_range(w, &r.parts[l]);
  if (!w->walk->programs)
    zs_arena_rewind(w->arena, mark);
}

static bool add(range_list *list, const range *r)
{
  range *ranges =
    zs_array_grown(list->ranges, list->count + 1, &list->capacity, sizeof *ranges);
  if (!ranges)
    return false;
  list->ranges = ranges;
  ranges[list->count++] = *r;
  return true;
}

/* Replace every range of a list by what is left of its parts.  Early ranges have the
 * longest programs, which makes them worth sharing among the threads. */
static bool refine(walker *walkers, unsigned threads, range_list *list)
{
  const size_t count = list->count;
  refined *results = malloc((count ? count : 1) * sizeof *results);
  if (!results)
    return false;
  const unsigned busy = count < threads ? (unsigned)count : threads;
#pragma omp parallel for schedule(dynamic, 1) num_threads(busy ? busy : 1)
  for (size_t i = 0; i < count; i++)
    refine_range(&walkers[zs_thread_number()], &list->ranges[i], &results[i]);
  bool done = true;
  list->count = 0;
  for (size_t i = 0; i < count; i++)
    for (unsigned l = 0; done && l < results[i].count; l++)
      done = add(list, &results[i].parts[l]);
  free(results);
  return done;
}

static bool all_bricks(const range_list *list)
{
  for (size_t i = 0; i < list->count; i++)
    if (!is_brick(&list->ranges[i]))
      return false;
  return true;
}

/* Cut the lattice into enough ranges to share among the threads. */
static bool make_tasks(walker *walkers, unsigned threads, range_list *tasks)
{
  const zs_walk *walk = walkers[0].walk;
  range whole = {.program = zs_field_program(walk->field)};
  memcpy(whole.hi, walk->count, sizeof whole.hi);
  if (!add(tasks, &whole))
    return false;
  do {
    if (!refine(walkers, threads, tasks))
      return false;
  } while (tasks->count < (size_t)threads * TASKS_PER_THREAD && !all_bricks(tasks));
  return true;
}

static bool report_progress(const zs_walk *walk, double done)
{
  const zs_control *control = walk->control;
  if (!control || !control->progress)
    return true;
  double fraction = walk->progress_from + (walk->progress_to - walk->progress_from) * done;
  return control->progress(control->context, walk->stage, fraction);
}

/* Share the tasks among the threads.  False when cancelled. */
static bool run_tasks(walker *walkers, unsigned threads, const range_list *tasks)
{
  const zs_walk *walk = walkers[0].walk;
  atomic_size_t finished = 0;
  atomic_bool cancelled = false;
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
  for (size_t i = 0; i < tasks->count; i++) {
    if (atomic_load_explicit(&cancelled, memory_order_relaxed))
      continue;
    unsigned thread = zs_thread_number();
    walk_range(&walkers[thread], &tasks->ranges[i]);
    size_t done = atomic_fetch_add_explicit(&finished, 1, memory_order_relaxed) + 1;
    if (thread == 0 && !report_progress(walk, (double)done / (double)tasks->count))
      atomic_store_explicit(&cancelled, true, memory_order_relaxed);
  }
  return !cancelled;
}

bool zs_walk_run(const zs_walk *walk, zs_diag *diag)
{
  unsigned threads = zs_control_threads(walk->control);
  walker *walkers = zs_memory_zeroed(threads, sizeof *walkers);
  if (!walkers)
    return zs_fail_memory(diag);
  bool ready = true;
  for (unsigned t = 0; ready && t < threads; t++) {
    walkers[t] = (walker){.walk = walk, .thread = t};
    walkers[t].arena = walk->programs ? &walk->programs[t] : &walkers[t].own;
    walkers[t].eval = zs_eval_new(walk->field, diag);
    ready = walkers[t].eval != NULL;
  }
  bool done = false;
  range_list tasks = {0};
  if (ready) {
    if (!make_tasks(walkers, threads, &tasks))
      zs_fail_memory(diag);
    else if (!report_progress(walk, 0) || !run_tasks(walkers, threads, &tasks))
      zs_fail(diag, ZS_CANCELLED, NULL, "cancelled");
    else
      done = true;
  }
  free(tasks.ranges);
  for (unsigned t = 0; t < threads; t++) {
    zs_eval_free(walkers[t].eval);
    zs_arena_free(&walkers[t].own);
  }
  free(walkers);
  return done;
}
