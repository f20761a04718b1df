/* What the program prints about scenes and jobs: diagnostics and JSON. */
#ifndef CLI_REPORT_H
#define CLI_REPORT_H

#include "cli/options.h"

/* Prints diagnostics to standard error, each only once. */
typedef struct cli_reporter {
  bool quiet;  /* errors only */
  bool colour; /* standard error is a terminal that wants it */
  void (*before)(void *context); /* called before printing; clears the progress bar */
  void *context;
  uint64_t *seen; /* hashes of what was printed */
  size_t seen_count, seen_capacity;
} cli_reporter;

void cli_reporter_init(cli_reporter *reporter, bool quiet);
void cli_reporter_clear(cli_reporter *reporter);

/* A zs_diag.report function; the context is the reporter. */
void cli_report(void *reporter, const zs_diagnostic *diagnostic);

/* The exit status that a library error stands for. */
int cli_exit_status(zs_status status);

/* A JSON writer.  Keys are NULL inside arrays; numbers that JSON cannot hold
 * become null. */
typedef struct cli_json {
  FILE *stream;
  bool comma; /* something precedes in this object or array */
} cli_json;

void cli_json_begin(cli_json *json, const char *key, char bracket); /* '{' or '[' */
void cli_json_end(cli_json *json, char bracket);                    /* '}' or ']' */
void cli_json_string(cli_json *json, const char *key, const char *value);
void cli_json_number(cli_json *json, const char *key, double value);
void cli_json_integer(cli_json *json, const char *key, int64_t value);
void cli_json_boolean(cli_json *json, const char *key, bool value);
void cli_json_null(cli_json *json, const char *key);

/* The shortest decimal text that reads back as `value`; 32 bytes are enough. */
void cli_number_text(double value, char text[32]);

#endif
