/* Everything that is printed from the tables: help, manual page, completion. */
#include "cli/commands.h"

#include <ctype.h>
#include <string.h>

const cli_command cli_commands[] = {
  {"check", CLI_CHECK, "SCENE", "report the errors and warnings of a scene",
   "Reads the scene, compiles every object and prints the diagnostics, nothing else; after 50 "
   "errors, how many more there are.",
   NULL, cli_check},
  {"info", CLI_INFO, "SCENE", "describe a scene: parameters, objects, bounds, operations, fits",
   "Lists the parameters with their values and ranges, the objects and views, the box that the "
   "back ends would use, the size of the compiled program, and for every fit its kernel, "
   "dimension, constraints, method, seconds, residual and memory.",
   NULL, cli_info},
  {"mesh", CLI_MESH, "SCENE -o FILE", "make a triangle mesh of the surface",
   "The format follows the name's ending: .stl, .ply, .obj, .off or .om.  The mesh is closed, "
   "manifold and oriented; where the box cuts the solid, a cap closes it.",
   (const char *const[]){".stl", ".ply", ".obj", ".off", ".om", NULL}, cli_mesh},
  {"voxel", CLI_VOXEL, "SCENE -o FILE", "sample the field into a volume",
   "The format follows the name's ending: .vti, .nrrd, .mhd, .nii, .nii.gz or .raw.  Samples sit "
   "at the centres of the cells.  The volume is written layer by layer and may be larger than memory.",
   (const char *const[]){".vti", ".nrrd", ".mhd", ".nii", ".nii.gz", ".raw", NULL}, cli_voxel},
  {"render", CLI_RENDER, "SCENE -o FILE", "draw a picture of the solid",
   "Writes a PNG file.",
   (const char *const[]){".png", NULL}, cli_render},
  {"slice", CLI_SLICE, "SCENE -o FILE", "draw a cross-section",
   "Writes a PNG file: the field as colours with contour lines, the surface's line bold; or, with "
   "--quantity inside, white where f >= 0.  The cut is seen from the axis' positive end.\n"
   "A name that ends in .svg makes an SVG file in the scene's units: the solid's outline, filled, "
   "and unless --quantity is inside lines of equal f.  <path> reads it back, with the lower left "
   "corner of the picture at the origin.",
   (const char *const[]){".png", ".svg", NULL}, cli_slice},
  {"eval", CLI_EVAL, "SCENE < POINTS > VALUES", "evaluate the field at points",
   "Reads one point a line, three numbers x y z, from standard input and writes f for each to "
   "standard output.  Empty lines, and what follows a '#', are skipped.  Values are computed in "
   "single precision relative to the scene.",
   NULL, cli_eval},
  {"fit", CLI_FIT, "SCENE -o FILE", "write the scene with its fits stored beside it",
   "Makes the variational fits of all objects and writes the scene again, to a file in its own "
   "folder, with the fits in a file of the same name ending in .fits.  The new scene solves "
   "nothing when it is loaded, unless what a fit depends on has changed.",
   (const char *const[]){".xml", NULL}, cli_fit},
  {"nodes", CLI_NODES, "[NAME]", "list the elements of the scene language, or describe one",
   "Without a name, one line for every kind of node; with one, its attributes, defaults, formula "
   "and source.",
   NULL, cli_nodes},
  {"schema", CLI_SCHEMA, "", "print the schema of the scene language",
   "For editors and validators: RELAX NG, or W3C XML Schema.",
   NULL, cli_schema},
};

const size_t cli_command_count = sizeof cli_commands / sizeof *cli_commands;

/* ---- Help -------------------------------------------------------------- */

enum { HELP_COLUMN = 28, HELP_WIDTH = 79 };

/* Text wrapped between two columns, the first line beginning where the cursor is. */
static void put_wrapped(FILE *stream, const char *text, int column, int indent)
{
  while (*text) {
    int length = (int)strcspn(text, " ");
    if (column > indent && column + 1 + length > HELP_WIDTH) {
      fprintf(stream, "\n%*s", indent, "");
      column = indent;
    } else if (column > indent) {
      fputc(' ', stream);
      column++;
    }
    fprintf(stream, "%.*s", length, text);
    column += length;
    text += length;
    text += strspn(text, " ");
  }
  fputc('\n', stream);
}

static void put_choices(FILE *stream, const cli_option *option, const char *separator)
{
  for (const char *const *c = option->choices; *c; c++)
    fprintf(stream, "%s%s", c == option->choices ? "" : separator, *c);
}

static void help_option(FILE *stream, const cli_option *option)
{
  int used = option->letter ? fprintf(stream, "  -%c, ", option->letter)
                            : fprintf(stream, "      ");
  used += fprintf(stream, "--%s", option->name);
  if (option->argument)
    used += fprintf(stream, " %s", option->argument);
  if (used >= HELP_COLUMN - 1) {
    fputc('\n', stream);
    used = 0;
  }
  fprintf(stream, "%*s", HELP_COLUMN - used, "");
  char help[512];
  snprintf(help, sizeof help, "%s", option->help);
  if (option->choices) {
    size_t length = strlen(help);
    length += (size_t)snprintf(help + length, sizeof help - length, ": ");
    for (const char *const *c = option->choices; *c && length < sizeof help; c++)
      length += (size_t)snprintf(help + length, sizeof help - length, "%s%s",
                                 c == option->choices ? "" : ", ", *c);
  }
  put_wrapped(stream, help, HELP_COLUMN, HELP_COLUMN);
}

void cli_help_command(FILE *stream, const cli_command *command)
{
  fprintf(stream, "usage: zeroset %s%s%s [OPTIONS]\n\n", command->name,
          *command->operands ? " " : "", command->operands);
  char first[2] = {(char)toupper((unsigned char)command->summary[0]), '\0'};
  fprintf(stream, "%s%s.\n", first, command->summary + 1);
  put_wrapped(stream, command->description, 0, 0);
  fputs("\noptions:\n", stream);
  for (size_t i = 0; i < cli_option_count; i++)
    if (cli_option_table[i].commands & command->bit)
      help_option(stream, &cli_option_table[i]);
}

void cli_help(FILE *stream)
{
  fputs("usage: zeroset COMMAND [SCENE] [OPTIONS]\n\ncommands:\n", stream);
  for (size_t i = 0; i < cli_command_count; i++)
    fprintf(stream, "  %-8s %s\n", cli_commands[i].name, cli_commands[i].summary);
  fputs("\n"
        "SCENE is a scene file, or '-' for standard input.\n"
        "'zeroset COMMAND --help' lists the options of a command.\n"
        "\n"
        "  --version              print the version and the instruction set in use\n"
        "  --man-page             print the manual page\n"
        "  --completion           print the completion script for bash\n"
        "\n"
        "exit status: 0 done; 1 the scene is wrong; 2 the command line is wrong;\n"
        "3 a file could not be read or written; 4 it could not be computed;\n"
        "130 interrupted, with no partial output left\n",
        stream);
}

/* ---- The manual page --------------------------------------------------- */

/* Text for troff: '-' is a hyphen there unless escaped, and '.' or '\'' at the
 * start of a line are commands. */
static void put_troff(FILE *stream, const char *text)
{
  for (const char *c = text; *c; c++) {
    if ((c == text || c[-1] == '\n') && (*c == '.' || *c == '\''))
      fputs("\\&", stream);
    if (*c == '-' || *c == '\\')
      fputc('\\', stream);
    fputc(*c == '\\' ? 'e' : *c, stream);
  }
}

static void man_option(FILE *stream, const cli_option *option)
{
  fputs(".TP\n", stream);
  if (option->letter)
    fprintf(stream, "\\fB\\-%c\\fR, ", option->letter);
  fputs("\\fB\\-\\-", stream);
  put_troff(stream, option->name);
  fputs("\\fR", stream);
  if (option->argument) {
    fputs(" \\fI", stream);
    put_troff(stream, option->argument);
    fputs("\\fR", stream);
  }
  fputc('\n', stream);
  put_troff(stream, option->help);
  if (option->choices) {
    fputs(": ", stream);
    put_choices(stream, option, ", ");
  }
  fputs(".\n", stream);
  if (option->commands == (option->commands & -option->commands))
    return;
  fputs("(", stream);
  const char *separator = "";
  for (size_t i = 0; i < cli_command_count; i++)
    if (option->commands & cli_commands[i].bit) {
      fprintf(stream, "%s%s", separator, cli_commands[i].name);
      separator = ", ";
    }
  fputs(")\n", stream);
}

static void man_commands(FILE *stream)
{
  for (size_t i = 0; i < cli_command_count; i++) {
    const cli_command *command = &cli_commands[i];
    fprintf(stream, ".TP\n\\fBzeroset %s\\fR ", command->name);
    put_troff(stream, command->operands);
    fputc('\n', stream);
    fprintf(stream, "%c", toupper((unsigned char)command->summary[0]));
    put_troff(stream, command->summary + 1);
    fputs(".\n", stream);
    put_troff(stream, command->description);
    fputc('\n', stream);
    bool own = false; /* options that only this command has */
    for (size_t j = 0; j < cli_option_count; j++) {
      if (cli_option_table[j].commands != command->bit)
        continue;
      fputs(own ? "" : ".RS\n", stream);
      own = true;
      man_option(stream, &cli_option_table[j]);
    }
    fputs(own ? ".RE\n" : "", stream);
  }
}

void cli_manual_page(FILE *stream)
{
  fprintf(stream,
          ".\\\" Generated from the program's tables: make regen\n"
          ".TH ZEROSET 1 \"\" \"Zeroset %s\" \"User Commands\"\n"
          ".SH NAME\n"
          "zeroset \\- implicit solids from XML scenes\n"
          ".SH SYNOPSIS\n"
          ".B zeroset\n.I command\n.RI [ scene ]\n.RI [ options ]\n"
          ".SH DESCRIPTION\n"
          "A scene file describes a solid as a tree of implicit functions, f >= 0 inside.\n"
          "The program turns it into meshes, volumes and pictures.\n"
          ".I scene\nis a file name, or \\(oq\\-\\(cq for standard input.\n"
          ".SH COMMANDS\n",
          zs_version());
  man_commands(stream);
  fputs(".SH OPTIONS OF SEVERAL COMMANDS\n", stream);
  for (size_t i = 0; i < cli_option_count; i++) {
    unsigned commands = cli_option_table[i].commands;
    if (commands != (commands & -commands))
      man_option(stream, &cli_option_table[i]);
  }
  fputs(".SH OPTIONS WITHOUT A COMMAND\n"
        ".TP\n\\fB\\-\\-version\\fR\nPrint the version and the instruction set in use.\n"
        ".TP\n\\fB\\-\\-help\\fR\nPrint the commands.\n"
        ".TP\n\\fB\\-\\-man\\-page\\fR\nPrint this page.\n"
        ".TP\n\\fB\\-\\-completion\\fR\nPrint the completion script for bash; use it with\n"
        ".EX\nsource <(zeroset \\-\\-completion)\n.EE\n"
        ".SH EXIT STATUS\n"
        ".TP\n0\nDone.\n"
        ".TP\n1\nThe scene is wrong.\n"
        ".TP\n2\nThe command line is wrong.\n"
        ".TP\n3\nA file could not be read or written.\n"
        ".TP\n4\nIt could not be computed: an unbounded solid, nothing inside the box, a singular\n"
        "fit, over the memory limit.\n"
        ".TP\n130\nInterrupted (128 plus the number of the signal), with no partial output left.\n"
        ".SH ENVIRONMENT\n"
        ".TP\nZEROSET_ISA\nAsks for a lesser instruction set than the machine offers: "
        "baseline, avx2 or avx512.\n"
        ".TP\nNO_COLOR\nWhen set, diagnostics have no colour.\n"
        ".SH EXAMPLES\n"
        ".EX\n"
        "zeroset mesh cup.xml \\-o cup.stl \\-\\-resolution 256\n"
        "zeroset render cup.xml \\-o cup.png \\-\\-set wall=4\n"
        "zeroset render morph.xml \\-o frame%04d.png \\-\\-sweep t=0:1:48\n"
        "echo 0 0 1 | zeroset eval cup.xml\n"
        ".EE\n",
        stream);
}

/* ---- Completion for bash ----------------------------------------------- */

static void completion_arguments(FILE *stream)
{
  fputs("  case \"$previous\" in\n", stream);
  for (size_t i = 0; i < cli_option_count; i++) {
    const cli_option *option = &cli_option_table[i];
    if (!option->choices)
      continue;
    fprintf(stream, "    --%s) COMPREPLY=($(compgen -W \"", option->name);
    put_choices(stream, option, " ");
    fputs("\" -- \"$word\")); return ;;\n", stream);
  }
  fputs("    --output|-o) COMPREPLY=($(compgen -f -- \"$word\")); return ;;\n"
        "    --allow-path) COMPREPLY=($(compgen -d -- \"$word\")); return ;;\n"
        "  esac\n",
        stream);
}

static void completion_options(FILE *stream)
{
  fputs("  case \"${COMP_WORDS[1]}\" in\n", stream);
  for (size_t i = 0; i < cli_command_count; i++) {
    fprintf(stream, "    %s) options=\"", cli_commands[i].name);
    const char *separator = "";
    for (size_t j = 0; j < cli_option_count; j++)
      if (cli_option_table[j].commands & cli_commands[i].bit) {
        fprintf(stream, "%s--%s", separator, cli_option_table[j].name);
        separator = " ";
      }
    fputs("\" ;;\n", stream);
  }
  fputs("  esac\n", stream);
}

void cli_completion(FILE *stream)
{
  fputs("# Completion of zeroset for bash, generated by zeroset --completion.\n"
        "_zeroset()\n"
        "{\n"
        "  local word=\"${COMP_WORDS[COMP_CWORD]}\" previous=\"${COMP_WORDS[COMP_CWORD-1]}\"\n"
        "  local options=\"\"\n"
        "  if [ \"$COMP_CWORD\" = 1 ]; then\n"
        "    COMPREPLY=($(compgen -W \"",
        stream);
  for (size_t i = 0; i < cli_command_count; i++)
    fprintf(stream, "%s ", cli_commands[i].name);
  fputs("--help --version --man-page --completion\" -- \"$word\"))\n"
        "    return\n"
        "  fi\n",
        stream);
  completion_arguments(stream);
  completion_options(stream);
  fputs("  case \"${COMP_WORDS[1]}/$word\" in\n"
        "    */-*) COMPREPLY=($(compgen -W \"$options\" -- \"$word\")) ;;\n"
        "    nodes/*) COMPREPLY=($(compgen -W \"$(zeroset nodes 2>/dev/null | awk '{print $1}')\""
        " -- \"$word\")) ;;\n"
        "    *) COMPREPLY=($(compgen -f -X '!*.xml' -- \"$word\") $(compgen -d -- \"$word\")) ;;\n"
        "  esac\n"
        "}\n"
        "complete -o filenames -F _zeroset zeroset\n",
        stream);
}
