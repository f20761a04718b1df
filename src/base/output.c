#include "base/output.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { ATTEMPTS = 100 };

static bool fail_path(zs_diag *diag, const char *path, const char *what)
{
  return zs_fail(diag, ZS_ERROR_IO, path, "%s: %s", what, strerror(errno));
}

/* A name beside `path` that no other process or thread is likely to choose. */
static char *temporary_name(const char *path, int attempt)
{
  enum { SUFFIX = 64 };
  size_t size = strlen(path) + SUFFIX;
  char *name = malloc(size);
  struct timespec now = {0};
  clock_gettime(CLOCK_MONOTONIC, &now);
  if (name)
    snprintf(name, size, "%s.%lx-%lx-%x.part", path, (unsigned long)getpid(),
             (unsigned long)now.tv_nsec, (unsigned)attempt);
  return name;
}

/* Create the file beside the final one.  O_EXCL tells a name in use, and the
 * mode leaves permissions to the caller's umask. */
static int create_temporary(zs_output *output, zs_diag *diag)
{
  for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
    output->temporary = temporary_name(output->path, attempt);
    if (!output->temporary) {
      zs_fail_memory(diag);
      return -1;
    }
    int file = open(output->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file >= 0)
      return file;
    int reason = errno;
    free(output->temporary);
    output->temporary = NULL;
    errno = reason;
    if (reason != EEXIST)
      break;
  }
  fail_path(diag, output->path, "cannot be created");
  return -1;
}

/* Open what `path` leads to.  Devices and pipes cannot be replaced: they are
 * written directly. */
static int open_file(zs_output *output, zs_diag *diag)
{
  struct stat status;
  bool exists = stat(output->path, &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) {
    errno = EISDIR;
    fail_path(diag, output->path, "cannot be written");
    return -1;
  }
  if (exists && !S_ISREG(status.st_mode)) {
    int file = open(output->path, O_WRONLY | O_CLOEXEC);
    if (file < 0)
      fail_path(diag, output->path, "cannot be written");
    return file;
  }
  int file = create_temporary(output, diag);
  /* A file that is replaced keeps its permissions; one that belongs to someone
   * else may refuse, which is no reason to lose the result. */
  if (file >= 0 && exists && fchmod(file, status.st_mode & 0777) != 0)
    errno = 0;
  return file;
}

static void clear(zs_output *output)
{
  free(output->path);
  free(output->temporary);
  *output = (zs_output){0};
}

bool zs_output_open(zs_output *output, const char *path, zs_diag *diag)
{
  *output = (zs_output){0};
  /* Follow a link, so that it is its target that is replaced. */
  output->path = realpath(path, NULL);
  if (!output->path)
    output->path = strdup(path);
  if (!output->path)
    return zs_fail_memory(diag);
  int file = open_file(output, diag);
  if (file < 0) {
    clear(output);
    return false;
  }
  output->stream = fdopen(file, "wb");
  if (!output->stream) {
    close(file);
    zs_fail_memory(diag);
    zs_output_discard(output);
    return false;
  }
  return true;
}

bool zs_output_commit(zs_output *output, zs_diag *diag)
{
  errno = 0;
  bool written = fflush(output->stream) == 0 && !ferror(output->stream);
  int reason = errno;
  if (fclose(output->stream) != 0 && written) {
    written = false;
    reason = errno;
  }
  output->stream = NULL;
  if (!written) {
    /* An earlier write may have failed, and its reason be forgotten. */
    errno = reason ? reason : EIO;
    fail_path(diag, output->path, "cannot be written");
    zs_output_discard(output);
    return false;
  }
  if (output->temporary && rename(output->temporary, output->path) != 0) {
    fail_path(diag, output->path, "cannot be replaced");
    zs_output_discard(output);
    return false;
  }
  clear(output);
  return true;
}

void zs_output_discard(zs_output *output)
{
  if (output->stream)
    fclose(output->stream);
  if (output->temporary)
    unlink(output->temporary);
  clear(output);
}
