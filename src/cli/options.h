/* The command line as tables: commands, options, and what was asked for.  The
 * parser, --help, the manual page and the shell completion read the same rows. */
#ifndef CLI_OPTIONS_H
#define CLI_OPTIONS_H

#include "zeroset.h"

#include <stdio.h>

/* Exit statuses. */
typedef enum cli_exit {
  CLI_DONE = 0,
  CLI_WRONG_SCENE = 1,
  CLI_WRONG_COMMAND_LINE = 2,
  CLI_WRONG_FILE = 3,
  CLI_UNABLE = 4,
  CLI_SIGNALLED = 128 /* plus the number of the signal */
} cli_exit;

typedef struct cli_command cli_command;

typedef struct cli_setting {
  const char *name; /* not ended: see length */
  size_t length;
  double value;
} cli_setting;

/* Everything a command line can say.  Strings point into argv. */
typedef struct cli_options {
  const cli_command *command;
  const char *scene; /* operand: file, or "-"; NULL where there is none */
  const char *node;  /* operand of `nodes`, or NULL */

  const char *output, *object, *view;
  cli_setting *settings; /* in the order given; owned */
  size_t setting_count;
  const char **allow_paths; /* owned */
  size_t allow_path_count;

  bool sweep;
  cli_setting sweep_from; /* the parameter and its first value */
  double sweep_to;
  unsigned sweep_count;

  bool has_bounds;
  double bounds[6]; /* lower corner, upper corner */
  uint32_t resolution; /* 0: not given */
  bool has_cell;
  double cell[3];
  uint32_t width, height; /* 0: not given */
  int axis;
  bool has_at, has_z, has_axis;
  double at;

  bool has_simplify;
  double simplify;
  bool seed_constraints; /* what to keep of a mesh: at constraints, and at points */
  double *seeds;         /* 3 each; owned */
  size_t seed_count;
  int method, quantity, type, mode, format; /* zs_mesh_method, ... zs_document */
  bool has_type;
  bool report_json, json, gradient, binary, manual, correspondence;
  bool quiet, no_progress, brute, help;
  unsigned threads;
  uint64_t memory;
} cli_options;

/* One command. */
struct cli_command {
  const char *name;
  unsigned bit;         /* in cli_option.commands */
  const char *operands; /* for the usage line */
  const char *summary;
  const char *description; /* paragraphs of the manual, "\n" between them */
  const char *const *endings; /* of the output file's name, NULL-ended; NULL: no output */
  int (*run)(const cli_options *options); /* returns the exit status */
};

extern const cli_command cli_commands[];
extern const size_t cli_command_count;

typedef struct cli_option cli_option;
struct cli_option {
  const char *name;        /* without the dashes */
  char letter;             /* 0: none */
  const char *argument;    /* its name in the usage; NULL: a flag */
  unsigned commands;       /* bits; 0: of the program itself */
  size_t offset;           /* into cli_options, for the common parsers */
  const char *const *choices; /* NULL-ended, in the order of the values; or NULL */
  bool (*parse)(const cli_option *option, const char *text, cli_options *options);
  const char *help;        /* one sentence without full stop */
};

extern const cli_option cli_option_table[];
extern const size_t cli_option_count;

/* Parse argv after the command's name.  False after printing what is wrong. */
bool cli_options_parse(cli_options *options, const cli_command *command, int argc, char **argv);
void cli_options_clear(cli_options *options);

/* "zeroset: error: ..." on standard error; always returns false. */
bool cli_error(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* The help of one command, and of the program. */
void cli_help_command(FILE *stream, const cli_command *command);
void cli_help(FILE *stream);

/* The manual page (troff) and the completion script for bash. */
void cli_manual_page(FILE *stream);
void cli_completion(FILE *stream);

#endif
