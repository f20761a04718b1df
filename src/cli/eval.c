#include "base/threads.h"
#include "cli/commands.h"
#include "cli/session.h"
#include "cli/text.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Points come in chunks of whatever standard input has ready, so that another
 * program can converse with this one, and are answered before the next read. */
enum {
  INPUT_BYTES = 1 << 20,
  INPUT_POINTS = INPUT_BYTES / 6 + 1, /* "0 0 0\n" is the shortest text of a point */
  POINTS_PER_THREAD = 4096,           /* fewer are not worth waking one for */
  MAXIMUM_THREADS = 64
};

typedef struct evaluator {
  cli_session *session;
  zs_eval *eval[MAXIMUM_THREADS];
  unsigned threads;
  double origin[3];  /* points are evaluated relative to it */
  float *point[3];   /* INPUT_POINTS each, like the results: */
  float *result[4];  /* f, and its gradient */
  unsigned results;  /* per point: 1 or 4 */
  size_t count;      /* points waiting */
  char *input;
  unsigned long line;
} evaluator;

static unsigned thread_count(const cli_options *options)
{
  const unsigned wanted = options->threads ? options->threads : zs_processors();
  return wanted < MAXIMUM_THREADS ? wanted : MAXIMUM_THREADS;
}

/* Single precision is enough near the origin; a scene far from it is evaluated
 * around its middle. */
static void choose_origin(evaluator *e)
{
  double lo[3], hi[3];
  if (!zs_field_box(e->session->field, lo, hi, NULL))
    return;
  for (int k = 0; k < 3; k++) {
    double middle = 0.5 * (lo[k] + hi[k]);
    if (fabs(middle) > 8 * (hi[k] - lo[k]))
      e->origin[k] = middle;
  }
}

static bool evaluator_open(evaluator *e, cli_session *session)
{
  *e = (evaluator){.session = session, .results = session->options->gradient ? 4 : 1};
  choose_origin(e);
  e->input = malloc(INPUT_BYTES + 1);
  bool good = e->input;
  for (unsigned k = 0; k < 3; k++)
    good &= (e->point[k] = malloc(INPUT_POINTS * sizeof(float))) != NULL;
  for (unsigned k = 0; k < e->results; k++)
    good &= (e->result[k] = malloc(INPUT_POINTS * sizeof(float))) != NULL;
  if (!good)
    return cli_error("out of memory");
  unsigned threads = thread_count(session->options);
  for (; e->threads < threads; e->threads++)
    if (!(e->eval[e->threads] = zs_eval_new(session->field, &session->diag)))
      return false;
  return true;
}

static void evaluator_close(evaluator *e)
{
  for (unsigned i = 0; i < e->threads; i++)
    zs_eval_free(e->eval[i]);
  for (unsigned k = 0; k < 3; k++)
    free(e->point[k]);
  for (unsigned k = 0; k < 4; k++)
    free(e->result[k]);
  free(e->input);
}

static void add_point(evaluator *e, const double point[3])
{
  for (int k = 0; k < 3; k++)
    e->point[k][e->count] = (float)(point[k] - e->origin[k]);
  e->count++;
}

static void evaluate_range(evaluator *e, zs_eval *eval, size_t first, size_t last)
{
  const float *x = e->point[0] + first, *y = e->point[1] + first, *z = e->point[2] + first;
  float *const *r = e->result;
  if (e->results == 1)
    zs_eval_values(eval, e->origin, last - first, x, y, z, r[0] + first);
  else
    zs_eval_gradients(eval, e->origin, last - first, x, y, z, r[0] + first, r[1] + first,
                      r[2] + first, r[3] + first);
}

static void evaluate(evaluator *e)
{
  size_t wanted = (e->count + POINTS_PER_THREAD - 1) / POINTS_PER_THREAD;
  int threads = (int)(wanted < e->threads ? wanted : e->threads);
#pragma omp parallel for num_threads(threads) if (threads > 1)
  for (int i = 0; i < threads; i++)
    evaluate_range(e, e->eval[i], e->count * (size_t)i / (size_t)threads,
                   e->count * (size_t)(i + 1) / (size_t)threads);
}

static void write_text(const evaluator *e)
{
  for (size_t i = 0; i < e->count; i++)
    for (unsigned k = 0; k < e->results; k++)
      printf("%.9g%c", (double)e->result[k][i], k + 1 == e->results ? '\n' : ' ');
}

static void write_binary(const evaluator *e)
{
  for (size_t i = 0; i < e->count; i++) {
    double values[4];
    for (unsigned k = 0; k < e->results; k++)
      values[k] = (double)e->result[k][i];
    fwrite(values, sizeof *values, e->results, stdout);
  }
}

/* Evaluate and write the waiting points. */
static bool answer(evaluator *e)
{
  if (e->count) {
    evaluate(e);
    (e->session->options->binary ? write_binary : write_text)(e);
    e->count = 0;
  }
  return fflush(stdout) == 0; /* main says why not */
}

static bool wrong_input(evaluator *e, const char *problem)
{
  e->session->diag.errors++;
  e->session->diag.status = ZS_ERROR_IO;
  if (e->line)
    fprintf(stderr, "<stdin>:%lu: error: %s\n", e->line, problem);
  else
    fprintf(stderr, "<stdin>: error: %s\n", problem);
  return false;
}

/* One line, ended by a NUL: a point, or nothing but a comment. */
static bool take_line(evaluator *e, char *line)
{
  e->line++;
  char *comment = strchr(line, '#');
  if (comment)
    *comment = '\0';
  if (line[strspn(line, " \t\r\f\v")] == '\0')
    return true;
  double point[3];
  if (cli_numbers_parse(line, point, 3) == 3) {
    add_point(e, point);
    return true;
  }
  char problem[80];
  snprintf(problem, sizeof problem, "expected three numbers \"x y z\", found '%.32s'", line);
  for (char *c = problem; *c; c++)
    if ((unsigned char)*c < ' ')
      *c = ' ';
  return wrong_input(e, problem);
}

/* The whole lines among `length` bytes of input; returns how many bytes they
 * were, or -1 after an error. */
static ptrdiff_t take_lines(evaluator *e, size_t length)
{
  char *line = e->input, *end;
  size_t left = length;
  while ((end = memchr(line, '\n', left))) {
    *end = '\0';
    if (strlen(line) != (size_t)(end - line)) {
      e->line++;
      return wrong_input(e, "the text contains a NUL byte; is it --binary?") - 1;
    }
    if (!take_line(e, line))
      return -1;
    left -= (size_t)(end + 1 - line);
    line = end + 1;
  }
  return line - e->input;
}

/* The whole points among `length` bytes; returns how many bytes they were. */
static ptrdiff_t take_points(evaluator *e, size_t length)
{
  size_t count = length / (3 * sizeof(double));
  for (size_t i = 0; i < count; i++) {
    double point[3];
    memcpy(point, e->input + i * sizeof point, sizeof point);
    add_point(e, point);
  }
  return (ptrdiff_t)(count * 3 * sizeof(double));
}

/* What follows the last newline, or the last whole binary point. */
static bool take_rest(evaluator *e, size_t length)
{
  if (length == 0)
    return true;
  if (e->session->options->binary)
    return wrong_input(e, "the input ends inside a point");
  e->input[length] = '\0';
  return take_line(e, e->input);
}

static bool stream(evaluator *e)
{
  size_t held = 0;
  for (;;) {
    ssize_t got = read(STDIN_FILENO, e->input + held, INPUT_BYTES - held);
    if (got < 0 && errno == EINTR) {
      if (cli_signal())
        return false;
      continue;
    }
    if (got < 0)
      return wrong_input(e, strerror(errno));
    if (got == 0)
      break;
    held += (size_t)got;
    ptrdiff_t taken =
      e->session->options->binary ? take_points(e, held) : take_lines(e, held);
    if (!answer(e) || taken < 0 || cli_signal())
      return false;
    if (taken == 0 && held == INPUT_BYTES) {
      e->line++;
      return wrong_input(e, "the line is longer than a megabyte");
    }
    held -= (size_t)taken;
    memmove(e->input, e->input + taken, held);
  }
  bool good = take_rest(e, held);
  return answer(e) && good;
}

int cli_eval(const cli_options *options)
{
  cli_session session;
  evaluator e = {0};
  bool done = cli_session_open(&session, options) &&
              cli_session_compile(&session, options->object);
  if (done) {
    cli_progress_clear(&session.progress);
    done = evaluator_open(&e, &session) && stream(&e);
    evaluator_close(&e);
  }
  return cli_session_close(&session, done);
}
