#include "cli/session.h"

#include "cli/text.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- Loading ----------------------------------------------------------- */

enum { READ_STEP = 1 << 16 };

/* All of standard input, in memory for free(); NULL after an error. */
static char *read_input(size_t *length, uint64_t limit)
{
  char *text = NULL;
  size_t capacity = 0;
  *length = 0;
  do {
    if (capacity - *length < READ_STEP) {
      capacity = 2 * capacity + READ_STEP;
      char *grown = realloc(text, capacity);
      if (!grown) {
        free(text);
        cli_error("<stdin>: out of memory");
        return NULL;
      }
      text = grown;
    }
    *length += fread(text + *length, 1, capacity - *length, stdin);
  } while (!feof(stdin) && !ferror(stdin) && *length <= limit);
  if (!ferror(stdin))
    return text;
  if (!cli_signal())
    cli_error("<stdin>: %s", strerror(errno));
  free(text);
  return NULL;
}

static zs_scene *load_input(cli_session *session, const zs_scene_options *options)
{
  size_t length;
  char *text = read_input(&length, options->maximum_file_size);
  if (!text) {
    session->diag.errors++;
    session->diag.status = ZS_ERROR_IO;
    return NULL;
  }
  zs_scene *scene = zs_scene_parse(text, length, "<stdin>", options, &session->diag);
  free(text);
  return scene;
}

static bool set_parameter(cli_session *session, const cli_setting *setting, double value)
{
  char *name = strndup(setting->name, setting->length);
  if (!name)
    return cli_error("out of memory");
  bool good = zs_scene_set(session->scene, name, value, &session->diag);
  free(name);
  return good;
}

static bool load(cli_session *session)
{
  const cli_options *options = session->options;
  zs_scene_options scene_options;
  zs_scene_options_init(&scene_options);
  scene_options.allow_paths = options->allow_paths;
  scene_options.allow_path_count = options->allow_path_count;
  if (strcmp(options->scene, "-") == 0)
    session->scene = load_input(session, &scene_options);
  else
    session->scene = zs_scene_load(options->scene, &scene_options, &session->diag);
  return session->scene;
}

static void start(cli_session *session, const cli_options *options)
{
  memset(session, 0, sizeof *session);
  session->options = options;
  session->begun = cli_clock();
  cli_reporter_init(&session->reporter, options->quiet);
  cli_progress_init(&session->progress, !options->quiet && !options->no_progress);
  session->reporter.before = cli_progress_clear;
  session->reporter.context = &session->progress;
  session->diag.report = cli_report;
  session->diag.context = &session->reporter;
  zs_control_init(&session->control);
  session->control.threads = options->threads;
  session->control.memory_limit = options->memory;
  session->control.brute = options->brute;
  session->control.progress = cli_progress_step;
  session->control.context = &session->progress;
}

bool cli_session_open(cli_session *session, const cli_options *options)
{
  start(session, options);
  if (!load(session))
    return false;
  bool good = true;
  for (size_t i = 0; i < options->setting_count; i++)
    good &= set_parameter(session, &options->settings[i], options->settings[i].value);
  session->seconds.load = cli_clock() - session->begun;
  return good;
}

int cli_session_close(cli_session *session, bool done)
{
  cli_progress_clear(&session->progress);
  zs_field_unref(session->field);
  zs_scene_free(session->scene);
  cli_reporter_clear(&session->reporter);
  if (done)
    return CLI_DONE;
  if (cli_signal())
    return CLI_SIGNALLED + cli_signal();
  return session->diag.errors ? cli_exit_status(session->diag.status) : CLI_UNABLE;
}

/* ---- Compiling --------------------------------------------------------- */

bool cli_session_compile(cli_session *session, const char *object)
{
  double begun = cli_clock();
  zs_field_unref(session->field);
  cli_progress_begin(&session->progress, 0);
  session->field = zs_scene_compile(session->scene, object, &session->control, &session->diag);
  session->seconds.compile = cli_clock() - begun;
  return session->field;
}

bool cli_session_box(cli_session *session)
{
  const cli_options *options = session->options;
  if (!options->has_bounds)
    return zs_field_box(session->field, session->lo, session->hi, &session->diag);
  memcpy(session->lo, options->bounds, sizeof session->lo);
  memcpy(session->hi, options->bounds + 3, sizeof session->hi);
  return true;
}

enum { DEFAULT_RESOLUTION = 128 };

bool cli_session_grid(cli_session *session, zs_grid *grid)
{
  const cli_options *options = session->options;
  if (options->has_cell)
    return zs_grid_fit_cell(grid, session->lo, session->hi, options->cell, &session->diag);
  uint32_t resolution = options->resolution ? options->resolution : DEFAULT_RESOLUTION;
  return zs_grid_fit(grid, session->lo, session->hi, resolution, &session->diag);
}

/* ---- Frames ------------------------------------------------------------ */

static bool wrong_output(cli_session *session, const char *output, const char *reason)
{
  session->diag.errors++;
  session->diag.status = ZS_ERROR_IO;
  return cli_error("%s: cannot be written: %s", output, reason);
}

/* Find out before the work is done, not after, that its result has no place. */
static bool output_possible(cli_session *session, const char *output)
{
  struct stat status;
  if (stat(output, &status) == 0 && S_ISDIR(status.st_mode))
    return wrong_output(session, output, "it is a folder");
  const char *slash = strrchr(output, '/');
  char *folder = slash == output ? strdup("/")
                 : slash         ? strndup(output, (size_t)(slash - output))
                                 : strdup(".");
  if (!folder)
    return wrong_output(session, output, strerror(errno));
  bool possible = access(folder, W_OK | X_OK) == 0;
  free(folder);
  return possible || wrong_output(session, output, strerror(errno));
}

static bool run_frame(cli_session *session, cli_frame *frame, const char *output)
{
  return output_possible(session, output) &&
         cli_session_compile(session, session->options->object) && cli_session_box(session) &&
         frame(session, output);
}

static double sweep_value(const cli_options *options, unsigned index)
{
  double from = options->sweep_from.value, to = options->sweep_to;
  if (index + 1 == options->sweep_count)
    return index == 0 ? from : to;
  return from + (to - from) * ((double)index / (options->sweep_count - 1));
}

static bool run_sweep(cli_session *session, cli_frame *frame)
{
  const cli_options *options = session->options;
  /* A parameter's range that holds both ends holds all between: no frame is written in vain. */
  if (!set_parameter(session, &options->sweep_from, sweep_value(options, options->sweep_count - 1)))
    return false;
  for (unsigned i = 0; i < options->sweep_count; i++) {
    if (cli_signal())
      return false;
    if (i > 0) {
      session->begun = cli_clock();
      session->seconds.load = 0;
    }
    session->frame_value = sweep_value(options, i);
    char *output = cli_frame_name(options->output, i);
    bool good = output ? set_parameter(session, &options->sweep_from, session->frame_value) &&
                           run_frame(session, frame, output)
                       : cli_error("out of memory");
    free(output);
    if (!good)
      return false;
  }
  return true;
}

int cli_session_run(const cli_options *options, cli_frame *frame)
{
  cli_session session;
  bool done = cli_session_open(&session, options);
  if (done && options->sweep)
    done = run_sweep(&session, frame);
  else if (done)
    done = run_frame(&session, frame, options->output);
  return cli_session_close(&session, done);
}

/* ---- Reports ----------------------------------------------------------- */

static void report_seconds(cli_session *session, cli_json *json)
{
  const cli_seconds *s = &session->seconds;
  cli_json_begin(json, "seconds", '{');
  cli_json_number(json, "load", s->load);
  cli_json_number(json, "compile", s->compile);
  cli_json_number(json, "evaluate", s->evaluate);
  cli_json_number(json, "assemble", s->assemble);
  cli_json_number(json, "write", s->write);
  cli_json_number(json, "total", cli_clock() - session->begun);
  cli_json_end(json, '}');
}

/* The job's memory stands beside that of the field it works on. */
static uint64_t peak_bytes(const cli_session *session)
{
  zs_field_info info;
  zs_field_describe(session->field, &info);
  return info.bytes + session->job.peak_bytes;
}

void cli_session_report(cli_session *session, cli_json *json, const char *output)
{
  *json = (cli_json){.stream = stdout};
  cli_json_begin(json, NULL, '{');
  cli_json_string(json, "output", output);
  if (session->options->sweep)
    cli_json_number(json, "value", session->frame_value);
  report_seconds(session, json);
  cli_json_integer(json, "evaluations", (int64_t)session->job.evaluations);
  cli_json_integer(json, "peak_bytes", (int64_t)peak_bytes(session));
  cli_json_integer(json, "threads", session->job.threads);
  cli_json_string(json, "isa", zs_isa());
  cli_json_begin(json, "bounds", '[');
  for (int k = 0; k < 6; k++)
    cli_json_number(json, NULL, k < 3 ? session->lo[k] : session->hi[k - 3]);
  cli_json_end(json, ']');
}

void cli_session_report_end(cli_json *json)
{
  cli_json_end(json, '}');
  fputc('\n', json->stream);
  fflush(json->stream);
}

bool cli_session_talks(const cli_session *session)
{
  return !session->options->quiet && !session->options->report_json;
}
