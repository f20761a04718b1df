#include "cli/options.h"

#include "cli/commands.h"
#include "cli/text.h"

#include <errno.h>
#include <getopt.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

bool cli_error(const char *format, ...)
{
  va_list arguments;
  va_start(arguments, format);
  fputs("zeroset: error: ", stderr);
  vfprintf(stderr, format, arguments);
  fputc('\n', stderr);
  va_end(arguments);
  return false;
}

static bool out_of_memory(void)
{
  return cli_error("out of memory");
}

/* ---- Parsers of one option's argument ---------------------------------- */

static bool expected(const cli_option *option, const char *text, const char *what)
{
  return cli_error("--%s: '%s' is not understood; expected %s", option->name, text, what);
}

static void *member(const cli_option *option, cli_options *options)
{
  return (char *)options + option->offset;
}

static bool parse_flag(const cli_option *option, const char *text, cli_options *options)
{
  (void)text;
  *(bool *)member(option, options) = true;
  return true;
}

static bool parse_text(const cli_option *option, const char *text, cli_options *options)
{
  if (!*text)
    return cli_error("--%s: the value is empty", option->name);
  *(const char **)member(option, options) = text;
  return true;
}

/* The index of a choice, or -1 after saying what the choices are. */
static int choice(const cli_option *option, const char *text)
{
  char names[128] = "";
  size_t used = 0;
  for (int i = 0; option->choices[i]; i++) {
    if (strcmp(option->choices[i], text) == 0)
      return i;
    const char *separator = i == 0 ? "" : option->choices[i + 1] ? ", " : " or ";
    int length = snprintf(names + used, sizeof names - used, "%s%s", separator, option->choices[i]);
    used += (size_t)length < sizeof names - used ? (size_t)length : 0;
  }
  expected(option, text, names);
  return -1;
}

static bool parse_choice(const cli_option *option, const char *text, cli_options *options)
{
  int *value = member(option, options);
  *value = choice(option, text);
  return *value >= 0;
}

static bool parse_type(const cli_option *option, const char *text, cli_options *options)
{
  options->has_type = true;
  return parse_choice(option, text, options);
}

static bool parse_axis(const cli_option *option, const char *text, cli_options *options)
{
  options->has_axis = true;
  return parse_choice(option, text, options);
}

static bool parse_report(const cli_option *option, const char *text, cli_options *options)
{
  options->report_json = choice(option, text) == 0;
  return options->report_json;
}

/* name=..., up to the '='. */
static const char *setting_name(const cli_option *option, const char *text, cli_setting *setting)
{
  const char *equals = strchr(text, '=');
  if (!equals || equals == text) {
    cli_error("--%s: '%s' has no name; expected %s", option->name, text, option->argument);
    return NULL;
  }
  setting->name = text;
  setting->length = (size_t)(equals - text);
  return equals + 1;
}

static bool parse_set(const cli_option *option, const char *text, cli_options *options)
{
  cli_setting setting;
  const char *value = setting_name(option, text, &setting);
  if (!value)
    return false;
  if (!cli_number_parse(value, &setting.value))
    return cli_error("--set: '%s' is not a number; expected %s", value, option->argument);
  cli_setting *settings =
    realloc(options->settings, (options->setting_count + 1) * sizeof *settings);
  if (!settings)
    return out_of_memory();
  options->settings = settings;
  settings[options->setting_count++] = setting;
  return true;
}

enum { MAXIMUM_FRAMES = 1000000 };

static bool parse_sweep(const cli_option *option, const char *text, cli_options *options)
{
  const char *range = setting_name(option, text, &options->sweep_from);
  if (!range)
    return false;
  const char *middle = cli_number_scan(range, &options->sweep_from.value);
  const char *last =
    middle && *middle == ':' ? cli_number_scan(middle + 1, &options->sweep_to) : NULL;
  uint64_t count;
  if (!last || *last != ':' || !cli_integer_parse(last + 1, 1, MAXIMUM_FRAMES, &count))
    return cli_error("--sweep: '%s' is not understood; expected FROM:TO:COUNT, "
                     "with a count from 1 to %d", range, MAXIMUM_FRAMES);
  options->sweep_count = (unsigned)count;
  options->sweep = true;
  return true;
}

static bool parse_bounds(const cli_option *option, const char *text, cli_options *options)
{
  double *b = options->bounds;
  if (cli_numbers_parse(text, b, 6) != 6)
    return expected(option, text, "six numbers \"x0 y0 z0 x1 y1 z1\"");
  for (int k = 0; k < 3; k++)
    if (!(b[k] < b[k + 3]))
      return cli_error("--bounds: the box is empty along %c: %g is not less than %g", "xyz"[k],
                       b[k], b[k + 3]);
  options->has_bounds = true;
  return true;
}

enum {
  MAXIMUM_RESOLUTION = 100000,
  MAXIMUM_SIDE = 32768, /* of pictures, as zeroset.h says of zs_render_options */
  MAXIMUM_THREADS = 1024
};

static bool parse_resolution(const cli_option *option, const char *text, cli_options *options)
{
  uint64_t value;
  if (!cli_integer_parse(text, 1, MAXIMUM_RESOLUTION, &value))
    return expected(option, text, "a whole number from 1 to 100000");
  options->resolution = (uint32_t)value;
  return true;
}

static bool parse_cell(const cli_option *option, const char *text, cli_options *options)
{
  double *cell = options->cell;
  size_t count = cli_numbers_parse(text, cell, 3);
  if (count == 1)
    cell[1] = cell[2] = cell[0];
  if ((count != 1 && count != 3) || !(cell[0] > 0 && cell[1] > 0 && cell[2] > 0))
    return expected(option, text, "one or three lengths > 0");
  options->has_cell = true;
  return true;
}

static bool parse_simplify(const cli_option *option, const char *text, cli_options *options)
{
  if (!cli_number_parse(text, &options->simplify) || !(options->simplify > 0))
    return expected(option, text, "a length > 0");
  options->has_simplify = true;
  return true;
}

static bool parse_seed(const cli_option *option, const char *text, cli_options *options)
{
  double point[3];
  if (strcmp(text, "constraints") == 0) {
    options->seed_constraints = true;
    return true;
  }
  if (cli_numbers_parse(text, point, 3) != 3)
    return expected(option, text, "three numbers \"x y z\", or 'constraints'");
  double *seeds = realloc(options->seeds, 3 * (options->seed_count + 1) * sizeof *seeds);
  if (!seeds)
    return out_of_memory();
  options->seeds = seeds;
  memcpy(seeds + 3 * options->seed_count++, point, sizeof point);
  return true;
}

static bool parse_size(const cli_option *option, const char *text, cli_options *options)
{
  char first[16];
  const char *cross = strchr(text, 'x');
  size_t length = cross ? (size_t)(cross - text) : sizeof first;
  uint64_t width, height;
  if (length < sizeof first) {
    memcpy(first, text, length);
    first[length] = '\0';
    if (cli_integer_parse(first, 1, MAXIMUM_SIDE, &width) &&
        cli_integer_parse(cross + 1, 1, MAXIMUM_SIDE, &height)) {
      options->width = (uint32_t)width;
      options->height = (uint32_t)height;
      return true;
    }
  }
  return expected(option, text, "WIDTHxHEIGHT in pixels, such as 800x600, each from 1 to 32768");
}

static bool parse_at(const cli_option *option, const char *text, cli_options *options)
{
  if (!cli_number_parse(text, &options->at))
    return expected(option, text, "a number");
  *(bool *)member(option, options) = true;
  return true;
}

static bool parse_threads(const cli_option *option, const char *text, cli_options *options)
{
  uint64_t value;
  if (!cli_integer_parse(text, 1, MAXIMUM_THREADS, &value))
    return expected(option, text, "a whole number from 1 to 1024");
  options->threads = (unsigned)value;
  return true;
}

static bool parse_memory(const cli_option *option, const char *text, cli_options *options)
{
  if (!cli_bytes_parse(text, &options->memory))
    return expected(option, text, "a size such as 512M or 8G");
  return true;
}

static bool parse_allow_path(const cli_option *option, const char *text, cli_options *options)
{
  if (!*text)
    return cli_error("--%s: the value is empty", option->name);
  const char **paths =
    realloc(options->allow_paths, (options->allow_path_count + 1) * sizeof *paths);
  if (!paths)
    return out_of_memory();
  options->allow_paths = paths;
  paths[options->allow_path_count++] = text;
  return true;
}

/* ---- The options ------------------------------------------------------- */

static const char *const methods[] = {"contour", "features", NULL};
static const char *const quantities[] = {"value", "inside", NULL};
static const char *const types[] = {"u8", "i16", "f32", "f64", NULL};
static const char *const modes[] = {"shaded", "normals", "depth", NULL};
static const char *const axes[] = {"x", "y", "z", NULL};
static const char *const reports[] = {"json", NULL};
static const char *const formats[] = {"rng", "xsd", NULL};

enum {
  FILES = CLI_MESH | CLI_VOXEL | CLI_RENDER | CLI_SLICE, /* commands that write one */
  LONG = FILES | CLI_EVAL,                               /* commands that may take long */
  VIEWS = LONG | CLI_CHECK | CLI_INFO,                   /* commands that look at one object */
  SCENES = VIEWS | CLI_FIT,                              /* commands that read a scene */
  ALL = SCENES | CLI_NODES | CLI_SCHEMA
};

#define AT(member_) .offset = offsetof(cli_options, member_)

const cli_option cli_option_table[] = {
  {"output", 'o', "FILE", FILES | CLI_FIT, AT(output), .parse = parse_text,
   .help = "The file to write; the ending of its name is the format"},
  {"resolution", 'r', "N", CLI_MESH | CLI_VOXEL, .parse = parse_resolution,
   .help = "Cells along the longest side of the box (default 128)"},
  {"cell", 'c', "SIZE", CLI_MESH | CLI_VOXEL, .parse = parse_cell,
   .help = "Size of a cell, one number or \"x y z\", instead of --resolution"},
  {"method", 0, "NAME", CLI_MESH, AT(method), methods, parse_choice,
   "How the surface is found; features makes sharper edges and fewer slivers (default contour)"},
  {"simplify", 0, "ERROR", CLI_MESH, .parse = parse_simplify,
   .help = "Remove triangles while the surface moves less than ERROR"},
  {"seed", 0, "POINT", CLI_MESH, .parse = parse_seed,
   .help = "Keep only the connected part of the surface nearest to a point \"x y z\", or with "
           "'constraints' all parts that touch a point of a variational fit; may be repeated"},
  {"quantity", 0, "NAME", CLI_VOXEL | CLI_SLICE, AT(quantity), quantities, parse_choice,
   "What to write: the value of f, or whether f >= 0 (default value)"},
  {"type", 0, "NAME", CLI_VOXEL, AT(type), types, parse_type,
   "Type of the samples (default f32; u8 for --quantity inside)"},
  {"size", 0, "WxH", CLI_RENDER | CLI_SLICE, .parse = parse_size,
   .help = "Size of the picture in pixels (default 800x600; 1024x1024 for slice)"},
  {"view", 0, "VIEW", CLI_RENDER, AT(view), .parse = parse_text,
   .help = "A view of the scene by its id, or front, back, left, right, top, bottom, iso "
           "(default: the scene's first view, else iso)"},
  {"mode", 0, "NAME", CLI_RENDER, AT(mode), modes, parse_choice,
   "What the colours mean (default shaded)"},
  {"z", 0, "Z", CLI_SLICE, AT(has_z), .parse = parse_at,
   .help = "Cut at this z; short for --axis z --at Z"},
  {"axis", 0, "AXIS", CLI_SLICE, AT(axis), axes, parse_axis,
   "The axis that the cut is perpendicular to (default z)"},
  {"at", 0, "A", CLI_SLICE, AT(has_at), .parse = parse_at,
   .help = "Where along the axis to cut (default: the middle of the box)"},
  {"correspondence", 0, NULL, CLI_SLICE, AT(correspondence), .parse = parse_flag,
   .help = "Draw what becomes what between levels of an interpolation, or slices of a stack: an "
           "arrow for every pair, and where the cut is parallel to the levels the outlines on the "
           "one below (green) and the one above (violet)"},
  {"gradient", 0, NULL, CLI_EVAL, AT(gradient), .parse = parse_flag,
   .help = "Write f and its gradient, four numbers a point"},
  {"binary", 0, NULL, CLI_EVAL, AT(binary), .parse = parse_flag,
   .help = "Read and write 64-bit floating-point numbers in the machine's byte order, not text"},
  {"json", 0, NULL, CLI_INFO, AT(json), .parse = parse_flag, .help = "Write one JSON object"},
  {"format", 0, "NAME", CLI_SCHEMA, AT(format), formats, parse_choice,
   "RELAX NG or XML Schema (default rng)"},
  {"manual", 0, NULL, CLI_NODES, AT(manual), .parse = parse_flag,
   .help = "Write the whole reference manual, as in doc/nodes.md"},
  {"report", 0, "FORMAT", FILES, .choices = reports, .parse = parse_report,
   .help = "Report what was done as one JSON object on standard output"},
  {"object", 0, "ID", VIEWS, AT(object), .parse = parse_text,
   .help = "The object to work on (default: the scene's main object)"},
  {"set", 's', "NAME=VALUE", SCENES, .parse = parse_set,
   .help = "Set a parameter of the scene; may be repeated"},
  {"sweep", 0, "NAME=FROM:TO:COUNT", FILES, .parse = parse_sweep,
   .help = "Write one file for each of COUNT values of a parameter; the output name has the "
           "number of the file as %d or %04d"},
  {"bounds", 'b', "BOX", FILES, .parse = parse_bounds,
   .help = "The box to work in, \"x0 y0 z0 x1 y1 z1\" (default: the scene's domain, or a box "
           "around the solid)"},
  {"threads", 'j', "N", SCENES, .parse = parse_threads,
   .help = "Threads to use (default: one per processor)"},
  {"memory", 0, "SIZE", SCENES, .parse = parse_memory,
   .help = "Limit, such as 8G, that each of these is held against by itself, and refused when it "
           "is larger: a mesh and the grid that it is made on, a layer of a volume, a picture, a "
           "fit, and the samples that an element is made into.  Data from files, stacks and "
           "--simplify do not count"},
  {"brute", 0, NULL, FILES, AT(brute), .parse = parse_flag,
   .help = "Evaluate every sample with the whole program, to check the pruning"},
  {"allow-path", 0, "DIR", SCENES, .parse = parse_allow_path,
   .help = "Let the scene read files from this folder too; may be repeated"},
  {"quiet", 'q', NULL, SCENES, AT(quiet), .parse = parse_flag,
   .help = "Print errors only"},
  {"no-progress", 0, NULL, SCENES, AT(no_progress), .parse = parse_flag,
   .help = "Show no progress bar"},
  {"help", 'h', NULL, ALL, AT(help), .parse = parse_flag, .help = "Print this help"},
};

const size_t cli_option_count = sizeof cli_option_table / sizeof *cli_option_table;

/* ---- The parser -------------------------------------------------------- */

enum { MAXIMUM_OPTIONS = 64, FIRST_LONG = 256 };
_Static_assert(sizeof cli_option_table / sizeof *cli_option_table < MAXIMUM_OPTIONS,
               "the parser's tables are large enough");

/* The options of one command in getopt's form; val is FIRST_LONG + row. */
typedef struct getopt_tables {
  struct option options[MAXIMUM_OPTIONS];
  const char *names[MAXIMUM_OPTIONS];
  size_t count;
  char letters[3 * MAXIMUM_OPTIONS];
} getopt_tables;

static void tables_fill(getopt_tables *tables, const cli_command *command)
{
  char *letter = tables->letters;
  *letter++ = ':';
  for (size_t i = 0; i < cli_option_count; i++) {
    const cli_option *o = &cli_option_table[i];
    if (!(o->commands & command->bit))
      continue;
    tables->names[tables->count] = o->name;
    tables->options[tables->count++] = (struct option){
      o->name, o->argument ? required_argument : no_argument, NULL, FIRST_LONG + (int)i};
    if (o->letter) {
      *letter++ = o->letter;
      if (o->argument)
        *letter++ = ':';
    }
  }
  *letter = '\0';
}

static const cli_option *option_found(int code)
{
  if (code >= FIRST_LONG)
    return &cli_option_table[code - FIRST_LONG];
  for (size_t i = 0; i < cli_option_count; i++)
    if (code == cli_option_table[i].letter)
      return &cli_option_table[i];
  return NULL;
}

/* Whether some command has the option, for a better message. */
static bool option_exists(const char *name)
{
  for (size_t i = 0; i < cli_option_count; i++)
    if (strcmp(name, cli_option_table[i].name) == 0)
      return true;
  return false;
}

static bool unknown_option(const getopt_tables *tables, const cli_command *command,
                           const char *word)
{
  if (optopt >= FIRST_LONG)
    return cli_error("--%s: takes no value", option_found(optopt)->name);
  if (optopt)
    return cli_error("%s: unknown option '-%c'; try 'zeroset %s --help'", command->name, optopt,
                     command->name);
  char name[64];
  snprintf(name, sizeof name, "%.*s", (int)strcspn(word + 2, "="), word + 2);
  if (option_exists(name))
    return cli_error("--%s is not an option of 'zeroset %s'; try 'zeroset %s --help'", name,
                     command->name, command->name);
  const char *nearest = cli_suggest(name, tables->names, tables->count);
  if (nearest)
    return cli_error("%s: unknown option '--%s'; did you mean '--%s'?", command->name, name,
                     nearest);
  return cli_error("%s: unknown option '--%s'; try 'zeroset %s --help'", command->name, name,
                   command->name);
}

static bool parse_all_options(cli_options *options, const getopt_tables *tables, int argc,
                              char **argv)
{
  opterr = 0;
  optind = 1;
  int code;
  while ((code = getopt_long(argc, argv, tables->letters, tables->options, NULL)) != -1) {
    const cli_option *option = option_found(code == ':' ? optopt : code);
    if (code == '?')
      return unknown_option(tables, options->command, argv[optind - 1]);
    if (code == ':')
      return cli_error("--%s: the value is missing; expected --%s %s", option->name, option->name,
                       option->argument);
    if (!option->parse(option, optarg, options))
      return false;
  }
  return true;
}

static bool take_operands(cli_options *options, int count, char **operands)
{
  const cli_command *command = options->command;
  bool scene = command->bit & SCENES;
  bool node = command->bit & CLI_NODES;
  if (scene && count == 0)
    return cli_error("%s: no scene given; expected a file name, or '-' for standard input",
                     command->name);
  int most = scene || node;
  if (count > most)
    return cli_error("%s: unexpected argument '%s'", command->name, operands[most]);
  if (scene)
    options->scene = operands[0];
  else if (node && count)
    options->node = operands[0];
  if (scene && !*options->scene)
    return cli_error("%s: the scene's name is empty", command->name);
  return true;
}

static bool ending_known(const cli_options *options)
{
  char names[128] = "";
  size_t used = 0;
  for (const char *const *ending = options->command->endings; *ending; ending++) {
    if (cli_ends_with(options->output, *ending))
      return true;
    used += (size_t)snprintf(names + used, sizeof names - used, " %s", *ending);
  }
  return cli_error("--output: the format of '%s' is not known; expected a name that ends in one of%s",
                   options->output, names);
}

static bool output_good(const cli_options *options)
{
  if (!options->command->endings)
    return true;
  if (!options->output)
    return cli_error("%s: no output given; expected -o FILE", options->command->name);
  if (!ending_known(options))
    return false;
  if (!options->sweep)
    return true;
  char *name = cli_frame_name(options->output, 0);
  free(name);
  if (name)
    return true;
  if (errno == ENOMEM)
    return out_of_memory();
  return cli_error("--output: '%s' cannot name the files of a sweep; expected exactly one %%d "
                   "or %%04d", options->output);
}

/* What no single option can see. */
static bool consistent(const cli_options *options)
{
  if (options->resolution && options->has_cell)
    return cli_error("--resolution and --cell exclude each other");
  if (options->seed_constraints && options->seed_count)
    return cli_error("--seed: points and 'constraints' exclude each other");
  if (options->has_z && (options->has_at || options->has_axis))
    return cli_error("--z excludes --axis and --at");
  if (options->command->bit & CLI_EVAL && strcmp(options->scene, "-") == 0)
    return cli_error("eval: standard input holds the points; the scene must be a file");
  if (options->correspondence && options->quantity == ZS_QUANTITY_INSIDE && options->output &&
      !cli_ends_with(options->output, ".svg"))
    return cli_error("--correspondence is drawn over values of f, or in an SVG file; it excludes "
                     "--quantity inside here");
  if (options->manual && options->node)
    return cli_error("nodes: --manual and a name exclude each other");
  if (options->command->bit & CLI_VOXEL && options->quantity == ZS_QUANTITY_VALUE &&
      options->type != ZS_SAMPLE_F32 && options->type != ZS_SAMPLE_F64)
    return cli_error("--type: values of f are written as f32 or f64; "
                     "u8 and i16 need --quantity inside");
  return output_good(options);
}

static void defaults(cli_options *options, const cli_command *command)
{
  *options = (cli_options){
    .command = command, .axis = 2, .quantity = ZS_QUANTITY_VALUE, .type = ZS_SAMPLE_F32};
}

bool cli_options_parse(cli_options *options, const cli_command *command, int argc, char **argv)
{
  getopt_tables tables = {.count = 0};
  tables_fill(&tables, command);
  defaults(options, command);
  if (!parse_all_options(options, &tables, argc, argv))
    return false;
  if (options->help)
    return true;
  if (!take_operands(options, argc - optind, argv + optind) || !consistent(options))
    return false;
  if (options->quantity == ZS_QUANTITY_INSIDE && !options->has_type)
    options->type = ZS_SAMPLE_U8;
  return true;
}

void cli_options_clear(cli_options *options)
{
  free(options->settings);
  free(options->allow_paths);
  free(options->seeds);
}
