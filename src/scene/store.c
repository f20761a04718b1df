/* Scenes with their fits beside them. */
#include "base/output.h"
#include "nodes/fits.h"
#include "scene/scene.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

/* The name of the file of fits of a scene file: another ending. */
static char *name_fits(const char *path)
{
  static const char ending[] = ".fits";
  const char *slash = strrchr(path, '/'), *dot = strrchr(path, '.');
  const size_t length = dot && (!slash || dot > slash + 1) ? (size_t)(dot - path) : strlen(path);
  char *name = malloc(length + sizeof ending);
  if (!name)
    return NULL;
  memcpy(name, path, length);
  memcpy(name + length, ending, sizeof ending);
  return name;
}

/* Files that a scene names are looked for in its folder, so the new one has to be
 * in the same. */
static bool check_folder(const zs_scene *scene, const char *path, zs_diag *diag)
{
  zs_arena arena = {0};
  const char *folder = zs_path_folder(path, &arena), *own = scene->files->folder;
  char *a = folder ? realpath(*folder ? folder : ".", NULL) : NULL;
  char *b = realpath(*own ? own : ".", NULL);
  const bool exhausted = !folder || ((!a || !b) && errno == ENOMEM);
  const bool same = a && b && strcmp(a, b) == 0;
  free(a);
  free(b);
  zs_arena_free(&arena);
  if (exhausted)
    return zs_fail_memory(diag);
  return same || zs_fail(diag, ZS_ERROR_ARGUMENT, path, "a fitted scene has to be in the folder of "
                         "the scene, where the files are that it names");
}

/* Where the root's name ends in the text; 0 when it cannot be told. */
static size_t end_of_root_name(const zs_source *source)
{
  const char *text = source->text;
  size_t at = 0;
  while (at < source->length) {
    const char *tag = memchr(text + at, '<', source->length - at), *end = NULL;
    if (!tag)
      return 0;
    at = (size_t)(tag - text) + 1;
    if (text[at] == '?')
      end = strstr(text + at, "?>");
    else if (strncmp(text + at, "!--", 3) == 0)
      end = strstr(text + at, "-->");
    else if (text[at] == '!')
      end = strchr(text + at, '>');
    else
      return at + strcspn(text + at, " \t\r\n/>");
    if (!end)
      return 0;
    at = (size_t)(end - text) + 1;
  }
  return 0;
}

static void put_escaped(FILE *stream, const char *text)
{
  for (; *text; text++)
    if (*text == '&' || *text == '<' || *text == '"' || *text == '\'')
      fprintf(stream, "&#%d;", *text);
    else
      fputc(*text, stream);
}

/* Write the scene's text with `fits` naming the file: in place of the name that is
 * there, or behind the root's own. */
static bool write_scene(const zs_scene *scene, const char *path, const char *fits, zs_diag *diag)
{
  const zs_source *source = &scene->files->source;
  const zs_xml_attribute *old = zs_element_attribute(scene->files->root, "fits");
  const size_t from = old ? old->offset : end_of_root_name(source);
  const char *slash = strrchr(fits, '/');
  zs_output output;
  if (from == 0 || memchr(source->text, 0, source->length))
    return zs_fail(diag, ZS_ERROR_UNABLE, source->name,
                   "the text is not one that an attribute can be added to; expected UTF-8");
  if (!zs_output_open(&output, path, diag))
    return false;
  fwrite(source->text, 1, from, output.stream);
  fputs(old ? "" : " fits=\"", output.stream);
  put_escaped(output.stream, slash ? slash + 1 : fits);
  fputs(old ? "" : "\"", output.stream);
  const char quote[2] = {old ? source->text[from - 1] : '\0'};
  const size_t behind = from + (old ? strcspn(source->text + from, quote) : 0);
  fwrite(source->text + behind, 1, source->length - behind, output.stream);
  return zs_output_commit(&output, diag);
}

bool zs_scene_fit(zs_scene *scene, const char *path, const zs_control *control, zs_diag *diag)
{
  size_t count = 0;
  if (!check_folder(scene, path, diag) || !zs_scene_check(scene, control, diag))
    return false;
  char *fits = name_fits(path);
  if (!fits)
    return zs_fail_memory(diag);
  bool done = strcmp(fits, path) != 0 ||
              zs_fail(diag, ZS_ERROR_ARGUMENT, path, "is the name of the file of fits");
  done = done && zs_fits_write(scene->cache, fits, &count, diag) &&
         write_scene(scene, path, fits, diag);
  free(fits);
  if (done && count == 0)
    zs_report(diag, ZS_WARNING, ZS_OK, NULL, NULL, "the scene has no fits to store");
  return done;
}
