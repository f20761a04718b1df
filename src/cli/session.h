/* One run of a command on a scene: what it loads, computes, measures. */
#ifndef CLI_SESSION_H
#define CLI_SESSION_H

#include "cli/options.h"
#include "cli/progress.h"
#include "cli/report.h"

typedef struct cli_seconds {
  double load, compile, evaluate, assemble, write;
} cli_seconds;

typedef struct cli_session {
  const cli_options *options;
  cli_reporter reporter;
  cli_progress progress;
  zs_diag diag;
  zs_control control;
  zs_scene *scene;
  zs_field *field;
  double lo[3], hi[3];  /* the box to work in */
  zs_job_report job;
  cli_seconds seconds;  /* of the present frame; load counts for the first */
  double frame_value;   /* of the swept parameter */
  double begun;         /* clock at the start of the present frame */
} cli_session;

/* Load the scene and set its parameters.  False after reporting; the session
 * must be closed either way. */
bool cli_session_open(cli_session *session, const cli_options *options);

/* Free everything; returns the exit status, `done` being whether the command's
 * own work succeeded. */
int cli_session_close(cli_session *session, bool done);

/* Compile an object (NULL: the main one) into session->field. */
bool cli_session_compile(cli_session *session, const char *object);

/* Find the box: --bounds, or the field's own. */
bool cli_session_box(cli_session *session);

/* The grid over the box that --resolution or --cell asks for. */
bool cli_session_grid(cli_session *session, zs_grid *grid);

/* Do the work of one output file, with the field compiled and the box known. */
typedef bool cli_frame(cli_session *session, const char *output);

/* The whole of a command that writes files: once, or for every value of a
 * sweep.  Returns the exit status. */
int cli_session_run(const cli_options *options, cli_frame *frame);

/* Begin the report of a frame on standard output with what all commands
 * report; the caller adds its own members and ends it. */
void cli_session_report(cli_session *session, cli_json *json, const char *output);
void cli_session_report_end(cli_json *json);

/* Whether to print the line that says what was done. */
bool cli_session_talks(const cli_session *session);

#endif
