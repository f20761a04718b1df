/* The program `zeroset`: the public API from the command line. */
#include "cli/blas.h"
#include "cli/commands.h"
#include "cli/progress.h"
#include "cli/text.h"

#include <errno.h>
#include <string.h>

static const cli_command *find_command(const char *name)
{
  for (size_t i = 0; i < cli_command_count; i++)
    if (strcmp(name, cli_commands[i].name) == 0)
      return &cli_commands[i];
  return NULL;
}

static int unknown_command(const char *word)
{
  static const char *const words[] = {"--help", "--version", "--man-page", "--completion"};
  enum { WORDS = sizeof words / sizeof *words };
  const char *names[16 + WORDS];
  size_t count = 0;
  for (; count < cli_command_count && count < 16; count++)
    names[count] = cli_commands[count].name;
  for (size_t i = 0; i < WORDS; i++)
    names[count++] = words[i];
  const char *nearest = cli_suggest(word, names, count);
  if (nearest)
    cli_error("unknown command '%s'; did you mean '%s'?", word, nearest);
  else
    cli_error("unknown command '%s'; try 'zeroset --help'", word);
  return CLI_WRONG_COMMAND_LINE;
}

static int run_command(const cli_command *command, int argc, char **argv)
{
  cli_options options;
  int status = CLI_WRONG_COMMAND_LINE;
  if (cli_options_parse(&options, command, argc, argv)) {
    status = CLI_DONE;
    if (options.help)
      cli_help_command(stdout, command);
    else
      status = command->run(&options);
  }
  cli_options_clear(&options);
  return status;
}

static int run(int argc, char **argv)
{
  if (argc < 2) {
    cli_help(stderr);
    return CLI_WRONG_COMMAND_LINE;
  }
  const cli_command *command = find_command(argv[1]);
  if (command)
    return run_command(command, argc - 1, argv + 1);
  if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0)
    cli_help(stdout);
  else if (strcmp(argv[1], "--version") == 0)
    printf("zeroset %s (%s)\n", zs_version(), zs_isa());
  else if (strcmp(argv[1], "--man-page") == 0)
    cli_manual_page(stdout);
  else if (strcmp(argv[1], "--completion") == 0)
    cli_completion(stdout);
  else
    return unknown_command(argv[1]);
  return CLI_DONE;
}

int main(int argc, char **argv)
{
  cli_blas_stop_threads();
  cli_signals_catch();
  int status = run(argc, argv);
  if (fflush(stdout) == 0 && !ferror(stdout))
    return status;
  cli_error("standard output: %s", strerror(errno));
  return status == CLI_DONE ? CLI_WRONG_FILE : status;
}
