/* What the sections of the benchmark share: which rows are wanted, timing, and
 * the numbers that the last table compares with what they must reach. */
#ifndef ZS_BENCH_H
#define ZS_BENCH_H

#include "zeroset.h"

enum { BENCH_REPEATS = 5, BENCH_SIZES = 3 };

/* A number by its name, such as "spheres-100 mesh 256". */
typedef struct bench_number {
  char name[96];
  double value;
} bench_number;

typedef struct bench {
  bool smoke; /* tiny sizes, each job once: whether it works, not how fast */
  bool wrong; /* an answer differed, or a job failed */
  int words;
  char **word;
  bench_number *numbers;
  size_t count;
} bench;

/* A section of the output. */
typedef void bench_section(bench *b);
bench_section bench_memory, bench_workloads, bench_scalar, bench_handwritten, bench_peers,
  bench_loading, bench_pictures, bench_fits;

/* Whether a row is wanted: no words were given, or its name contains one. */
bool bench_wants(const bench *b, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Whether a word of the command line is exactly this one. */
bool bench_asked(const bench *b, const char *word);

/* The side of a lattice, made small in a smoke test. */
unsigned bench_size(const bench *b, unsigned size);
/* A number of parts, made small in a smoke test. */
unsigned bench_parts(const bench *b, unsigned parts);

void bench_remember(bench *b, double value, const char *format, ...)
  __attribute__((format(printf, 3, 4)));
/* NaN when it was not measured. */
double bench_recall(const bench *b, const char *name);

zs_diag *bench_diag(void);
/* Defaults with so many threads. */
zs_control bench_control(unsigned threads);

/* Seconds.  Jobs on one thread are compared by the processor's time, which
 * other processes on the machine disturb less. */
typedef struct bench_span {
  double wall, processor;
  double all_threads;
  bool failed;
} bench_span;

bench_span bench_now(void);
bench_span bench_since(bench_span begun, bool done);
/* The same for a job of many threads: `processor` is theirs together. */
bench_span bench_since_together(bench_span begun, bool done);

/* One run of a job. */
typedef bench_span bench_job(void *context);

typedef struct bench_time {
  double wall, processor; /* medians */
  unsigned runs;
  bool failed;
} bench_time;

/* Two threads may share a processor for milliseconds after the second one was woken, until the
 * system sees that another processor is idle.  That is not a job's time: wait until two run apart. */
void bench_spread_threads(void);

/* The median of five runs; of three or one when five would take longer than
 * about `budget` seconds. */
bench_time bench_measure(const bench *b, bench_job *job, void *context, double budget);
/* The same of two jobs whose runs take turns, so that a ratio is fair. */
void bench_measure_both(const bench *b, bench_job *first, void *first_context, bench_job *second,
                        void *second_context, double budget, bench_time times[2]);

/* A ratio as text, `text` when there is none. */
const char *bench_ratio(char text[16], double ratio, const char *mark);

/* A child process, its output thrown away. */
typedef struct bench_child {
  bench_span span;
  uint64_t peak_bytes;
} bench_child;
bool bench_run_child(char *const arguments[], bench_child *child);

/* The value of an environment variable, or what stands for it. */
const char *bench_environment(const char *name, const char *otherwise);

#endif
