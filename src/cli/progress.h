/* The progress bar, and Ctrl-C. */
#ifndef CLI_PROGRESS_H
#define CLI_PROGRESS_H

#include <stdbool.h>

typedef struct cli_progress {
  bool shown;         /* standard error is a terminal, and the user did not object */
  bool drawn;         /* a bar stands on the terminal's line */
  double samples;     /* samples of the job, for the rate; 0: not known */
  double job, stage;  /* when they began */
  double last;        /* when the bar was drawn */
  char name[32];      /* of the stage */
} cli_progress;

/* Seconds on a clock that only goes forward. */
double cli_clock(void);

void cli_progress_init(cli_progress *progress, bool wanted);
/* Begin a job of so many samples (0: not known). */
void cli_progress_begin(cli_progress *progress, double samples);
/* A zs_control.progress function: draws the bar, and cancels when a signal came. */
bool cli_progress_step(void *progress, const char *stage, double fraction);
/* Remove the bar from the terminal; the context is the progress. */
void cli_progress_clear(void *progress);

/* From now on SIGINT, SIGTERM and SIGHUP are remembered, so that jobs end
 * cleanly; a second one ends the program at once. */
void cli_signals_catch(void);
/* The signal that came, or 0. */
int cli_signal(void);

#endif
