/* The commands of the program: one function each. */
#ifndef CLI_COMMANDS_H
#define CLI_COMMANDS_H

#include "cli/options.h"

/* Bits of cli_command, for the options that a command takes. */
enum {
  CLI_CHECK = 1 << 0,
  CLI_INFO = 1 << 1,
  CLI_MESH = 1 << 2,
  CLI_VOXEL = 1 << 3,
  CLI_RENDER = 1 << 4,
  CLI_SLICE = 1 << 5,
  CLI_EVAL = 1 << 6,
  CLI_NODES = 1 << 7,
  CLI_SCHEMA = 1 << 8,
  CLI_FIT = 1 << 9
};

int cli_check(const cli_options *options);
int cli_info(const cli_options *options);
int cli_mesh(const cli_options *options);
int cli_voxel(const cli_options *options);
int cli_render(const cli_options *options);
int cli_slice(const cli_options *options);
int cli_eval(const cli_options *options);
int cli_fit(const cli_options *options);
int cli_nodes(const cli_options *options);
int cli_schema(const cli_options *options);

#endif
