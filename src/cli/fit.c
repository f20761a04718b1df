#include "cli/commands.h"
#include "cli/session.h"

static bool fit(cli_session *session)
{
  cli_progress_begin(&session->progress, 0);
  return zs_scene_fit(session->scene, session->options->output, &session->control,
                      &session->diag) && !cli_signal();
}

int cli_fit(const cli_options *options)
{
  cli_session session;
  bool done = cli_session_open(&session, options) && fit(&session);
  return cli_session_close(&session, done);
}
