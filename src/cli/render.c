#include "cli/commands.h"
#include "cli/picture.h"

#include <string.h>

/* The scene's own views come first, so that a scene may have its own "front". */
static bool find_view(cli_session *session, zs_view *view)
{
  const char *name = session->options->view;
  size_t count = zs_scene_view_count(session->scene);
  for (size_t i = 0; i < count; i++)
    if (zs_scene_view(session->scene, i, view) && (!name || strcmp(view->id, name) == 0))
      return true;
  return zs_view_named(view, name ? name : "iso", &session->diag);
}

static bool frame(cli_session *session, const char *output)
{
  const cli_options *asked = session->options;
  zs_render_options options;
  zs_render_options_init(&options);
  if (asked->width) {
    options.width = asked->width;
    options.height = asked->height;
  }
  options.mode = (zs_render_mode)asked->mode;
  if (!find_view(session, &options.view))
    return false;
  zs_image image = {0};
  cli_progress_begin(&session->progress, (double)options.width * options.height);
  bool good = zs_render(session->field, session->lo, session->hi, &options, &image,
                        &session->control, &session->job, &session->diag) &&
              cli_picture_finish(session, &image, NULL, output);
  zs_image_clear(&image);
  return good;
}

int cli_render(const cli_options *options)
{
  return cli_session_run(options, frame);
}
