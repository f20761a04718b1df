/* Files: relative names, includes, and the fence around the scene's folder. */
#include "zeroset.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "print.h"

#include <cmocka.h>

/* ---- A folder of scenes -------------------------------------------------- */

static char folder[] = "test-include-XXXXXX";

static void write_file(const char *path, const char *text)
{
  FILE *stream = fopen(path, "w");
  assert_non_null(stream);
  fputs(text, stream);
  fclose(stream);
}

/*  outside.xml
 *  scene/main.xml, scene/parts/... */
static int enter(void **state)
{
  (void)state;
  return mkdtemp(folder) && chdir(folder) == 0 && mkdir("scene", 0700) == 0 &&
             mkdir("scene/parts", 0700) == 0
           ? 0
           : -1;
}

static int leave(void **state)
{
  (void)state;
  static const char *const files[] = {
    "scene/main.xml", "scene/parts/a.xml", "scene/parts/b.xml", "scene/parts/c.xml",
    "scene/link.xml", "scene/folder-link", "scene/pipe", "outside.xml"};
  for (size_t i = 0; i < sizeof files / sizeof files[0]; i++)
    unlink(files[i]);
  rmdir("scene/parts");
  rmdir("scene");
  return chdir("..") == 0 && rmdir(folder) == 0 ? 0 : -1;
}

#define BALL "<object id='ball'><sphere/></object>"

/* Load scene/main.xml and compare what is reported. */
static void assert_load(const zs_scene_options *options, const char *expected)
{
  static printed p;
  p.length = 0;
  p.text[0] = '\0';
  zs_diag diag = {.report = print_diagnostic, .context = &p};
  zs_scene *scene = zs_scene_load("scene/main.xml", options, &diag);
  assert_string_equal(p.text, expected);
  assert_true((scene == NULL) == (diag.errors > 0));
  zs_scene_free(scene);
}

/* ---- Includes ----------------------------------------------------------- */

static void test_names_are_relative_to_the_file(void **state)
{
  (void)state;
  write_file("scene/main.xml",
             "<scene><include href='parts/a.xml'/><sphere radius='{r}'/></scene>");
  write_file("scene/parts/a.xml", "<scene><include href='b.xml'/><include href='../parts/c.xml'/>"
                                  "<param name='r' value='{q + 1}'/></scene>");
  write_file("scene/parts/b.xml", "<scene><param name='q' value='1'/></scene>");
  write_file("scene/parts/c.xml", "<scene>" BALL "</scene>");
  zs_scene *scene = zs_scene_load("scene/main.xml", NULL, NULL);
  assert_non_null(scene);
  zs_parameter p;
  assert_int_equal(zs_scene_parameter_count(scene), 2);
  assert_true(zs_scene_parameter(scene, 1, &p) && p.value == 2);
  assert_int_equal(zs_scene_object_count(scene), 1);
  assert_string_equal(zs_scene_object(scene, 0), "ball");
  zs_scene_free(scene);
}

/* Two ways to one file do not define its objects twice. */
static void test_files_are_read_once(void **state)
{
  (void)state;
  write_file("scene/main.xml", "<scene><include href='parts/a.xml'/><include href='parts/b.xml'/>"
                               "<include href='./parts/../parts/c.xml'/>"
                               "<use object='ball'/></scene>");
  write_file("scene/parts/a.xml", "<scene><include href='c.xml'/></scene>");
  write_file("scene/parts/b.xml", "<scene><include href='c.xml'/></scene>");
  write_file("scene/parts/c.xml", "<scene>" BALL "</scene>");
  assert_load(NULL, "");
}

/* Nodes, domain and views of an included file are its own affair. */
static void test_only_definitions_are_included(void **state)
{
  (void)state;
  write_file("scene/main.xml", "<scene><include href='parts/a.xml'/></scene>");
  write_file("scene/parts/a.xml", "<scene main='ball'><domain min='0 0 0' max='1 1 1'/>"
                                  "<view direction='1 0 0'/><box/>" BALL "</scene>");
  zs_diag diag = {0};
  zs_scene *scene = zs_scene_load("scene/main.xml", NULL, &diag);
  assert_non_null(scene);
  assert_int_equal(zs_scene_view_count(scene), 0);
  assert_int_equal(diag.warnings, 0);
  zs_field *field = zs_scene_compile(scene, NULL, NULL, &diag); /* the ball */
  assert_non_null(field);
  zs_eval *eval = zs_eval_new(field, &diag);
  static const double corner[3] = {0.9, 0.9, 0.9}; /* in the box, not in the ball */
  assert_true(zs_eval_point(eval, corner) < 0);
  zs_eval_free(eval);
  zs_field_unref(field);
  zs_scene_free(scene);
}

static void test_errors_name_the_included_file(void **state)
{
  (void)state;
  write_file("scene/main.xml", "<scene><include href='parts/a.xml'/><use object='ball'/></scene>");
  write_file("scene/parts/a.xml", "<scene>\n  <object id='ball'>\n    <sphere radius='0'/>"
                                  "\n  </object>\n</scene>");
  assert_load(NULL, "scene/parts/a.xml:3:21: error: <sphere>: radius: '0' is zero; expected a "
                    "length > 0\n");
  write_file("scene/parts/a.xml", "<scene>\n  <object");
  assert_load(NULL, "scene/parts/a.xml:2:10: error: the file ends inside <object>, opened in line "
                    "2\nscene/main.xml:1:50: error: <use>: object: there is no object 'ball'\n");
}

static void test_circles(void **state)
{
  (void)state;
  write_file("scene/main.xml", "<scene><include href='main.xml'/><sphere/></scene>");
  assert_load(NULL, "scene/main.xml:1:23: error: <include>: href: includes itself: scene/main.xml "
                    "-> scene/main.xml\n");
  write_file("scene/main.xml", "<scene><include href='parts/a.xml'/><sphere/></scene>");
  write_file("scene/parts/a.xml", "<scene><include href='b.xml'/></scene>");
  write_file("scene/parts/b.xml", "<scene><include href='a.xml'/></scene>");
  assert_load(NULL, "scene/parts/b.xml:1:23: error: <include>: href: includes itself: "
                    "scene/parts/a.xml -> scene/parts/b.xml -> scene/parts/a.xml\n");
}

/* ---- The fence ---------------------------------------------------------- */

#define OUTSIDE(name) \
  "scene/main.xml:1:23: error: <include>: href: '" name \
  "' is outside the folder of the scene; allow its folder with --allow-path\n"

static void test_outside(void **state)
{
  (void)state;
  write_file("outside.xml", "<scene>" BALL "</scene>");
  write_file("scene/main.xml", "<scene><include href='../outside.xml'/><sphere/></scene>");
  assert_load(NULL, OUTSIDE("../outside.xml"));
  const char *paths[] = {"."};
  zs_scene_options options;
  zs_scene_options_init(&options);
  options.allow_paths = paths;
  options.allow_path_count = 1;
  assert_load(&options, "");
  paths[0] = "scene/parts";
  assert_load(&options, OUTSIDE("../outside.xml"));
  paths[0] = "no-such-folder";
  assert_load(&options, "error: allowed folder 'no-such-folder': No such file or directory\n");
}

/* Where a link leads counts, not where it is. */
static void test_links(void **state)
{
  (void)state;
  write_file("outside.xml", "<scene>" BALL "</scene>");
  assert_int_equal(symlink("../outside.xml", "scene/link.xml"), 0);
  write_file("scene/main.xml", "<scene><include href='link.xml'/><sphere/></scene>");
  assert_load(NULL, OUTSIDE("link.xml"));
  assert_int_equal(symlink("..", "scene/folder-link"), 0);
  write_file("scene/main.xml", "<scene><include href='folder-link/outside.xml'/><sphere/></scene>");
  assert_load(NULL, OUTSIDE("folder-link/outside.xml"));
  write_file("scene/main.xml", "<scene><include href='folder-link/scene/parts/c.xml'/></scene>");
  write_file("scene/parts/c.xml", "<scene>" BALL "</scene>");
  assert_load(NULL, "");
}

/* A folder whose name begins like the scene's is another folder. */
static void test_similar_names(void **state)
{
  (void)state;
  assert_int_equal(mkdir("scene-2", 0700), 0);
  write_file("scene-2/a.xml", "<scene>" BALL "</scene>");
  write_file("scene/main.xml", "<scene><include href='../scene-2/a.xml'/><sphere/></scene>");
  assert_load(NULL, OUTSIDE("../scene-2/a.xml"));
  unlink("scene-2/a.xml");
  rmdir("scene-2");
}

static void test_what_is_no_file(void **state)
{
  (void)state;
  static const struct {
    const char *href, *message;
  } cases[] = {
    {"", "'' names no file"},
    {"parts", "'parts' is a folder; expected a file"},
    {"pipe", "'pipe' is a pipe or device; expected a file"},
    {"parts/none.xml", "'parts/none.xml' cannot be opened: No such file or directory"},
    {"main.xml/x", "'main.xml/x' cannot be opened: Not a directory"},
    {"http://localhost/a.xml", "'http://localhost/a.xml' is a URL; expected the name of a file"},
    {"file:///etc/passwd", "'file:///etc/passwd' is a URL; expected the name of a file"},
  };
  assert_int_equal(mkfifo("scene/pipe", 0600), 0);
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    char text[256], expected[512];
    snprintf(text, sizeof text, "<scene><include href='%s'/><sphere/></scene>", cases[i].href);
    snprintf(expected, sizeof expected, "scene/main.xml:1:23: error: <include>: href: %s\n",
             cases[i].message);
    write_file("scene/main.xml", text);
    assert_load(NULL, expected);
  }
}

/* ---- The scene's own file ----------------------------------------------- */

static void test_unreadable_scenes(void **state)
{
  (void)state;
  static printed p;
  zs_diag diag = {.report = print_diagnostic, .context = &p};
  p.length = 0;
  assert_null(zs_scene_load("scene/none.xml", NULL, &diag));
  assert_null(zs_scene_load("scene", NULL, &diag));
  assert_string_equal(p.text, "scene/none.xml: error: No such file or directory\n"
                              "scene: error: is a folder\n");
  assert_int_equal(diag.status, ZS_ERROR_IO);
  zs_scene_options options;
  zs_scene_options_init(&options);
  options.maximum_file_size = 10;
  p.length = 0;
  write_file("scene/main.xml", "<scene><sphere/></scene>");
  assert_load(&options, "scene/main.xml: error: larger than the limit for scene files\n");
}

/* Text in memory finds files in the folder of its name. */
static void test_text_in_memory(void **state)
{
  (void)state;
  static const char text[] = "<scene><include href='parts/c.xml'/><use object='ball'/></scene>";
  write_file("scene/parts/c.xml", "<scene>" BALL "</scene>");
  zs_scene *scene = zs_scene_parse(text, strlen(text), "scene/<stdin>", NULL, NULL);
  assert_non_null(scene);
  zs_scene_free(scene);
  assert_null(zs_scene_parse(text, strlen(text), "<stdin>", NULL, NULL));
  static const char alone[] = "<scene><sphere/></scene>";
  scene = zs_scene_parse(alone, strlen(alone), "no/such/folder/x.xml", NULL, NULL);
  assert_non_null(scene);
  zs_scene_free(scene);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_names_are_relative_to_the_file),
    cmocka_unit_test(test_files_are_read_once),
    cmocka_unit_test(test_only_definitions_are_included),
    cmocka_unit_test(test_errors_name_the_included_file),
    cmocka_unit_test(test_circles),
    cmocka_unit_test(test_outside),
    cmocka_unit_test(test_links),
    cmocka_unit_test(test_similar_names),
    cmocka_unit_test(test_what_is_no_file),
    cmocka_unit_test(test_unreadable_scenes),
    cmocka_unit_test(test_text_in_memory),
  };
  return cmocka_run_group_tests(tests, enter, leave);
}
