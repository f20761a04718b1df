#include "cli/commands.h"
#include "cli/picture.h"

static bool frame(cli_session *session, const char *output)
{
  const cli_options *asked = session->options;
  zs_slice_options options;
  zs_slice_options_init(&options);
  if (asked->width) {
    options.width = asked->width;
    options.height = asked->height;
  }
  options.axis = asked->axis;
  options.quantity = (zs_quantity)asked->quantity;
  options.at = asked->has_z || asked->has_at
                 ? asked->at
                 : 0.5 * (session->lo[asked->axis] + session->hi[asked->axis]);
  zs_image image = {0};
  uint64_t inside = 0;
  cli_progress_begin(&session->progress, (double)options.width * options.height);
  bool good = zs_slice(session->field, session->lo, session->hi, &options, &image, &inside,
                       &session->control, &session->job, &session->diag) &&
              cli_picture_finish(session, &image, &inside, output);
  zs_image_clear(&image);
  return good;
}

int cli_slice(const cli_options *options)
{
  return cli_session_run(options, frame);
}
