#include "cli/commands.h"
#include "cli/picture.h"
#include "cli/text.h"

/* As a vector file, which is written at once. */
static bool draw_svg(cli_session *session, const zs_slice_options *options, const char *output)
{
  uint64_t inside = 0;
  cli_progress_begin(&session->progress, (double)options->width * options->height);
  return zs_slice_svg(session->field, session->lo, session->hi, options, output, &inside,
                      &session->control, &session->job, &session->diag) &&
         cli_picture_told(session, options->width, options->height, &inside, output);
}

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
  options.correspondence = asked->correspondence;
  if (cli_ends_with(output, ".svg"))
    return draw_svg(session, &options, output);
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
