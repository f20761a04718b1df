/* The program as a user meets it: exit statuses, messages, streams, files. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* ---- Running it ------------------------------------------------------------- */

enum { OUTPUT_SIZE = 1 << 20, MAXIMUM_ARGUMENTS = 24 };

typedef struct run {
  int status; /* exit status, or -signal */
  char *out, *err;
} run;

static char folder[] = "zeroset-cli-XXXXXX";

static int enter_folder(void **state)
{
  (void)state;
  return !mkdtemp(folder) || chdir(folder);
}

static int leave_folder(void **state)
{
  (void)state;
  char command[64];
  snprintf(command, sizeof command, "rm -rf '%s'", folder);
  return chdir("..") || system(command);
}

static void write_file(const char *name, const char *text)
{
  FILE *file = fopen(name, "wb");
  assert_non_null(file);
  fputs(text, file);
  assert_int_equal(fclose(file), 0);
}

static bool exists(const char *name)
{
  struct stat status;
  return stat(name, &status) == 0;
}

static char *read_file(const char *name)
{
  char *text = calloc(1, OUTPUT_SIZE + 1);
  FILE *file = fopen(name, "rb");
  assert_non_null(file);
  assert_true(fread(text, 1, OUTPUT_SIZE, file) < OUTPUT_SIZE);
  fclose(file);
  return text;
}

static void redirect(const char *name, int flags, int descriptor)
{
  FILE *file = fopen(name, flags ? "wb" : "rb");
  if (!file || dup2(fileno(file), descriptor) < 0)
    _exit(126);
}

/* Where the next program's standard error goes; -1: into run.err. */
static int standard_error = -1;

/* Start `zeroset` with words separated by '|', standard input from a file. */
static pid_t start(const char *words, const char *input)
{
  const char *program = getenv("ZEROSET");
  assert_non_null(program);
  pid_t child = fork();
  assert_true(child >= 0);
  if (child > 0)
    return child;
  /* The suite may run in the background, where interrupts are ignored. */
  signal(SIGINT, SIG_DFL);
  char *copy = strdup(words), *arguments[MAXIMUM_ARGUMENTS] = {(char *)"zeroset"};
  int count = 1;
  for (char *word = strtok(copy, "|"); word && count < MAXIMUM_ARGUMENTS - 1;
       word = strtok(NULL, "|"))
    arguments[count++] = word;
  redirect(input ? input : "/dev/null", 0, STDIN_FILENO);
  redirect("run.out", 1, STDOUT_FILENO);
  if (standard_error < 0)
    redirect("run.err", 1, STDERR_FILENO);
  else if (dup2(standard_error, STDERR_FILENO) < 0)
    _exit(126);
  execv(program, arguments);
  _exit(127);
}

static run finish(pid_t child)
{
  int status;
  assert_int_equal(waitpid(child, &status, 0), child);
  return (run){.status = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status),
               .out = read_file("run.out"),
               .err = read_file("run.err")};
}

static run zeroset(const char *words, const char *input)
{
  return finish(start(words, input));
}

static void done(run *r)
{
  free(r->out);
  free(r->err);
}

/* Run and expect a status, and a text on standard error (NULL: nothing at all). */
static void expect(const char *words, const char *input, int status, const char *message)
{
  run r = zeroset(words, input);
  if (r.status != status || (message ? !strstr(r.err, message) : *r.err))
    fail_msg("zeroset %s\nstatus %d, expected %d\n%s\nexpected: %s", words, r.status, status,
             r.err, message ? message : "nothing");
  done(&r);
}

static const char sphere[] = "<scene xmlns='urn:zeroset:scene:1' units='mm'>\n"
                             "  <param name='r' value='1' min='0.5' max='2'/>\n"
                             "  <object id='ball'><sphere radius='{r}'/></object>\n"
                             "</scene>\n";

/* ---- The command line -------------------------------------------------------- */

static void test_wrong_command_lines(void **state)
{
  (void)state;
  static const char *const cases[][2] = {
    {"mehs", "did you mean 'mesh'?"},
    {"--hepl", "did you mean '--help'?"},
    {"qqqqqq", "unknown command 'qqqqqq'"},
    {"mesh", "no scene given"},
    {"fit|s.xml", "no output given"},
    {"fit|s.xml|-o|s.stl", "one of .xml"},
    {"fit|s.xml|-o|f.xml|--object|a", "--object is not an option of 'zeroset fit'"},
    {"mesh|s.xml", "no output given"},
    {"mesh|s.xml|-o|part", "format of 'part' is not known"},
    {"mesh|s.xml|-o|part.png", "one of .stl .ply .obj .off .om"},
    {"mesh|s.xml|-o", "the value is missing"},
    {"mesh|s.xml|-o|p.stl|--resolutoin|3", "did you mean '--resolution'?"},
    {"mesh|s.xml|-o|p.stl|--size|3x3", "--size is not an option of 'zeroset mesh'"},
    {"mesh|s.xml|-o|p.stl|-Z", "unknown option '-Z'"},
    {"mesh|s.xml|-o|p.stl|--quiet=1", "--quiet: takes no value"},
    {"mesh|s.xml|-o|p.stl|--resolution|0", "--resolution: '0'"},
    {"mesh|s.xml|-o|p.stl|--resolution|-5", "--resolution: '-5'"},
    {"mesh|s.xml|-o|p.stl|--resolution|1000000000", "--resolution: '1000000000'"},
    {"mesh|s.xml|-o|p.stl|--resolution|99999999999999999999999", "--resolution"},
    {"mesh|s.xml|-o|p.stl|--resolution|12x", "--resolution: '12x'"},
    {"mesh|s.xml|-o|p.stl|--resolution|1.5", "--resolution: '1.5'"},
    {"mesh|s.xml|-o|p.stl|--resolution| 12", "--resolution: ' 12'"},
    {"mesh|s.xml|-o|p.stl|--cell|0", "--cell: '0'"},
    {"mesh|s.xml|-o|p.stl|--cell|1 2", "--cell: '1 2'"},
    {"mesh|s.xml|-o|p.stl|--cell|nan", "--cell: 'nan'"},
    {"mesh|s.xml|-o|p.stl|--cell|0x1", "--cell: '0x1'"},
    {"mesh|s.xml|-o|p.stl|--cell|1e999", "--cell: '1e999'"},
    {"mesh|s.xml|-o|p.stl|--cell|1|--resolution|3", "exclude each other"},
    {"mesh|s.xml|-o|p.stl|--threads|-1", "--threads: '-1'"},
    {"mesh|s.xml|-o|p.stl|--threads|0", "--threads: '0'"},
    {"mesh|s.xml|-o|p.stl|--memory|much", "--memory: 'much'"},
    {"mesh|s.xml|-o|p.stl|--memory|-1G", "--memory: '-1G'"},
    {"mesh|s.xml|-o|p.stl|--memory|1Q", "--memory: '1Q'"},
    {"mesh|s.xml|-o|p.stl|--method|magic", "expected contour or features"},
    {"mesh|s.xml|-o|p.stl|--simplify|-1", "--simplify: '-1'"},
    {"mesh|s.xml|-o|p.stl|--seed|1 2", "--seed: '1 2'"},
    {"mesh|s.xml|-o|p.stl|--seed|constraint", "or 'constraints'"},
    {"mesh|s.xml|-o|p.stl|--seed|constraints|--seed|1 2 3", "exclude each other"},
    {"mesh|s.xml|-o|p.stl|--report|xml", "expected json"},
    {"mesh|s.xml|-o|p.stl|--bounds|0 0 0 1 1", "--bounds"},
    {"mesh|s.xml|-o|p.stl|--bounds|0 0 0 1 0 1", "empty along y"},
    {"mesh|s.xml|-o|p.stl|--set|r", "expected NAME=VALUE"},
    {"mesh|s.xml|-o|p.stl|--set|=1", "expected NAME=VALUE"},
    {"mesh|s.xml|-o|p.stl|--set|r=", "is not a number"},
    {"mesh|s.xml|-o|p.stl|--set|r=1,5", "is not a number"},
    {"mesh|s.xml|-o|p.stl|--set|r=1 2", "is not a number"},
    {"mesh|s.xml|-o|p%d.stl|--sweep|r=0:1", "FROM:TO:COUNT"},
    {"mesh|s.xml|-o|p%d.stl|--sweep|r=0:1:0", "FROM:TO:COUNT"},
    {"mesh|s.xml|-o|p%d.stl|--sweep|r=0:1:2:3", "FROM:TO:COUNT"},
    {"mesh|s.xml|-o|p.stl|--sweep|r=0.5:1:2", "exactly one %d"},
    {"mesh|s.xml|-o|p%d%d.stl|--sweep|r=0.5:1:2", "exactly one %d"},
    {"mesh|s.xml|-o|p%s.stl|--sweep|r=0.5:1:2", "exactly one %d"},
    {"mesh|s.xml|-o|p%n%d.stl|--sweep|r=0.5:1:2", "exactly one %d"},
    {"mesh|s.xml|-o|p%999999999999d.stl|--sweep|r=0.5:1:2", "exactly one %d"},
    {"mesh|s.xml|-o|p%%.stl|--sweep|r=0.5:1:2", "exactly one %d"},
    {"mesh|s.xml|t.xml|-o|p.stl", "unexpected argument 't.xml'"},
    {"voxel|s.xml|-o|v.vti|--type|f16", "u8, i16, f32 or f64"},
    {"voxel|s.xml|-o|v.vti|--type|u8", "need --quantity inside"},
    {"voxel|s.xml|-o|v.vti|--quantity|colour", "value or inside"},
    {"render|s.xml|-o|v.png|--size|800", "--size: '800'"},
    {"render|s.xml|-o|v.png|--size|0x600", "--size: '0x600'"},
    {"render|s.xml|-o|v.png|--size|800x600x2", "--size: '800x600x2'"},
    {"render|s.xml|-o|v.png|--size|800x-600", "--size: '800x-600'"},
    {"render|s.xml|-o|v.png|--size|99999x600", "--size: '99999x600'"},
    {"slice|s.xml|-o|v.png|--size|600x32769", "each from 1 to 32768"},
    {"slice|s.xml|-o|v.png|--z|1|--axis|x", "--z excludes"},
    {"slice|s.xml|-o|v.png|--axis|w", "x, y or z"},
    {"slice|s.xml|-o|v.jpg", "one of .png .svg"},
    {"slice|s.xml|-o|v.png|--correspondence|--quantity|inside", "--correspondence is drawn"},
    {"slice|s.xml|-o|v.png|--correspondence=yes", "takes no value"},
    {"render|s.xml|-o|v.png|--correspondence", "--correspondence"},
    {"slice|s.xml|-o|v.png|--at|one", "--at: 'one'"},
    {"eval|-", "the scene must be a file"},
    {"nodes|torus|box", "unexpected argument 'box'"},
    {"nodes|torsu", "'torus'"},
    {"schema|--format|dtd", "rng or xsd"},
    {"schema|s.xml", "unexpected argument 's.xml'"},
  };
  write_file("s.xml", sphere);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    expect(cases[i][0], NULL, 2, cases[i][1]);
  assert_false(exists("p.stl"));
}

static void test_no_arguments_prints_the_usage(void **state)
{
  (void)state;
  expect("", NULL, 2, "usage: zeroset COMMAND");
}

static void test_help(void **state)
{
  (void)state;
  static const char *const commands[] = {"check", "info", "mesh",  "voxel", "render",
                                         "slice", "eval", "nodes", "schema"};
  run all = zeroset("--help", NULL);
  assert_int_equal(all.status, 0);
  for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
    assert_non_null(strstr(all.out, commands[i]));
    char words[32], usage[32];
    snprintf(words, sizeof words, "%s|--help", commands[i]);
    snprintf(usage, sizeof usage, "usage: zeroset %s", commands[i]);
    run one = zeroset(words, NULL);
    assert_int_equal(one.status, 0);
    assert_non_null(strstr(one.out, usage));
    assert_string_equal(one.err, "");
    done(&one);
  }
  done(&all);
}

static void test_version(void **state)
{
  (void)state;
  run r = zeroset("--version", NULL);
  assert_int_equal(r.status, 0);
  assert_int_equal(strncmp(r.out, "zeroset ", 8), 0);
  done(&r);
}

/* Generated files that are committed are current. */
static void current(const char *words, const char *path)
{
  char name[4096];
  const char *top = getenv("top_srcdir");
  assert_non_null(top);
  snprintf(name, sizeof name, "%s/%s", top, path);
  run r = zeroset(words, NULL);
  char *committed = read_file(name);
  assert_int_equal(r.status, 0);
  if (strcmp(r.out, committed) != 0)
    fail_msg("%s is not what 'zeroset %s' prints: make regen", path, words);
  free(committed);
  done(&r);
}

static void test_generated_files_are_current(void **state)
{
  (void)state;
  current("--man-page", "doc/zeroset.1");
  current("--completion", "doc/zeroset.bash");
  current("schema|--format|rng", "schema/zeroset.rng");
  current("schema|--format|xsd", "schema/zeroset.xsd");
  current("nodes|--manual", "doc/nodes.md");
}

/* ---- Scenes and files --------------------------------------------------------- */

static void test_check_says_nothing_of_a_good_scene(void **state)
{
  (void)state;
  write_file("s.xml", sphere);
  run r = zeroset("check|s.xml", NULL);
  assert_int_equal(r.status, 0);
  assert_string_equal(r.out, "");
  assert_string_equal(r.err, "");
  done(&r);
}

static void test_diagnostics_show_the_place(void **state)
{
  (void)state;
  write_file("bad.xml", "<scene xmlns='urn:zeroset:scene:1'>\n"
                        "  <torus tube='-0.2'/>\n"
                        "  <sphere raduis='1'/>\n"
                        "</scene>\n");
  run r = zeroset("check|bad.xml", NULL);
  assert_int_equal(r.status, 1);
  assert_non_null(strstr(r.err, "bad.xml:2:16: error: <torus>: tube: "));
  assert_non_null(strstr(r.err, "\n    <torus tube='-0.2'/>\n"
                                "                 ^\n"));
  assert_non_null(strstr(r.err, "bad.xml:3:11: error: <sphere>: raduis: "));
  assert_non_null(strstr(r.err, "did you mean 'radius'?"));
  assert_null(strchr(r.err, '\033')); /* no colour in a file */
  done(&r);
}

static void test_every_command_refuses_a_wrong_scene(void **state)
{
  (void)state;
  write_file("bad.xml", "<scene xmlns='urn:zeroset:scene:1'><shpere/></scene>\n");
  write_file("kept.stl", "kept");
  static const char *const commands[] = {
    "check|bad.xml", "info|bad.xml", "mesh|bad.xml|-o|kept.stl", "voxel|bad.xml|-o|v.vti",
    "render|bad.xml|-o|v.png", "slice|bad.xml|-o|v.png", "eval|bad.xml"};
  for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
    expect(commands[i], NULL, 1, "bad.xml:1:36: error: ");
  char *kept = read_file("kept.stl");
  assert_string_equal(kept, "kept");
  free(kept);
  assert_false(exists("v.vti"));
  assert_false(exists("v.png"));
}

static void test_unreadable_and_unwritable_files(void **state)
{
  (void)state;
  write_file("s.xml", sphere);
  mkdir("folder.stl", 0777);
  expect("check|absent.xml", NULL, 3, "absent.xml");
  expect("check|.", NULL, 3, "");
  expect("mesh|s.xml|-o|absent/p.stl", NULL, 3, "absent/p.stl: cannot be written: ");
  expect("mesh|s.xml|-o|folder.stl", NULL, 3, "it is a folder");
}

static void test_what_cannot_be_computed(void **state)
{
  (void)state;
  write_file("plane.xml", "<scene><half-space/></scene>");
  write_file("nothing.xml", "<scene><intersection><sphere/><sphere at='5 0 0'/></intersection>"
                            "</scene>");
  expect("mesh|plane.xml|-o|p.stl", NULL, 4, "error: ");
  expect("mesh|nothing.xml|-o|p.stl", NULL, 4, "error: ");
  expect("mesh|plane.xml|-o|p.stl|--resolution|8|--bounds|1 1 1 2 2 2", NULL, 4, "error: ");
  assert_false(exists("p.stl"));
  expect("mesh|plane.xml|-o|p.stl|--resolution|8|--bounds|-1 -1 -1 1 1 1|-q", NULL, 0, NULL);
  assert_true(exists("p.stl"));
  remove("p.stl");
}

static void test_parameters(void **state)
{
  (void)state;
  write_file("s.xml", sphere);
  expect("check|s.xml|--set|r=3", NULL, 2, "error: ");
  expect("check|s.xml|--set|q=1", NULL, 2, "error: ");
  expect("check|s.xml|--set|r=1.5", NULL, 0, NULL);
  expect("check|s.xml|--object|bll", NULL, 2, "error: ");
}

static void test_scene_from_standard_input(void **state)
{
  (void)state;
  write_file("s.xml", sphere);
  run r = zeroset("info|-|--json", "s.xml");
  assert_int_equal(r.status, 0);
  assert_non_null(strstr(r.out, "\"units\": \"mm\""));
  assert_non_null(strstr(r.out, "\"objects\": [\"ball\"]"));
  assert_non_null(strstr(r.out, "\"name\": \"r\", \"value\": 1, \"minimum\": 0.5, \"maximum\": 2"));
  done(&r);
  write_file("bad.xml", "<scene>\n<shpere/></scene>");
  expect("check|-", "bad.xml", 1, "<stdin>:2:");
  expect("check|-", NULL, 1, "<stdin>");
}

static void test_info_of_an_unbounded_solid(void **state)
{
  (void)state;
  write_file("plane.xml", "<scene><half-space/></scene>");
  run r = zeroset("info|plane.xml|--json", NULL);
  assert_int_equal(r.status, 0);
  assert_non_null(strstr(r.out, "\"bounds\": null"));
  done(&r);
}

/* The number after "name": in a JSON text. */
static double member(const char *json, const char *name)
{
  char key[64];
  snprintf(key, sizeof key, "\"%s\": ", name);
  const char *at = strstr(json, key);
  if (!at)
    fail_msg("no %s in %s", name, json);
  return strtod(at + strlen(key), NULL);
}

static void test_mesh_report(void **state)
{
  (void)state;
  write_file("s.xml", sphere);
  run r = zeroset("mesh|s.xml|-o|p.stl|--resolution|32|--report|json", NULL);
  assert_int_equal(r.status, 0);
  assert_string_equal(r.err, ""); /* no progress bar in a file */
  static const char *const names[] = {"load", "compile", "evaluate", "assemble", "write", "total",
                                      "evaluations", "peak_bytes", "threads", "vertices"};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++)
    assert_true(member(r.out, names[i]) >= 0);
  assert_true(member(r.out, "components") == 1);
  assert_true(member(r.out, "euler_characteristic") == 2);
  assert_true(member(r.out, "triangles") == 2 * member(r.out, "vertices") - 4);
  assert_true(fabs(member(r.out, "volume") - 4.18879) < 0.05);
  assert_true(fabs(member(r.out, "area") - 12.56637) < 0.1);
  assert_non_null(strstr(r.out, "\"closed\": true, \"manifold\": true"));
  assert_non_null(strstr(r.out, "\"isa\": \""));
  assert_non_null(strstr(r.out, "\"bounds\": ["));
  assert_int_equal(strchr(r.out, '\n') - r.out, (int)strlen(r.out) - 1);
  done(&r);
}

static void test_volume_and_slice_report_what_is_inside(void **state)
{
  (void)state;
  write_file("s.xml", sphere);
  run r = zeroset("voxel|s.xml|-o|v.nrrd|--resolution|20|--bounds|-1 -1 -1 1 1 1|"
                  "--quantity|inside|--report|json", NULL);
  assert_int_equal(r.status, 0);
  double part = member(r.out, "inside") / 8000;
  assert_true(fabs(part - 0.5236) < 0.02);
  done(&r);
  static const char *const slices[] = {
    "slice|s.xml|-o|v.png|--size|100x100|--bounds|-1 -1 -1 1 1 1|--quantity|inside|--report|json",
    "slice|s.xml|-o|v.svg|--size|100x100|--bounds|-1 -1 -1 1 1 1|--quantity|inside|--report|json",
    "slice|s.xml|-o|v.svg|--size|100x100|--bounds|-1 -1 -1 1 1 1|--correspondence|--report|json"};
  for (int i = 0; i < 3; i++) {
    r = zeroset(slices[i], NULL);
    assert_int_equal(r.status, 0);
    part = member(r.out, "inside") / 10000;
    assert_true(fabs(part - 0.7854) < 0.02);
    assert_true(member(r.out, "width") == 100);
    done(&r);
  }
}

/* What becomes what is told, in words and as data. */
static void test_info_tells_of_pairs(void **state)
{
  (void)state;
  write_file("i.xml", "<scene><interpolate at='0 0 7'><level at='0'><circle radius='1'/></level>"
                      "<between><pair from='0 0' to='3 4'/><pair from='0 1' to='3 4.5'/></between>"
                      "<level at='2'><circle radius='1' at='3 4 0'/></level></interpolate></scene>");
  run r = zeroset("info|i.xml", NULL);
  assert_int_equal(r.status, 0);
  assert_non_null(strstr(r.out, "from level 0 to 2: 2 given, of which the longest goes 5\n"));
  done(&r);
  r = zeroset("info|i.xml|--json", NULL);
  assert_int_equal(r.status, 0);
  assert_non_null(strstr(r.out, "\"pairs\": \"given\""));
  assert_non_null(strstr(r.out, "[0, 0, 7, 3, 4, 9]"));
  assert_true(member(r.out, "longest") == 5);
  done(&r);
}

static void test_sweep_names_its_files(void **state)
{
  (void)state;
  write_file("s.xml", sphere);
  run r = zeroset("mesh|s.xml|-o|100%%_%03d.stl|--sweep|r=0.5:1.5:3|--resolution|8|--report|json",
                  NULL);
  assert_int_equal(r.status, 0);
  assert_true(exists("100%_000.stl") && exists("100%_001.stl") && exists("100%_002.stl"));
  assert_false(exists("100%_003.stl"));
  const char *second = strchr(r.out, '\n') + 1, *third = strchr(second, '\n') + 1;
  assert_true(member(r.out, "value") == 0.5);
  assert_true(member(second, "value") == 1);
  assert_true(member(third, "value") == 1.5);
  assert_true(member(third, "volume") > 20 * member(r.out, "volume"));
  done(&r);
  /* Without a sweep the name is taken as it is. */
  expect("mesh|s.xml|-o|a%d.stl|--resolution|8|-q", NULL, 0, NULL);
  assert_true(exists("a%d.stl"));
  /* Half of the values are outside the parameter's range, which is told before any is written. */
  expect("mesh|s.xml|-o|b%d.stl|--sweep|r=1:4:2|--resolution|8|-q", NULL, 2, "error: ");
  assert_false(exists("b0.stl"));
  assert_false(exists("b1.stl"));
}

static void test_render_views(void **state)
{
  (void)state;
  write_file("v.xml", "<scene><view id='mine' direction='1 0 0'/><sphere/></scene>");
  expect("render|v.xml|-o|v.png|--size|20x20|--view|mine|-q", NULL, 0, NULL);
  expect("render|v.xml|-o|v.png|--size|20x20|--view|top|-q", NULL, 0, NULL);
  expect("render|v.xml|-o|v.png|--size|20x20|--view|nowhere", NULL, 2, "nowhere");
}

/* ---- Points --------------------------------------------------------------------- */

static void test_eval_text(void **state)
{
  (void)state;
  write_file("s.xml", sphere);
  write_file("points", "# x y z\n0 0 0\n\n 1e0, 0,0 # on the surface\r\n0\t2\t0\n-.5 +0 0.");
  run r = zeroset("eval|s.xml", "points");
  assert_int_equal(r.status, 0);
  double f[4];
  assert_int_equal(sscanf(r.out, "%lf\n%lf\n%lf\n%lf\n", f, f + 1, f + 2, f + 3), 4);
  const double expected[4] = {1, 0, -1, 0.5};
  for (int i = 0; i < 4; i++)
    assert_true(fabs(f[i] - expected[i]) < 1e-6);
  done(&r);
}

static void test_eval_gradient(void **state)
{
  (void)state;
  write_file("s.xml", sphere);
  write_file("points", "0.6 0 0.8\n");
  run r = zeroset("eval|s.xml|--gradient", "points");
  assert_int_equal(r.status, 0);
  double v[4];
  assert_int_equal(sscanf(r.out, "%lf %lf %lf %lf\n", v, v + 1, v + 2, v + 3), 4);
  const double expected[4] = {0, -0.6, 0, -0.8};
  for (int i = 0; i < 4; i++)
    assert_true(fabs(v[i] - expected[i]) < 1e-5);
  done(&r);
}

static void test_eval_names_the_wrong_line(void **state)
{
  (void)state;
  static const char *const lines[] = {"1 2\n", "1 2 3 4\n", "1 2 x\n", "1 2 0x3\n", "1 2 nan\n",
                                      "1 2 3;\n", "1,,2 3\n"};
  write_file("s.xml", sphere);
  for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) {
    char points[64];
    snprintf(points, sizeof points, "0 0 0\n\n%s0 0 0\n", lines[i]);
    write_file("points", points);
    expect("eval|s.xml", "points", 3, "<stdin>:3: error: expected three numbers");
  }
}

/* Text and binary, one thread and three, in one block and over many, agree. */
static void test_eval_round_trip(void **state)
{
  (void)state;
  enum { COUNT = 30000 };
  write_file("s.xml", sphere);
  FILE *text = fopen("points", "wb"), *binary = fopen("points.bin", "wb");
  for (int i = 0; i < COUNT; i++) {
    double p[3] = {sin(i), cos(3 * i), 0.001 * (i % 1000)};
    fprintf(text, "%.17g %.17g %.17g\n", p[0], p[1], p[2]);
    fwrite(p, sizeof p, 1, binary);
  }
  fclose(text);
  fclose(binary);
  run one = zeroset("eval|s.xml|--threads|1", "points");
  run three = zeroset("eval|s.xml|--threads|3", "points");
  assert_int_equal(one.status, 0);
  assert_string_equal(one.out, three.out);
  expect("eval|s.xml|--binary", "points.bin", 0, NULL);
  FILE *values = fopen("run.out", "rb");
  char *at = one.out;
  for (int i = 0; i < COUNT; i++) {
    double f;
    assert_int_equal(fread(&f, sizeof f, 1, values), 1);
    assert_true((float)strtod(at, &at) == (float)f);
  }
  assert_int_equal(fgetc(values), EOF);
  fclose(values);
  done(&one);
  done(&three);
}

static void test_eval_binary_ends_inside_a_point(void **state)
{
  (void)state;
  write_file("s.xml", sphere);
  write_file("points", "12345678901234567890123");
  expect("eval|s.xml|--binary", "points", 3, "ends inside a point");
}

/* ---- Long jobs --------------------------------------------------------------------- */

/* A job that would take hours. */
static const char slow_scene[] =
  "<scene><domain min='-9 -9 -9' max='9 9 9'/><formula>"
  "sin(3*x)*cos(5*y) + sin(7*z)*cos(2*x) + sin(x*y) - 0.1</formula></scene>";
static const char slow_job[] =
  "voxel|slow.xml|-o|slow.raw|--resolution|10000|--brute|--threads|1";

/* Whether the folder holds a file whose name begins with `prefix`. */
static bool any_file(const char *prefix)
{
  char command[64];
  snprintf(command, sizeof command, "ls -A | grep -q '%s'", prefix);
  return system(command) == 0;
}

static void interrupt(int number)
{
  write_file("slow.xml", slow_scene);
  pid_t child = start(slow_job, NULL);
  /* Wait until it is writing, so that there is something to leave behind. */
  for (int i = 0; i < 3000 && !any_file("slow.raw"); i++)
    usleep(20000);
  assert_true(any_file("slow.raw"));
  kill(child, number);
  run r = finish(child);
  assert_int_equal(r.status, 128 + number);
  assert_string_equal(r.err, ""); /* and no progress bar in a file */
  assert_false(any_file("slow.raw"));
  done(&r);
}

static void test_interrupted_leaves_no_file(void **state)
{
  (void)state;
  interrupt(SIGINT);
  interrupt(SIGTERM);
}

static void test_memory_limit(void **state)
{
  (void)state;
  write_file("s.xml", sphere);
  expect("mesh|s.xml|-o|limit.stl|--resolution|400|--memory|100k", NULL, 4, "error: ");
  assert_false(exists("limit.stl"));
}

/* Read a terminal until a text has come; the whole is in `seen`. */
static void read_until(int terminal, const char *text, char *seen, size_t size)
{
  size_t used = 0;
  while (!strstr(seen, text) && used + 1 < size) {
    ssize_t got = read(terminal, seen + used, size - 1 - used);
    if (got <= 0)
      fail_msg("the terminal ended with: %s", seen);
    used += (size_t)got;
    seen[used] = '\0';
  }
}

/* Start with standard error on a new terminal; returns its other end. */
static int start_on_terminal(const char *words, pid_t *child)
{
  int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  assert_true(terminal >= 0 && grantpt(terminal) == 0 && unlockpt(terminal) == 0);
  int slave = open(ptsname(terminal), O_RDWR | O_NOCTTY);
  assert_true(slave >= 0);
  standard_error = slave;
  *child = start(words, NULL);
  standard_error = -1;
  close(slave);
  return terminal;
}

static void test_progress_on_a_terminal(void **state)
{
  (void)state;
  char seen[8192] = "";
  pid_t child;
  write_file("slow.xml", slow_scene);
  int terminal = start_on_terminal(slow_job, &child);
  read_until(terminal, " left", seen, sizeof seen);
  assert_non_null(strstr(seen, " % "));
  assert_non_null(strstr(seen, "samples/s"));
  kill(child, SIGINT);
  int status;
  assert_int_equal(waitpid(child, &status, 0), child);
  assert_int_equal(WEXITSTATUS(status), 128 + SIGINT);
  close(terminal);
}

static void test_colour_on_a_terminal(void **state)
{
  (void)state;
  char seen[8192] = "";
  pid_t child;
  write_file("bad.xml", "<scene>\n<shpere/></scene>");
  setenv("TERM", "xterm", 1);
  unsetenv("NO_COLOR");
  int terminal = start_on_terminal("check|bad.xml", &child);
  read_until(terminal, "\033[1;31merror:\033[m", seen, sizeof seen);
  assert_int_equal(waitpid(child, NULL, 0), child);
  close(terminal);
}

static void test_full_output_is_an_error(void **state)
{
  (void)state;
  if (!exists("/dev/full"))
    skip();
  pid_t child = fork();
  assert_true(child >= 0);
  if (child == 0) {
    redirect("/dev/full", 1, STDOUT_FILENO);
    redirect("run.err", 1, STDERR_FILENO);
    execl(getenv("ZEROSET"), "zeroset", "nodes", (char *)NULL);
    _exit(127);
  }
  int status;
  assert_int_equal(waitpid(child, &status, 0), child);
  assert_int_equal(WEXITSTATUS(status), 3);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_wrong_command_lines),
    cmocka_unit_test(test_no_arguments_prints_the_usage),
    cmocka_unit_test(test_help),
    cmocka_unit_test(test_version),
    cmocka_unit_test(test_generated_files_are_current),
    cmocka_unit_test(test_check_says_nothing_of_a_good_scene),
    cmocka_unit_test(test_diagnostics_show_the_place),
    cmocka_unit_test(test_every_command_refuses_a_wrong_scene),
    cmocka_unit_test(test_unreadable_and_unwritable_files),
    cmocka_unit_test(test_what_cannot_be_computed),
    cmocka_unit_test(test_parameters),
    cmocka_unit_test(test_scene_from_standard_input),
    cmocka_unit_test(test_info_of_an_unbounded_solid),
    cmocka_unit_test(test_mesh_report),
    cmocka_unit_test(test_volume_and_slice_report_what_is_inside),
    cmocka_unit_test(test_info_tells_of_pairs),
    cmocka_unit_test(test_sweep_names_its_files),
    cmocka_unit_test(test_render_views),
    cmocka_unit_test(test_eval_text),
    cmocka_unit_test(test_eval_gradient),
    cmocka_unit_test(test_eval_names_the_wrong_line),
    cmocka_unit_test(test_eval_round_trip),
    cmocka_unit_test(test_eval_binary_ends_inside_a_point),
    cmocka_unit_test(test_interrupted_leaves_no_file),
    cmocka_unit_test(test_memory_limit),
    cmocka_unit_test(test_progress_on_a_terminal),
    cmocka_unit_test(test_colour_on_a_terminal),
    cmocka_unit_test(test_full_output_is_an_error),
  };
  return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
