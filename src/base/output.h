/* Output files that appear whole or not at all. */
#ifndef ZS_OUTPUT_H
#define ZS_OUTPUT_H

#include "base/diagnostic.h"

#include <stdio.h>

/* A file written beside its final name, and renamed when committed. */
typedef struct zs_output {
  FILE *stream;
  char *path;      /* final name */
  char *temporary; /* name while it is written */
} zs_output;

/* Open; false after reporting (ZS_ERROR_IO with the reason). */
bool zs_output_open(zs_output *output, const char *path, zs_diag *diag);

/* Flush, close and rename.  Write errors since opening are reported here, and
 * leave no file.  Ends the output either way. */
bool zs_output_commit(zs_output *output, zs_diag *diag);

/* Close and delete. */
void zs_output_discard(zs_output *output);

#endif
