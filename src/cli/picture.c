#include "cli/picture.h"

bool cli_picture_finish(cli_session *session, const zs_image *image, const uint64_t *inside,
                        const char *output)
{
  session->seconds.evaluate = session->job.seconds_evaluate;
  session->seconds.assemble = session->job.seconds_assemble;
  double begun = cli_clock();
  if (cli_signal() || !zs_image_write(image, output, &session->diag))
    return false;
  session->seconds.write = cli_clock() - begun;
  cli_progress_clear(&session->progress);
  if (session->options->report_json) {
    cli_json json;
    cli_session_report(session, &json, output);
    cli_json_integer(&json, "width", image->width);
    cli_json_integer(&json, "height", image->height);
    if (inside)
      cli_json_integer(&json, "inside", (int64_t)*inside);
    cli_session_report_end(&json);
  }
  if (cli_session_talks(session))
    fprintf(stderr, "%s: %u x %u pixels, %.2f s\n", output, image->width, image->height,
            cli_clock() - session->begun);
  return true;
}
