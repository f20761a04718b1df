#include "scene/scene.h"

#include "base/array.h"
#include "base/names.h"

#include <dirent.h>
#include <errno.h>
#include <fnmatch.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

const char *zs_path_folder(const char *name, zs_arena *arena)
{
  const char *slash = strrchr(name, '/');
  return zs_arena_string(arena, name, slash ? (size_t)(slash - name) + 1 : 0);
}

/* Add the folder that a path leads to, without links.  Returns 0, or the errno that says why
 * not. */
static int add_root(zs_scene *scene, const char *path)
{
  char *real = realpath(path, NULL);
  if (!real)
    return errno;
  const char *copy = zs_arena_string(&scene->arena, real, strlen(real));
  free(real);
  if (!copy)
    return ENOMEM;
  scene->roots[scene->root_count++] = copy;
  return 0;
}

bool zs_paths_init(zs_scene *scene, const char *name, zs_diag *diag)
{
  size_t count = scene->options.allow_path_count;
  scene->roots = ZS_ARENA_NEW(&scene->arena, const char *, count + 1);
  const char *folder = zs_path_folder(name, &scene->arena);
  /* The folder of text in memory need not exist: then it holds no files. */
  if (!scene->roots || !folder || add_root(scene, *folder ? folder : ".") == ENOMEM)
    return zs_fail_memory(diag);
  bool good = true;
  for (size_t i = 0; i < count; i++) {
    const char *path = scene->options.allow_paths[i];
    const int reason = add_root(scene, path);
    if (reason == ENOMEM)
      return zs_fail_memory(diag);
    if (reason)
      good = zs_fail(diag, ZS_ERROR_ARGUMENT, NULL, "allowed folder '%s': %s", path,
                     strerror(reason));
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
  if (!real && errno == ENOMEM) {
    zs_fail_memory(diag);
    return NULL;
  }
  if (!real) {
    zs_report(diag, ZS_ERROR, ZS_ERROR_IO, place, NULL, "'%s' cannot be opened: %s", reference,
              strerror(errno));
    return NULL;
  }
  bool allowed = false;
  for (size_t i = 0; i < scene->root_count; i++)
    allowed = allowed || is_below(real, scene->roots[i]);
  struct stat status;
  const bool found = stat(real, &status) == 0;
  free(real);
  if (!allowed) {
    zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, place, "allow its folder with --allow-path",
              "'%s' is outside the folder of the scene", reference);
    return NULL;
  }
  if (found && !S_ISREG(status.st_mode)) { /* a pipe could keep its reader waiting for ever */
    zs_report(diag, ZS_ERROR, ZS_ERROR_IO, place, NULL, "'%s' is a %s; expected a file",
              reference, S_ISDIR(status.st_mode) ? "folder" : "pipe or device");
    return NULL;
  }
  return path;
}

/* ---- Patterns -------------------------------------------------------------------- */

enum { MOST_FILES = 100000 };

static int compare_names(const void *left, const void *right)
{
  const char *a = *(const char *const *)left, *b = *(const char *const *)right;
  const int order = zs_compare_naturally(a, b);
  return order ? order : strcmp(a, b);
}

/* Names that match a pattern, of the entries of a folder, copied to the arena. */
typedef struct matches {
  const char **names;
  size_t count, capacity;
} matches;

static bool add_match(matches *all, zs_arena *arena, const char *name)
{
  const char **names =
    zs_array_grown(all->names, all->count + 1, &all->capacity, sizeof *names);
  if (!names)
    return false;
  all->names = names;
  names[all->count] = zs_arena_string(arena, name, strlen(name));
  return names[all->count++];
}

static bool list_folder(const char *path, const char *pattern, zs_arena *arena, matches *all,
                        const zs_place *place, zs_diag *diag)
{
  DIR *folder = opendir(*path ? path : ".");
  if (!folder && errno == ENOMEM)
    return zs_fail_memory(diag);
  if (!folder)
    return zs_report(diag, ZS_ERROR, ZS_ERROR_IO, place, NULL, "'%s' cannot be opened: %s", path,
                     strerror(errno));
  bool memory = true;
  for (struct dirent *entry; memory && all->count <= MOST_FILES && (entry = readdir(folder));)
    if (fnmatch(pattern, entry->d_name, FNM_PERIOD) == 0)
      memory = add_match(all, arena, entry->d_name);
  closedir(folder);
  if (!memory)
    return zs_fail_memory(diag);
  return all->count <= MOST_FILES ||
         zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, place, NULL,
                   "more than %d files match '%s'", MOST_FILES, pattern);
}

/* Resolve the names in the folder that `reference` names before its last part. */
static bool resolve_all(const zs_scene *scene, const char *folder, const char *reference,
                        size_t length, zs_arena *arena, const matches *all, zs_files *files,
                        const zs_place *place, zs_diag *diag)
{
  const char **paths = ZS_ARENA_NEW(arena, const char *, all->count);
  if (!paths)
    return zs_fail_memory(diag);
  for (size_t i = 0; i < all->count; i++) {
    char *name = ZS_ARENA_NEW(arena, char, length + strlen(all->names[i]) + 1);
    if (!name)
      return zs_fail_memory(diag);
    memcpy(name, reference, length);
    strcpy(name + length, all->names[i]);
    paths[i] = zs_path_resolve(scene, folder, name, arena, place, diag);
    if (!paths[i])
      return false;
  }
  *files = (zs_files){paths, all->count};
  return true;
}

bool zs_paths_find(const zs_scene *scene, const char *folder, const char *reference,
                   zs_arena *arena, zs_files *files, const zs_place *place, zs_diag *diag)
{
  const char *slash = strrchr(reference, '/'), *pattern = slash ? slash + 1 : reference;
  const size_t length = (size_t)(pattern - reference);
  matches all = {0};
  if (!strpbrk(pattern, "*?") || is_url(reference)) {
    if (!add_match(&all, arena, pattern)) {
      free(all.names);
      return zs_fail_memory(diag);
    }
  } else {
    const size_t prefix = *reference == '/' ? 0 : strlen(folder);
    char *path = ZS_ARENA_NEW(arena, char, prefix + length + 1);
    if (!path)
      return zs_fail_memory(diag);
    memcpy(path, folder, prefix);
    memcpy(path + prefix, reference, length);
    if (!list_folder(path, pattern, arena, &all, place, diag)) {
      free(all.names);
      return false;
    }
  }
  bool done = all.count > 0;
  if (done) {
    qsort(all.names, all.count, sizeof *all.names, compare_names);
    done = resolve_all(scene, folder, reference, length, arena, &all, files, place, diag);
  } else {
    zs_report(diag, ZS_ERROR, ZS_ERROR_IO, place, NULL, "no file matches '%s'", reference);
  }
  free(all.names);
  return done;
}
