/* <path>: path data and SVG files against shapes that are known otherwise. */
#include "scene_text.h"

#include "../random.h"

#include <math.h>
#include <stdarg.h>

/* Two scenes have the same f around a square of that size about (x, y). */
static void expect_same(const char *a, const char *b, double x, double y, double size,
                        double tolerance)
{
  zs_field *fields[2] = {compile(a), compile(b)};
  zs_eval *evals[2] = {evaluator(fields[0]), evaluator(fields[1])};
  uint64_t state = 5;
  for (int i = 0; i < 500; i++) {
    const double p[3] = {x + random_between(&state, -size, size),
                         y + random_between(&state, -size, size), random_between(&state, -9, 9)};
    const double f = zs_eval_point(evals[0], p), g = zs_eval_point(evals[1], p);
    if (!(fabs(f - g) <= tolerance))
      fail_msg("at %g %g: %.9g and %.9g in\n%s\n%s", p[0], p[1], f, g, a, b);
  }
  for (int i = 0; i < 2; i++) {
    zs_eval_free(evals[i]);
    zs_field_unref(fields[i]);
  }
}

static void test_lines(void **unused)
{
  (void)unused;
  static const char *const squares[] = {
    "M1 2L5 2L5 4L1 4Z", "m 1,2 h4 v2 h-4 z", "M1 2H5V4H1z", "M1 2 5 2 5 4 1 4",
    "m1 2 4 0 0 2-4 0", "M9 9M1 2l4 0 l0 2L1,4,1,2z", "M1e0 20e-1H5.V+4H1Z",
    "M1 2H5V4H1V2H5V4H1Z"};
  for (size_t i = 0; i < sizeof squares / sizeof *squares; i++) {
    char body[300];
    snprintf(body, sizeof body, "<path d='%s'/>", squares[i]);
    expect_same(body, "<rectangle size='4 2' at='3 3 0'/>", 3, 3, 5, 1e-12);
  }
  /* Several rings; after Z the next one begins where the one before did. */
  expect_same("<path d='M0 0h1v1h-1z l-1 0 0 -1 1 0 z'/>",
              "<union><rectangle size='1 1' at='0.5 0.5 0'/>"
              "<rectangle size='1 1' at='-0.5 -0.5 0'/></union>", 0, 0, 0.4, 1e-12);
}

static void test_arcs(void **unused)
{
  (void)unused;
  expect_same("<path tolerance='1e-6' d='M2 1A1 1 0 0 1 0 1A1 1 0 0 1 2 1Z'/>",
              "<circle radius='1' at='1 1 0'/>", 1, 1, 3, 1.1e-6);
  /* Flags without spaces, radii too small, negative and turned: the same circle. */
  expect_same("<path tolerance='1e-6' d='m2 1a.1-.1 77 00-2 0 .5.5 0 102 0'/>",
              "<circle radius='1' at='1 1 0'/>", 1, 1, 3, 1.1e-6);
  /* Three quarters, and the other way round what is left. */
  expect_same("<path tolerance='1e-6' d='M1 0 A1 1 0 1 1 0 -1 L0 0Z M0 0 V-1 A1 1 0 0 1 1 0Z'/>",
              "<circle radius='1'/>", 0, 0, 2, 1.1e-6);
  /* An ellipse that is turned. */
  expect_same("<path tolerance='1e-6' rotate='0 0 -30' d='M 1.7320508075688772 1 A 2 1 30 0 1 "
              "-1.7320508075688772 -1 A 2 1 30 0 1 1.7320508075688772 1'/>",
              "<path tolerance='1e-6' d='M2 0A2 1 0 0 1 -2 0A2 1 0 0 1 2 0'/>", 0, 0, 3, 4e-6);
  const char *ellipse = "<path tolerance='1e-7' d='M2 0A2 1 0 0 1 -2 0A2 1 0 0 1 2 0'/>";
  for (int i = 0; i < 12; i++) { /* its zeros are those of an ellipse */
    const double t = 0.5 * i;
    assert_true(fabs(value_in(ellipse, 2 * cos(t), sin(t), 0)) < 1.1e-7);
  }
  /* No radius: a line. */
  expect_same("<path d='M0 0A0 1 0 0 1 1 0V1H0Z'/>", "<rectangle size='1 1' at='0.5 0.5 0'/>", 0, 0,
              2, 1e-12);
}

/* Points of Bezier curves are zeros of f. */
static void test_curves(void **unused)
{
  (void)unused;
  const char *cubic = "<path tolerance='1e-7' d='M0 0C0 2 3 1 2 0Z'/>";
  const char *quadratic = "<path tolerance='1e-7' d='M0 0Q1 3 2 0Z'/>";
  for (int i = 1; i < 10; i++) {
    const double t = 0.1 * i, r = 1 - t;
    assert_true(fabs(value_in(cubic, 9 * r * t * t + 2 * t * t * t,
                              6 * r * r * t + 3 * r * t * t, 0)) < 1.1e-7);
    assert_true(fabs(value_in(quadratic, 2 * r * t + 2 * t * t, 6 * r * t, 0)) < 1.1e-7);
  }
  /* S and T mirror the control point before, and other curves have none to mirror. */
  static const char *const pairs[][2] = {
    {"M0 0C0 1 1 1 1 0S2-1 2 0L2 3L0 3", "M0 0C0 1 1 1 1 0C1-1 2-1 2 0L2 3L0 3"},
    {"M0 0c0 1 1 1 1 0s1-1 1 0l0 3l-2 0", "M0 0C0 1 1 1 1 0C1-1 2-1 2 0L2 3L0 3"},
    {"M0 0Q1 1 2 0T4 0T6 0L6 5L0 5", "M0 0Q1 1 2 0Q3-1 4 0Q5 1 6 0L6 5L0 5"},
    {"M0 0q1 1 2 0t2 0t2 0v5h-6", "M0 0Q1 1 2 0Q3-1 4 0Q5 1 6 0L6 5L0 5"},
    {"M0 0L1 0S2 1 3 0V4H0", "M0 0L1 0C1 0 2 1 3 0V4H0"},
    {"M0 0L1 0T3 0V4H0", "M0 0L3 0V4H0"},
    {"M0 0Q1 1 2 0S3 1 4 0V4H0", "M0 0Q1 1 2 0C2 0 3 1 4 0V4H0"}};
  for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
    char a[200], b[200];
    snprintf(a, sizeof a, "<path d='%s'/>", pairs[i][0]);
    snprintf(b, sizeof b, "<path d='%s'/>", pairs[i][1]);
    expect_same(a, b, 2, 1, 4, 1e-10);
  }
}

#define STAR "M0 1L.588-.809L-.951.309L.951.309L-.588-.809Z"

static void test_fill_rules(void **unused)
{
  (void)unused;
  assert_true(value_in("<path d='" STAR "'/>", 0, 0, 0) > 0.3);
  assert_true(value_in("<path d='" STAR "' fill-rule='even-odd'/>", 0, 0, 0) < -0.3);
  /* A hole turns the other way round, or not. */
  const char *other = "M0 0H6V6H0ZM2 2V4H4V2Z", *same = "M0 0H6V6H0ZM2 2H4V4H2Z";
  char body[200];
  for (int i = 0; i < 4; i++) {
    snprintf(body, sizeof body, "<path d='%s' fill-rule='%s'/>", i < 2 ? other : same,
             i % 2 ? "even-odd" : "nonzero");
    if (i == 2) /* no hole, and no edges in it */
      assert_true(value_in(body, 3, 3, 0) == 3);
    else
      assert_true(value_in(body, 3, 3, 0) == -1 && value_in(body, 1, 1, 0) == 1);
  }
}

/* ---- Files ------------------------------------------------------------------------- */

__attribute__((format(printf, 1, 2))) static void write_svg(const char *format, ...)
{
  FILE *file = create("a.svg");
  va_list arguments;
  va_start(arguments, format);
  vfprintf(file, format, arguments);
  va_end(arguments);
  assert_int_equal(fclose(file), 0);
}

#define SVG "<svg xmlns='http://www.w3.org/2000/svg'"
#define DOWN "<path src='a.svg' y='down' tolerance='1e-5'/>"

static void test_shapes(void **unused)
{
  (void)unused;
  static const struct {
    const char *text, *same;
  } cases[] = {
    {"<rect x='1' y='2' width='4' height='2'/>", "<rectangle size='4 2' at='3 3 0'/>"},
    {"<rect x='1' y='2' width='4' height='2' rx='.5'/>",
     "<rectangle size='4 2' round='0.5' at='3 3 0'/>"},
    {"<circle cx='3' cy='3' r='2'/>", "<circle radius='2' at='3 3 0'/>"},
    {"<ellipse cx='3' cy='3' rx='2' ry='2'/>", "<circle radius='2' at='3 3 0'/>"},
    {"<polygon points='1,2 5,2 5,4 1,4'/>", "<rectangle size='4 2' at='3 3 0'/>"},
    {"<polyline points='1 2 5 2 5 4 1 4'/>", "<rectangle size='4 2' at='3 3 0'/>"},
    {"<path d='M1 2H5V4H1'/>", "<rectangle size='4 2' at='3 3 0'/>"},
    {"<g transform='translate(1 2)'><g transform='scale(2,1)'><rect width='2' height='2'/></g></g>",
     "<rectangle size='4 2' at='3 3 0'/>"},
    {"<rect width='2' height='4' transform='translate(5,2) rotate(90)'/>",
     "<rectangle size='4 2' at='3 3 0'/>"},
    {"<rect x='2' y='1' width='2' height='4' transform='rotate(90 3 3)'/>",
     "<rectangle size='4 2' at='3 3 0'/>"},
    {"<circle r='1' transform='matrix(0 2 2 0 3 3)'/>", "<circle radius='2' at='3 3 0'/>"},
    {"<path d='M0 0H4V2H0Z' transform='translate(3 2) skewX(45) skewX(-45) translate(-2)'/>",
     "<rectangle size='4 2' at='3 3 0'/>"},
    {"<svg x='1' y='2' width='4' height='2' viewBox='0 0 40 20'><rect width='40' height='20'/>"
     "</svg>",
     "<rectangle size='4 2' at='3 3 0'/>"},
    /* Overlapping ones are joined; what is not shown is left out. */
    {"<rect x='1' y='2' width='3' height='2'/><rect x='2' y='2' width='3' height='2'/>"
     "<defs><circle r='9'/></defs><circle r='9' display='none'/>"
     "<g style='fill:red; display : none'><circle r='9'/></g><circle/><rect width='0' height='9'/><path/><title>t</title>",
     "<rectangle size='4 2' at='3 3 0'/>"},
    {"<g fill-rule='evenodd'><path d='M0 0H6V6H0ZM2 2H4V4H2Z'/></g>",
     "<difference><rectangle size='6 6' at='3 3 0'/><rectangle size='2 2' at='3 3 0'/>"
     "</difference>"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    write_svg("<?xml version='1.0'?>\n<!DOCTYPE svg PUBLIC '-//W3C//DTD SVG 1.1//EN' "
              "'http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd'>\n" SVG ">%s</svg>",
              cases[i].text);
    expect_same(DOWN, cases[i].same, 3, 3, i + 1 < sizeof cases / sizeof *cases ? 5 : 1, 2e-4);
  }
}

static void test_pages(void **unused)
{
  (void)unused;
  const char *up = "<path src='a.svg'/>", *square = "<rectangle size='4 2' at='3 3 0'/>";
  /* The lower side of the page is at y = 0. */
  write_svg(SVG " width='10' height='10'><rect x='1' y='6' width='4' height='2'/></svg>");
  expect_same(up, square, 3, 3, 5, 1e-9);
  write_svg(SVG " viewBox='0 0 20 10'><rect x='1' y='6' width='4' height='2'/></svg>");
  expect_same(up, square, 3, 3, 5, 1e-9);
  write_svg(SVG " width='10mm' height='1cm' viewBox='0 0 100 100'>"
            "<rect x='10' y='60' width='40' height='20'/></svg>");
  expect_same(up, square, 3, 3, 5, 1e-9);
  write_svg(SVG " width='100mm' height='100mm'><rect x='1mm' y='96mm' width='4mm' height='2mm'/>"
            "</svg>");
  expect_same(up, square, 3, 3, 5, 1e-9);
  write_svg(SVG " width='20' height='10' viewBox='0 0 10 10'>" /* as large as fits, in the middle */
            "<rect x='-4' y='6' width='4' height='2'/></svg>");
  expect_same(up, square, 3, 3, 5, 1e-9);
  write_svg(SVG " width='20' height='10' viewBox='0 0 10 10' preserveAspectRatio='none'>"
            "<rect x='.5' y='6' width='2' height='2'/></svg>");
  expect_same(up, square, 3, 3, 5, 1e-9);
  write_svg(SVG " width='10' height='10'><g id='a'><circle r='3'/></g><g transform='scale(2)'>"
            "<rect id='b' x='.5' y='3' width='2' height='1'/></g></svg>");
  expect_same("<path src='a.svg' group='b'/>", square, 3, 3, 5, 1e-9);
}

/* Style sheets are not read: those that would matter are told of, once. */
static void test_sheets(void **unused)
{
  (void)unused;
  static const struct {
    const char *sheet;
    unsigned warnings;
  } cases[] = {{"", 0},
               {"<style>.a { fill: #123; stroke: none }</style>", 0},
               {"<defs><style>.a { fill-rule: evenodd }</style></defs>", 1},
               {"<style><![CDATA[.a { display:none }]]></style><style>.b{display:none}</style>", 1}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    write_svg(SVG ">%s<circle class='a' r='2'/></svg>", cases[i].sheet);
    seen s = {.message = ""};
    zs_diag diag = {.report = keep, .context = &s};
    zs_scene *scene = parse("<path src='a.svg'/>", &diag);
    zs_field *field = zs_scene_compile(scene, NULL, NULL, &diag);
    assert_non_null(field);
    assert_int_equal(diag.warnings, cases[i].warnings);
    if (cases[i].warnings)
      assert_non_null(strstr(s.message, "style sheet"));
    zs_field_unref(field);
    zs_scene_free(scene);
  }
}

/* ---- What is wrong ------------------------------------------------------------------- */

static void test_mistakes(void **unused)
{
  (void)unused;
  static const char *const cases[][2] = {
    {"<path/>", "neither 'd' nor 'src'"},
    {"<path d='' />", "enclose nothing"},
    {"<path d='M0 0'/>", "enclose nothing"},
    {"<path d='M0 0L1 1Z'/>", "enclose nothing"},
    {"<path d='L1 1'/>", "has to begin with M, found 'L' (character 1)"},
    {"<path d='M0 0 X'/>", "'X' is not a command of path data (character 6)"},
    {"<path d='M0 0 L1'/>", "expected a number at the end"},
    {"<path d='M0 0 L1 ,Z'/>", "expected a number, found 'Z' (character 10)"},
    {"<path d='M0 0 A1 1 0 2 0 1 1'/>", "expected 0 or 1 as a flag"},
    {"<path d='M0 0 L1e99 1'/>", "expected a number, found '1e99"},
    {"<path d='M0 0H1V1Z' y='up'/>", "'y' belongs with 'src'"},
    {"<path d='M0 0H1V1Z' tolerance='0'/>", "expected 'auto' or a length > 0"},
    {"<path src='none.svg'/>", "cannot be opened"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    refuses(cases[i][0], cases[i][1]);
  static const char *const files[][2] = {
    {"", "the file is empty; expected <svg>"},
    {"<html/>", "the root element is no <svg>"},
    {SVG "/>", "there are no shapes"},
    {SVG "><text>A</text></svg>", "there are no shapes"},
    {SVG "><path d='M0 0 Q'/></svg>", "expected a number at the end"},
    {SVG "><rect width='-1' height='1'/></svg>", "'-1' is negative"},
    {SVG "><rect width='1em' height='1'/></svg>", "'1em' is not a length"},
    {SVG "><g transform='turn(3)'><rect width='1' height='1'/></g></svg>", "list of transforms"},
    {SVG "><g transform='scale(1,2,3)'><rect/></g></svg>", "not a list of transforms"},
    {SVG "><g transform='matrix(1 0 0 1 0 0 7)'><rect/></g></svg>", "not a list of transforms"},
    {SVG " viewBox='0 0 1 1 1'><rect width='1' height='1'/></svg>", "is not x, y, width"},
    {SVG " viewBox='0 0 0 1'><rect width='1' height='1'/></svg>", "is not x, y, width"},
    {SVG "><polygon points='1 2 3'/></svg>", "is not a list of points"},
    {"<!DOCTYPE svg [<!ENTITY a 'b'>]>" SVG "/>", "document type declaration"},
    {SVG "><g></svg>", "does not close"}};
  for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
    write_text("a.svg", files[i][0]);
    refuses("<path src='a.svg'/>", files[i][1]);
  }
  write_text("a.svg", SVG "><rect width='1' height='1'/></svg>");
  refuses("<path src='a.svg' group='x'/>", "no element with the id 'x'");
}

/* Path data and files with some characters changed: read or refused. */
static void test_mutations(void **unused)
{
  (void)unused;
  static const char good[] =
    SVG " viewBox='0 0 9 9' width='9mm'><g transform='rotate(10 1 1) scale(2)' style='a:b;c'>"
        "<path d='M1 2.5l3-4 5,6H7v8c1 2 3 4 5 6s1 2 3 4Q1 2 3 4t5 6a7 8 9 0 1 2 3z'/>"
        "<rect x='1' width='2' height='3' rx='1%'/></g><polygon points='1 2 3 4 5 9'/></svg>";
  uint64_t state = 4;
  for (int i = 0; i < 400; i++) {
    char text[sizeof good];
    strcpy(text, good);
    for (unsigned m = 1 + random_below(&state, 4); m > 0; m--)
      text[random_below(&state, sizeof good - 1)] =
        "0123456789.-+eEmMzZaAcCsSqQtTlLhHvV <>='\"()%/,;:"[random_below(&state, 49)];
    write_text("m.svg", text);
    zs_diag diag = {0};
    zs_scene *scene = parse("<path src='m.svg'/>", &diag);
    assert_non_null(scene);
    zs_field *field = zs_scene_compile(scene, NULL, NULL, &diag);
    assert_true((field == NULL) == (diag.errors > 0));
    zs_field_unref(field);
    zs_scene_free(scene);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_lines),      cmocka_unit_test(test_arcs),
    cmocka_unit_test(test_curves),     cmocka_unit_test(test_fill_rules),
    cmocka_unit_test(test_shapes),     cmocka_unit_test(test_pages),
    cmocka_unit_test(test_sheets),     cmocka_unit_test(test_mistakes),
    cmocka_unit_test(test_mutations)};
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
