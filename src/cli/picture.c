#include "cli/picture.h"

bool cli_picture_told(cli_session *session, uint32_t width, uint32_t height,
                      const uint64_t *inside, const char *output)
{
  session->seconds.evaluate = session->job.seconds_evaluate;
  session->seconds.assemble = session->job.seconds_assemble;
  cli_progress_clear(&session->progress);
  if (session->options->report_json) {
    cli_json json;
    cli_session_report(session, &json, output);
    cli_json_integer(&json, "width", width);
    cli_json_integer(&json, "height", height);
    if (inside)
      cli_json_integer(&json, "inside", (int64_t)*inside);
    cli_session_report_end(&json);
  }
  if (cli_session_talks(session))
    fprintf(stderr, "%s: %u x %u pixels, %.2f s\n", output, width, height,
            cli_clock() - session->begun);
  return true;
}

bool cli_picture_finish(cli_session *session, const zs_image *image, const uint64_t *inside,
                        const char *output)
{
  double begun = cli_clock();
  if (cli_signal() || !zs_image_write(image, output, &session->diag))
    return false;
  session->seconds.write = cli_clock() - begun;
  return cli_picture_told(session, image->width, image->height, inside, output);
}
