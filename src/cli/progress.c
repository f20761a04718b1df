#include "cli/progress.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static volatile sig_atomic_t caught;

static void catch(int number)
{
  caught = number;
}

void cli_signals_catch(void)
{
  static const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
    struct sigaction action, inherited;
    memset(&action, 0, sizeof action);
    action.sa_handler = catch;
    action.sa_flags = (int)SA_RESETHAND; /* and no SA_RESTART: a blocked read ends too */
    sigemptyset(&action.sa_mask);
    /* What the shell told us to ignore (nohup, background jobs) stays ignored. */
    if (sigaction(numbers[i], NULL, &inherited) == 0 && inherited.sa_handler != SIG_IGN)
      sigaction(numbers[i], &action, NULL);
  }
  signal(SIGXFSZ, SIG_IGN); /* a file that may not grow any more is an error like a full disk */
}

int cli_signal(void)
{
  return caught;
}

double cli_clock(void)
{
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void cli_progress_init(cli_progress *progress, bool wanted)
{
  *progress = (cli_progress){.shown = wanted && isatty(STDERR_FILENO)};
  cli_progress_begin(progress, 0);
}

void cli_progress_begin(cli_progress *progress, double samples)
{
  progress->samples = samples;
  progress->job = cli_clock();
  progress->name[0] = '\0';
}

/* "1.2 M" */
static void put_quantity(char *text, size_t size, double value)
{
  static const char prefixes[] = " kMGTP";
  int order = 0;
  while (value >= 1000 && prefixes[order + 1]) {
    value /= 1000;
    order++;
  }
  snprintf(text, size, "%.3g %.*s", value, order > 0, prefixes + order);
}

/* "41 s", "3 min 05 s", "2 h 10 min" */
static void put_duration(char *text, size_t size, double seconds)
{
  long s = lround(fmin(seconds, 1e8));
  if (s < 60)
    snprintf(text, size, "%ld s", s);
  else if (s < 3600)
    snprintf(text, size, "%ld min %02ld s", s / 60, s % 60);
  else
    snprintf(text, size, "%ld h %02ld min", s / 3600, s / 60 % 60);
}

enum { WIDTH = 28 }; /* of the bar */

static void draw(cli_progress *progress, double fraction, double elapsed)
{
  static const char full[] = "############################";
  static const char bare[] = "----------------------------";
  _Static_assert(sizeof full == WIDTH + 1 && sizeof bare == WIDTH + 1, "bars of equal width");
  int done = (int)(fraction * WIDTH);
  char rate[40] = "", left[40] = "";
  if (progress->samples > 0 && elapsed > 0) {
    char number[24];
    put_quantity(number, sizeof number, progress->samples * fraction / elapsed);
    snprintf(rate, sizeof rate, "  %ssamples/s", number);
  }
  if (fraction > 0 && elapsed > 0) {
    char duration[32];
    put_duration(duration, sizeof duration, elapsed * (1 - fraction) / fraction);
    snprintf(left, sizeof left, "  %s left", duration);
  }
  fprintf(stderr, "\r%-10s [%.*s%.*s] %3d %%%s%s\033[K", progress->name, done, full, WIDTH - done,
          bare, (int)(100 * fraction), rate, left);
  fflush(stderr);
  progress->drawn = true;
}

bool cli_progress_step(void *context, const char *stage, double fraction)
{
  cli_progress *progress = context;
  if (!progress->shown || caught)
    return !caught;
  double now = cli_clock();
  if (strncmp(progress->name, stage, sizeof progress->name - 1) != 0) {
    snprintf(progress->name, sizeof progress->name, "%s", stage);
    progress->stage = now;
  }
  if (now - progress->job > 0.5 && now - progress->last > 0.1) {
    progress->last = now;
    draw(progress, fmin(fmax(fraction, 0), 1), now - progress->stage);
  }
  return true;
}

void cli_progress_clear(void *context)
{
  cli_progress *progress = context;
  if (progress->drawn) {
    fputs("\r\033[K", stderr);
    fflush(stderr);
  }
  progress->drawn = false;
}
