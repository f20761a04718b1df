/* A folder for the files of a test, and what is in files. */
#ifndef ZS_TEST_SCRATCH_H
#define ZS_TEST_SCRATCH_H

#include <dirent.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct scratch {
  char folder[64];
  char path[384]; /* the latest answer of scratch_path */
} scratch;

/* Make a new folder in the current one. */
static inline bool scratch_make(scratch *s)
{
  strcpy(s->folder, "scratch-XXXXXX");
  return mkdtemp(s->folder) != NULL;
}

static inline const char *scratch_path(scratch *s, const char *name)
{
  snprintf(s->path, sizeof s->path, "%s/%s", s->folder, name);
  return s->path;
}

/* Number of files in the folder. */
static inline int scratch_count(const scratch *s)
{
  int count = 0;
  DIR *folder = opendir(s->folder);
  for (struct dirent *entry; folder && (entry = readdir(folder));)
    count += strcmp(entry->d_name, ".") && strcmp(entry->d_name, "..");
  if (folder)
    closedir(folder);
  return count;
}

/* Delete the folder and its files. */
static inline void scratch_remove(scratch *s)
{
  DIR *folder = opendir(s->folder);
  for (struct dirent *entry; folder && (entry = readdir(folder));)
    if (strcmp(entry->d_name, ".") && strcmp(entry->d_name, ".."))
      remove(scratch_path(s, entry->d_name));
  if (folder)
    closedir(folder);
  rmdir(s->folder);
}

/* The bytes of a file and a final NUL, for free(); NULL when there is none. */
static inline char *read_whole(const char *path, size_t *length)
{
  *length = 0;
  FILE *file = fopen(path, "rb");
  if (!file)
    return NULL;
  fseek(file, 0, SEEK_END);
  long size = ftell(file);
  rewind(file);
  char *bytes = malloc((size_t)size + 1);
  *length = bytes ? fread(bytes, 1, (size_t)size, file) : 0;
  if (bytes)
    bytes[*length] = '\0';
  fclose(file);
  return bytes;
}

#endif
