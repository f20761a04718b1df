#include "cli/commands.h"
#include "cli/session.h"

static void tell_volume(const cli_session *session, const char *output, const zs_grid *grid,
                        uint64_t inside)
{
  const uint32_t *n = grid->count;
  double samples = (double)n[0] * n[1] * n[2];
  fprintf(stderr, "%s: %u x %u x %u samples, %.4g %% inside, %.2f s\n", output, n[0], n[1], n[2],
          100 * (double)inside / samples, cli_clock() - session->begun);
}

static void report_volume(cli_session *session, const char *output, const zs_grid *grid,
                          uint64_t inside)
{
  cli_json json;
  cli_session_report(session, &json, output);
  cli_json_begin(&json, "size", '[');
  for (int k = 0; k < 3; k++)
    cli_json_integer(&json, NULL, grid->count[k]);
  cli_json_end(&json, ']');
  cli_json_begin(&json, "cell", '[');
  for (int k = 0; k < 3; k++)
    cli_json_number(&json, NULL, grid->cell[k]);
  cli_json_end(&json, ']');
  cli_json_integer(&json, "inside", (int64_t)inside);
  cli_session_report_end(&json);
}

static bool frame(cli_session *session, const char *output)
{
  const cli_options *options = session->options;
  zs_grid grid;
  if (!cli_session_grid(session, &grid))
    return false;
  uint64_t inside = 0;
  cli_progress_begin(&session->progress,
                     (double)grid.count[0] * grid.count[1] * grid.count[2]);
  double begun = cli_clock();
  if (!zs_voxelize_file(session->field, &grid, (zs_quantity)options->quantity,
                        (zs_sample_type)options->type, output, &inside, &session->control,
                        &session->job, &session->diag))
    return false;
  double seconds = cli_clock() - begun;
  cli_progress_clear(&session->progress);
  session->seconds.evaluate = session->job.seconds_evaluate;
  session->seconds.assemble = session->job.seconds_assemble;
  /* Writing alternates with evaluating: it has what the two leave. */
  double left = seconds - session->seconds.evaluate - session->seconds.assemble;
  session->seconds.write = left > 0 ? left : 0;
  if (options->report_json)
    report_volume(session, output, &grid, inside);
  if (cli_session_talks(session))
    tell_volume(session, output, &grid, inside);
  return true;
}

int cli_voxel(const cli_options *options)
{
  return cli_session_run(options, frame);
}
