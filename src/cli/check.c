#include "cli/commands.h"
#include "cli/session.h"

/* Compiling finds what only the whole can show: files with bad contents, fits
 * without a solution. */
static bool check_objects(cli_session *session)
{
  if (session->options->object)
    return cli_session_compile(session, session->options->object);
  bool good = cli_session_compile(session, NULL);
  size_t count = zs_scene_object_count(session->scene);
  for (size_t i = 0; i < count && !cli_signal(); i++)
    good &= cli_session_compile(session, zs_scene_object(session->scene, i));
  return good && !cli_signal();
}

int cli_check(const cli_options *options)
{
  cli_session session;
  bool done = cli_session_open(&session, options) && check_objects(&session);
  return cli_session_close(&session, done);
}
