#include "cli/commands.h"
#include "cli/session.h"

static bool check_objects(cli_session *session)
{
  if (session->options->object)
    return cli_session_compile(session, session->options->object);
  cli_progress_begin(&session->progress, 0);
  return zs_scene_check(session->scene, &session->control, &session->diag) && !cli_signal();
}

int cli_check(const cli_options *options)
{
  cli_session session;
  bool done = cli_session_open(&session, options) && check_objects(&session);
  return cli_session_close(&session, done);
}
