#include "scene/scene.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

const char *zs_path_folder(const char *name, zs_arena *arena)
{
  const char *slash = strrchr(name, '/');
  return zs_arena_string(arena, name, slash ? (size_t)(slash - name) + 1 : 0);
}

/* Add the folder that a path leads to, without links. */
static bool add_root(zs_scene *scene, const char *path)
{
  char *real = realpath(path, NULL);
  if (!real)
    return false;
  const char *copy = zs_arena_string(&scene->arena, real, strlen(real));
  free(real);
  if (copy)
    scene->roots[scene->root_count++] = copy;
  return copy;
}

bool zs_paths_init(zs_scene *scene, const char *name, zs_diag *diag)
{
  size_t count = scene->options.allow_path_count;
  scene->roots = ZS_ARENA_NEW(&scene->arena, const char *, count + 1);
  const char *folder = zs_path_folder(name, &scene->arena);
  if (!scene->roots || !folder)
    return zs_fail_memory(diag);
  /* The folder of text in memory need not exist: then it holds no files. */
  add_root(scene, *folder ? folder : ".");
  bool good = true;
  for (size_t i = 0; i < count; i++) {
    const char *path = scene->options.allow_paths[i];
    if (!add_root(scene, path))
      good = zs_fail(diag, ZS_ERROR_ARGUMENT, NULL, "allowed folder '%s': %s", path,
                     strerror(errno));
  }
  return good;
}

static bool is_below(const char *path, const char *folder)
{
  size_t length = strlen(folder);
  if (length > 0 && folder[length - 1] == '/')
    length--; /* the root of the file system */
  return strncmp(path, folder, length) == 0 && (path[length] == '/' || path[length] == '\0');
}

static bool is_url(const char *reference)
{
  return strstr(reference, "://") || strncmp(reference, "file:", 5) == 0 ||
         strncmp(reference, "data:", 5) == 0;
}

const char *zs_path_resolve(const zs_scene *scene, const char *folder, const char *reference,
                            zs_arena *arena, const zs_place *place, zs_diag *diag)
{
  if (!*reference) {
    zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, place, NULL, "'' names no file");
    return NULL;
  }
  if (is_url(reference)) {
    zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, place, NULL,
              "'%s' is a URL; expected the name of a file", reference);
    return NULL;
  }
  size_t prefix = *reference == '/' ? 0 : strlen(folder), length = strlen(reference);
  char *path = ZS_ARENA_NEW(arena, char, prefix + length + 1);
  if (!path) {
    zs_fail_memory(diag);
    return NULL;
  }
  memcpy(path, folder, prefix);
  memcpy(path + prefix, reference, length);
  char *real = realpath(path, NULL);
  if (!real) {
    zs_report(diag, ZS_ERROR, ZS_ERROR_IO, place, NULL, "'%s' cannot be opened: %s", reference,
              strerror(errno));
    return NULL;
  }
  bool allowed = false;
  for (size_t i = 0; i < scene->root_count; i++)
    allowed = allowed || is_below(real, scene->roots[i]);
  struct stat status;
  bool folder_itself = stat(real, &status) == 0 && S_ISDIR(status.st_mode);
  free(real);
  if (!allowed) {
    zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, place, "allow its folder with --allow-path",
              "'%s' is outside the folder of the scene", reference);
    return NULL;
  }
  if (folder_itself) {
    zs_report(diag, ZS_ERROR, ZS_ERROR_IO, place, NULL, "'%s' is a folder; expected a file",
              reference);
    return NULL;
  }
  return path;
}
