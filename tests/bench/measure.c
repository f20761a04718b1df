#include "bench.h"

#include "base/threads.h"

#include <fcntl.h>
#include <math.h>
#include <sched.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>

extern char **environ;

bool bench_wants(const bench *b, const char *format, ...)
{
  char name[96];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(name, sizeof name, format, arguments);
  va_end(arguments);
  for (int i = 0; i < b->words; i++)
    if (strstr(name, b->word[i]))
      return true;
  return b->words == 0;
}

bool bench_asked(const bench *b, const char *word)
{
  for (int i = 0; i < b->words; i++)
    if (!strcmp(b->word[i], word))
      return true;
  return false;
}

unsigned bench_size(const bench *b, unsigned size)
{
  return b->smoke ? size / 16 : size;
}

unsigned bench_parts(const bench *b, unsigned parts)
{
  return b->smoke && parts > 300 ? 300 : parts;
}

void bench_remember(bench *b, double value, const char *format, ...)
{
  bench_number *numbers = realloc(b->numbers, (b->count + 1) * sizeof *numbers);
  if (!numbers)
    abort();
  b->numbers = numbers;
  bench_number *number = &numbers[b->count++];
  number->value = value;
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(number->name, sizeof number->name, format, arguments);
  va_end(arguments);
}

double bench_recall(const bench *b, const char *name)
{
  for (size_t i = 0; i < b->count; i++)
    if (!strcmp(b->numbers[i].name, name))
      return b->numbers[i].value;
  return NAN;
}

static void complain(void *context, const zs_diagnostic *d)
{
  (void)context;
  fprintf(stderr, "bench: %s:%u:%u: %s\n", d->file ? d->file : "", d->line, d->column, d->message);
}

zs_diag *bench_diag(void)
{
  static zs_diag diag = {.report = complain};
  return &diag;
}

static double seconds_of(clockid_t clock)
{
  struct timespec now;
  clock_gettime(clock, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

bench_span bench_now(void)
{
  return (bench_span){.wall = seconds_of(CLOCK_MONOTONIC),
                      .processor = seconds_of(CLOCK_THREAD_CPUTIME_ID),
                      .all_threads = seconds_of(CLOCK_PROCESS_CPUTIME_ID)};
}

bench_span bench_since(bench_span begun, bool done)
{
  bench_span now = bench_now();
  return (bench_span){.wall = now.wall - begun.wall,
                      .processor = now.processor - begun.processor,
                      .all_threads = now.all_threads - begun.all_threads,
                      .failed = !done};
}

bench_span bench_since_together(bench_span begun, bool done)
{
  bench_span taken = bench_since(begun, done);
  taken.processor = taken.all_threads;
  return taken;
}

zs_control bench_control(unsigned threads)
{
  zs_control control;
  zs_control_init(&control);
  control.threads = threads;
  return control;
}

void bench_spread_threads(void)
{
  const double round = 1e-3, patience = 0.1; /* seconds */
  const double begun = bench_now().wall;
  bool apart = zs_processors() < 2;
  while (!apart && bench_now().wall - begun < patience) {
    int processor[2] = {0};
#pragma omp parallel num_threads(2)
    {
      const double from = bench_now().wall;
      while (bench_now().wall - from < round)
        processor[zs_thread_number()] = sched_getcpu();
    }
    apart = processor[0] != processor[1];
  }
}

static int ascending(const void *a, const void *b)
{
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* The runs of a job so far. */
typedef struct runs {
  double wall[BENCH_REPEATS], processor[BENCH_REPEATS], spent;
  unsigned count;
  bool failed;
} runs;

static void run_once(runs *r, bench_job *job, void *context)
{
  bench_span taken = job(context);
  r->failed = r->failed || taken.failed;
  r->wall[r->count] = taken.wall;
  r->processor[r->count++] = taken.processor;
  r->spent += taken.wall;
}

/* Whether two more runs are too much.  The first run may pay for memory that the others
 * find ready: unless it takes long, it is not to be the only one. */
static bool enough(const bench *b, const runs *r, double budget)
{
  const double least = 12; /* seconds for three runs */
  return r->failed || b->smoke || r->count == BENCH_REPEATS ||
         r->spent * (r->count + 2) / r->count > (r->count == 1 ? fmax(budget, least) : budget);
}

static bench_time median(runs *r)
{
  qsort(r->wall, r->count, sizeof *r->wall, ascending);
  qsort(r->processor, r->count, sizeof *r->processor, ascending);
  unsigned middle = r->count / 2;
  return (bench_time){r->wall[middle], r->processor[middle], r->count, r->failed};
}

bench_time bench_measure(const bench *b, bench_job *job, void *context, double budget)
{
  runs r = {0};
  run_once(&r, job, context);
  while (!enough(b, &r, budget))
    for (int i = 0; i < 2; i++)
      run_once(&r, job, context);
  return median(&r);
}

void bench_measure_both(const bench *b, bench_job *first, void *first_context, bench_job *second,
                        void *second_context, double budget, bench_time times[2])
{
  runs r[2] = {0};
  do {
    for (int i = r[0].count ? 2 : 1; i > 0; i--) {
      run_once(&r[0], first, first_context);
      bench_spread_threads();
      run_once(&r[1], second, second_context);
    }
  } while (!enough(b, &r[0], budget / 2) && !enough(b, &r[1], budget / 2));
  for (int i = 0; i < 2; i++)
    times[i] = median(&r[i]);
}

const char *bench_ratio(char text[16], double ratio, const char *mark)
{
  text[0] = '\0';
  if (ratio > 0 && ratio < 1e9)
    snprintf(text, 16, "%.*fx%s", ratio < 9.995 ? 2 : 1, ratio, mark);
  return text;
}

static double seconds_of_pair(struct timeval t)
{
  return (double)t.tv_sec + 1e-6 * (double)t.tv_usec;
}

bool bench_run_child(char *const arguments[], bench_child *child)
{
  posix_spawn_file_actions_t actions;
  if (posix_spawn_file_actions_init(&actions))
    return false;
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t pid;
  bench_span begun = bench_now();
  int failed = posix_spawnp(&pid, arguments[0], &actions, NULL, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  int status;
  struct rusage usage;
  if (failed || wait4(pid, &status, 0, &usage) != pid)
    return false;
  bool done = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  child->span = bench_since(begun, done);
  child->span.processor = seconds_of_pair(usage.ru_utime) + seconds_of_pair(usage.ru_stime);
  child->peak_bytes = (uint64_t)usage.ru_maxrss * 1024;
  return done;
}

const char *bench_environment(const char *name, const char *otherwise)
{
  const char *value = getenv(name);
  return value && *value ? value : otherwise;
}
