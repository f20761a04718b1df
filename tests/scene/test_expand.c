/* Scenes that are right: what the tree of nodes holds. */
#include "scene/tree.h"

#include "../comma_locale.h"
#include "../random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "print.h"

#include <cmocka.h>

/* ---- Helpers ------------------------------------------------------------ */

typedef struct expanded {
  zs_scene *scene;
  zs_arena arena;
  zs_tree tree;
  printed printed;
  zs_diag diag;
} expanded;

static void load(expanded *e, const char *text)
{
  memset(e, 0, sizeof *e);
  e->diag = (zs_diag){.report = print_diagnostic, .context = &e->printed};
  e->scene = zs_scene_parse(text, strlen(text), "test.xml", NULL, &e->diag);
  if (!e->scene)
    fail_msg("%s%s", e->printed.text, text);
}

static void expand_again(expanded *e, const char *object)
{
  zs_arena_free(&e->arena);
  if (!zs_scene_expand(e->scene, object, &e->arena, &e->tree, &e->diag))
    fail_msg("%s", e->printed.text);
}

static void expand(expanded *e, const char *text)
{
  load(e, text);
  expand_again(e, NULL);
}

static void end(expanded *e)
{
  zs_arena_free(&e->arena);
  zs_scene_free(e->scene);
}

/* The number in an attribute of a node, found by the kind's table. */
static double number(const zs_node *node, const char *name)
{
  const zs_kind *kind = node->kind;
  for (size_t i = 0; i < kind->attribute_count; i++)
    if (strcmp(kind->attributes[i].name, name) == 0)
      return *(const double *)((const char *)node->parameters + kind->attributes[i].offset);
  fail_msg("<%s> has no attribute '%s'", kind->name, name);
  return 0;
}

static bool given(const zs_node *node, const char *name)
{
  for (size_t i = 0; i < node->kind->attribute_count; i++)
    if (strcmp(node->kind->attributes[i].name, name) == 0)
      return node->given >> i & 1;
  return false;
}

static void assert_near(double a, double b, double tolerance)
{
  if (!(fabs(a - b) <= tolerance))
    fail_msg("%.17g is not %.17g", a, b);
}

/* ---- Attributes --------------------------------------------------------- */

static void test_values(void **state)
{
  (void)state;
  expanded e;
  expand(&e, "<scene><param name='r' value='3'/><union r-function='r0'>"
             "<sphere radius='{r/2}'/><sphere radius=' 2.5 '/><sphere/>"
             "<box min='{-r}, 0 -1' max='1,2,3'/><box size='{r}'/></union></scene>");
  const zs_node *root = e.tree.root;
  assert_string_equal(root->kind->name, "union");
  assert_int_equal(root->child_count, 5);
  assert_int_equal(e.tree.node_count, 6);
  assert_true(number(root->children[0], "radius") == 1.5);
  assert_true(number(root->children[1], "radius") == 2.5);
  assert_true(number(root->children[2], "radius") == 1); /* default */
  assert_true(given(root->children[1], "radius"));
  assert_false(given(root->children[2], "radius"));
  const zs_kind *box = zs_kind_find("box");
  for (size_t i = 0; i < box->attribute_count; i++) {
    const double *v = (const double *)((const char *)root->children[3]->parameters +
                                       box->attributes[i].offset);
    const double *s = (const double *)((const char *)root->children[4]->parameters +
                                       box->attributes[i].offset);
    if (strcmp(box->attributes[i].name, "min") == 0) {
      assert_true(v[0] == -3 && v[1] == 0 && v[2] == -1);
      assert_true(isnan(s[0]) && isnan(s[2])); /* absent, without a default */
    }
    if (strcmp(box->attributes[i].name, "size") == 0)
      assert_true(s[0] == 3 && s[1] == 3 && s[2] == 3);
  }
  end(&e);
}

/* Every number may be written as an expression, whatever its kind's type. */
static void test_expressions_stand_for_numbers(void **state)
{
  (void)state;
  expanded e;
  expand(&e, "<scene><param name='a' value='1'/><param name='b' value='{a + 1}'/>"
             "<object id='o'><sphere radius='{b > a ? hypot(3, 4) : 0}'"
             " at='{a} {b} {a + b}' scale='{b}'/></object></scene>");
  const zs_node *sphere = e.tree.root;
  assert_true(number(sphere, "radius") == 5);
  static const double inverse[12] = {0.5, 0, 0, -0.5, 0, 0.5, 0, -1, 0, 0, 0.5, -1.5};
  for (int i = 0; i < 12; i++)
    assert_true(sphere->placement[i] == inverse[i]);
  assert_true(sphere->placement_scale == 2);
  end(&e);
}

static void test_comma_locale(void **state)
{
  (void)state;
  if (!set_comma_locale())
    skip();
  expanded e;
  expand(&e, "<scene><sphere radius='1.5' at='0.25 {0.5 + 0.25} 0'/></scene>");
  assert_true(number(e.tree.root, "radius") == 1.5);
  assert_true(e.tree.root->placement[3] == -0.25 && e.tree.root->placement[7] == -0.75);
  e.printed.length = 0;
  zs_diag diag = {.report = print_diagnostic, .context = &e.printed};
  const char *text = "<scene><sphere radius='{0.5 - 1}'/></scene>";
  assert_null(zs_scene_parse(text, strlen(text), "x.xml", NULL, &diag));
  assert_string_equal(e.printed.text, "x.xml:1:24: error: <sphere>: radius: '{0.5 - 1}' = -0.5 is "
                                      "negative; expected a length > 0\n");
  setlocale(LC_NUMERIC, "C");
  end(&e);
}

/* ---- Placement ---------------------------------------------------------- */

static void rotate(double p[3], int axis, double degrees)
{
  double angle = degrees * (3.14159265358979323846 / 180), c = cos(angle), s = sin(angle);
  double u = p[(axis + 1) % 3], v = p[(axis + 2) % 3];
  p[(axis + 1) % 3] = c * u - s * v;
  p[(axis + 2) % 3] = s * u + c * v;
}

/* The placement undoes: scale, rotate about x, then y, then z, translate. */
static void test_placement_is_the_inverse(void **state)
{
  (void)state;
  uint64_t seed = 11;
  for (int round = 0; round < 200; round++) {
    double at[3], turn[3], scale[3], least = INFINITY;
    for (int i = 0; i < 3; i++) {
      at[i] = random_between(&seed, -10, 10);
      turn[i] = random_between(&seed, -400, 400);
      scale[i] = random_between(&seed, 0.1, 3) * (random_below(&seed, 2) ? 1 : -1);
      least = fmin(least, fabs(scale[i]));
    }
    char text[512];
    snprintf(text, sizeof text,
             "<scene><sphere at='%.17g %.17g %.17g' rotate='%.17g %.17g %.17g' "
             "scale='%.17g %.17g %.17g'/></scene>",
             at[0], at[1], at[2], turn[0], turn[1], turn[2], scale[0], scale[1], scale[2]);
    expanded e;
    expand(&e, text);
    const double *m = e.tree.root->placement;
    double p[3], q[3];
    for (int i = 0; i < 3; i++) {
      p[i] = random_between(&seed, -5, 5);
      q[i] = p[i] * scale[i];
    }
    rotate(q, 0, turn[0]);
    rotate(q, 1, turn[1]);
    rotate(q, 2, turn[2]);
    for (int i = 0; i < 3; i++)
      q[i] += at[i];
    for (int i = 0; i < 3; i++)
      assert_near(m[4 * i] * q[0] + m[4 * i + 1] * q[1] + m[4 * i + 2] * q[2] + m[4 * i + 3], p[i],
                  1e-10);
    assert_near(e.tree.root->placement_scale, least, 1e-15);
    end(&e);
  }
}

/* Quarter turns move axes to axes, with no rounding left over. */
static void test_quarter_turns_are_exact(void **state)
{
  (void)state;
  for (int x = -4; x <= 5; x++) {
    for (int y = -4; y <= 5; y++) {
      char text[128];
      expanded e;
      snprintf(text, sizeof text, "<scene><sphere rotate='%d %d 270'/></scene>", 90 * x, 90 * y);
      expand(&e, text);
      const double *m = e.tree.root->placement;
      for (int i = 0; i < 3; i++) {
        int ones = 0;
        for (int j = 0; j < 3; j++) {
          assert_true(m[4 * i + j] == 0 || fabs(m[4 * i + j]) == 1);
          ones += m[4 * i + j] != 0;
        }
        assert_int_equal(ones, 1);
      }
      end(&e);
    }
  }
}

static void test_no_placement(void **state)
{
  (void)state;
  expanded e;
  expand(&e, "<scene><sphere/></scene>");
  assert_null(e.tree.root->placement);
  assert_true(e.tree.root->placement_scale == 1);
  end(&e);
}

/* ---- Structure ---------------------------------------------------------- */

static void test_use_is_shared(void **state)
{
  (void)state;
  expanded e;
  expand(&e, "<scene><object id='main'><union><use object='ball'/><use object='ball'/>"
             "<use object='ball' at='1 0 0'/></union></object>"
             "<object id='ball'><sphere/></object>"
             "<object id='last'><use object='main'/></object></scene>");
  const zs_node *root = e.tree.root;
  assert_int_equal(root->child_count, 3);
  assert_ptr_equal(root->children[0], root->children[1]);
  assert_ptr_not_equal(root->children[0], root->children[2]);
  assert_string_equal(root->children[2]->kind->name, "union");
  assert_ptr_equal(root->children[2]->children[0], root->children[0]);
  assert_true(root->children[2]->placement[3] == -1);
  assert_int_equal(e.tree.node_count, 3); /* union, sphere, the placed one */
  end(&e);
}

static void test_main_object(void **state)
{
  (void)state;
  static const struct {
    const char *text, *kind;
  } cases[] = {
    {"<scene main='a'><object id='a'><box/></object><object id='b'><sphere/></object></scene>",
     "box"},
    {"<scene><object id='a'><box/></object><object id='b'><sphere/></object></scene>", "sphere"},
    {"<scene><torus/></scene>", "torus"},
    {"<scene><torus/><sphere/></scene>", "union"},
    {"<scene><object id='a'><box/><sphere/></object></scene>", "union"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    expanded e;
    expand(&e, cases[i].text);
    assert_string_equal(e.tree.root->kind->name, cases[i].kind);
    assert_int_equal(e.diag.errors + e.diag.warnings, 0);
    end(&e);
  }
}

static void test_named_objects(void **state)
{
  (void)state;
  expanded e;
  load(&e, "<scene><object id='a'><box/></object><object id='b'><sphere/></object></scene>");
  assert_int_equal(zs_scene_object_count(e.scene), 2);
  assert_string_equal(zs_scene_object(e.scene, 0), "a");
  assert_string_equal(zs_scene_object(e.scene, 1), "b");
  assert_null(zs_scene_object(e.scene, 2));
  expand_again(&e, "a");
  assert_string_equal(e.tree.root->kind->name, "box");
  assert_false(zs_scene_expand(e.scene, "c", &e.arena, &e.tree, &e.diag));
  assert_int_equal(e.diag.status, ZS_ERROR_ARGUMENT);
  end(&e);
}

static void test_unused_nodes_are_warned_of_once(void **state)
{
  (void)state;
  expanded e;
  expand(&e, "<scene>\n<object id='a'><box/></object>\n<sphere/></scene>");
  assert_string_equal(e.tree.root->kind->name, "box");
  assert_int_equal(e.diag.warnings, 1);
  assert_string_equal(e.printed.text,
                      "test.xml:3:1: warning: <sphere>: not part of the main object, 'a'\n");
  end(&e);
}

static void test_instances(void **state)
{
  (void)state;
  expanded e;
  expand(&e, "<scene><param name='k' value='10'/>"
             "<union><instance of='ball' r='2'/><instance of='ball' r='{k/5}' s='7' at='0 0 1'/>"
             "<repeat for='k' from='1' to='2'><instance of='ball' r='{k}'/></repeat></union>"
             "<define name='ball'><argument name='r'/><argument name='s' value='{r * k}'/>"
             "<sphere radius='{s}'/></define></scene>");
  const zs_node *root = e.tree.root;
  assert_int_equal(root->child_count, 4);
  assert_true(number(root->children[0], "radius") == 20);
  assert_string_equal(root->children[1]->kind->name, "union");
  assert_true(number(root->children[1]->children[0], "radius") == 7);
  /* The counter named k is not seen in the definition. */
  assert_true(number(root->children[2], "radius") == 10);
  assert_true(number(root->children[3], "radius") == 20);
  end(&e);
}

static void test_repeat(void **state)
{
  (void)state;
  static const struct {
    const char *range;
    size_t count;
    double first, last;
  } cases[] = {
    {"from='1' to='3'", 3, 1, 3},
    {"from='1' to='1'", 1, 1, 1},
    {"from='3' to='1' step='-1'", 3, 3, 1},
    {"from='0.1' to='1' step='0.1'", 10, 0.1, 1},
    {"from='0' to='1' step='0.3'", 4, 0, 0.9},
    {"from='2' to='{5 * 3}' step='5'", 3, 2, 12},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    char text[256];
    expanded e;
    snprintf(text, sizeof text,
             "<scene><union><repeat for='i' %s><sphere at='{i} 0 0'/></repeat></union></scene>",
             cases[i].range);
    expand(&e, text);
    assert_int_equal(e.tree.root->child_count, cases[i].count);
    assert_near(e.tree.root->children[0]->placement[3], -cases[i].first, 0);
    assert_near(e.tree.root->children[cases[i].count - 1]->placement[3], -cases[i].last, 1e-15);
    end(&e);
  }
}

/* An inner counter may use the outer one; an empty range leaves nothing. */
static void test_nested_repeat(void **state)
{
  (void)state;
  expanded e;
  expand(&e, "<scene><union><box/><repeat for='i' from='0' to='4'>"
             "<repeat for='j' from='1' to='{i}'><sphere radius='{10 * i + j}'/></repeat></repeat></union></scene>");
  const zs_node *root = e.tree.root;
  assert_int_equal(root->child_count, 1 + 1 + 2 + 3 + 4);
  size_t k = 1;
  for (int i = 0; i <= 4; i++)
    for (int j = 1; j <= i; j++)
      assert_true(number(root->children[k++], "radius") == 10 * i + j);
  end(&e);
}

static void test_formula(void **state)
{
  (void)state;
  expanded e;
  expand(&e, "<scene><param name='r' value='2'/><repeat for='i' from='5' to='5'>"
             "<formula>let a = r * i; a - x - z * z</formula></repeat></scene>");
  const zs_kind *kind = e.tree.root->kind;
  assert_string_equal(kind->name, "formula");
  assert_true(kind->attributes[0].type == ZS_FORMULA);
  const zs_formula *f =
    (const zs_formula *)((const char *)e.tree.root->parameters + kind->attributes[0].offset);
  assert_int_equal(f->expression->variable_count, 4);
  assert_int_equal(f->axis[0], -1);
  assert_true(f->number[0] == 2);
  assert_int_equal(f->axis[1], -1);
  assert_true(f->number[1] == 5);
  assert_int_equal(f->axis[2], 0);
  assert_int_equal(f->axis[3], 2);
  end(&e);
}

static void test_parts(void **state)
{
  (void)state;
  expanded e;
  expand(&e, "<scene><interpolate><repeat for='i' from='0' to='2'><level at='{i}'>"
             "<circle radius='{1 + i}'/></level></repeat></interpolate></scene>");
  assert_int_equal(e.tree.root->child_count, 3);
  for (size_t i = 0; i < 3; i++) {
    const zs_node *level = e.tree.root->children[i];
    assert_int_equal(level->kind->family, ZS_FAMILY_PART);
    assert_null(level->placement); /* its `at` is its own */
    assert_true(number(level, "at") == (double)i);
    assert_int_equal(level->child_count, 1);
  }
  end(&e);
}

static void test_places(void **state)
{
  (void)state;
  expanded e;
  expand(&e, "<scene>\n  <sphere\n radius='2'/></scene>");
  assert_int_equal(e.tree.root->place.line, 2);
  assert_int_equal(e.tree.root->place.column, 3);
  assert_string_equal(e.tree.root->place.element, "sphere");
  zs_place radius = zs_node_place(e.tree.root, "radius");
  assert_int_equal(radius.line, 3);
  assert_int_equal(radius.column, 10);
  zs_place absent = zs_node_place(e.tree.root, "at");
  assert_int_equal(absent.line, 2);
  assert_string_equal(absent.attribute, "at");
  end(&e);
}

/* ---- Parameters, domain, views ------------------------------------------ */

static double value_of(const zs_scene *scene, size_t index)
{
  zs_parameter p;
  assert_true(zs_scene_parameter(scene, index, &p));
  return p.value;
}

static void test_parameters(void **state)
{
  (void)state;
  expanded e;
  load(&e, "<scene><param name='a' value='2' min='1' max='{2 * 4}' doc='size'/>"
           "<param name='b' value='{a * a}' max='50'/><sphere radius='{b}'/></scene>");
  zs_parameter p;
  assert_int_equal(zs_scene_parameter_count(e.scene), 2);
  assert_true(zs_scene_parameter(e.scene, 0, &p));
  assert_string_equal(p.name, "a");
  assert_string_equal(p.doc, "size");
  assert_true(p.value == 2 && p.minimum == 1 && p.maximum == 8);
  assert_true(zs_scene_parameter(e.scene, 1, &p));
  assert_true(p.value == 4 && p.minimum == -INFINITY && p.maximum == 50);
  assert_string_equal(p.doc, "");
  assert_false(zs_scene_parameter(e.scene, 2, &p));

  expand_again(&e, NULL);
  assert_true(number(e.tree.root, "radius") == 4);
  assert_true(zs_scene_set(e.scene, "a", 3, &e.diag));
  assert_true(value_of(e.scene, 1) == 9); /* follows */
  expand_again(&e, NULL);
  assert_true(number(e.tree.root, "radius") == 9);
  assert_true(zs_scene_set(e.scene, "b", 5, &e.diag));
  assert_true(zs_scene_set(e.scene, "a", 4, &e.diag));
  assert_true(value_of(e.scene, 1) == 5); /* no longer */
  assert_int_equal(e.diag.errors, 0);
  end(&e);
}

static void test_refused_parameters(void **state)
{
  (void)state;
  static const struct {
    const char *name;
    double value;
    const char *message;
  } cases[] = {
    {"wall", 9, "error: wall = 9 is out of range; expected 1 to 8\n"},
    {"wall", 0.5, "error: wall = 0.5 is out of range; expected 1 to 8\n"},
    {"low", -1, "error: low = -1 is too small; expected at least 0\n"},
    {"wal", 2, "error: there is no parameter 'wal'; did you mean 'wall'?\n"},
    {"wall", NAN, "error: wall = nan is not a finite number\n"},
    {"wall", INFINITY, "error: wall = inf is not a finite number\n"},
  };
  expanded e;
  load(&e, "<scene><param name='wall' value='3' min='1' max='8'/>"
           "<param name='low' value='0' min='0'/><sphere radius='{wall}'/></scene>");
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    e.printed.length = 0;
    zs_diag diag = {.report = print_diagnostic, .context = &e.printed};
    assert_false(zs_scene_set(e.scene, cases[i].name, cases[i].value, &diag));
    assert_int_equal(diag.status, ZS_ERROR_ARGUMENT);
    assert_string_equal(e.printed.text, cases[i].message);
    assert_true(value_of(e.scene, 0) == 3);
  }
  end(&e);
}

/* A value that is allowed by itself may be wrong where it is used. */
static void test_errors_of_new_values(void **state)
{
  (void)state;
  expanded e;
  load(&e, "<scene><param name='r' value='3'/><union><sphere radius='{r}'/>"
           "<repeat for='i' from='1' to='1000'><sphere radius='{r - 1}'/></repeat>"
           "</union></scene>");
  assert_true(zs_scene_set(e.scene, "r", 1, &e.diag));
  assert_false(zs_scene_expand(e.scene, NULL, &e.arena, &e.tree, &e.diag));
  assert_int_equal(e.diag.errors, 1); /* of a thousand equal ones */
  assert_non_null(strstr(e.printed.text, "'{r - 1}' = 0 is zero; expected a length > 0\n"));
  assert_true(zs_scene_set(e.scene, "r", 2, &e.diag));
  expand_again(&e, NULL);
  end(&e);
}

static void test_domain_and_units(void **state)
{
  (void)state;
  expanded e;
  expand(&e, "<scene units='mm'><param name='a' value='1'/>"
             "<domain min='-1 -2 -3' max='{a} {2 * a} 3'/><sphere/></scene>");
  assert_string_equal(zs_scene_units(e.scene), "mm");
  assert_true(e.tree.has_domain);
  assert_true(e.tree.domain_lo[1] == -2 && e.tree.domain_hi[0] == 1 && e.tree.domain_hi[1] == 2);
  assert_true(zs_scene_set(e.scene, "a", 5, &e.diag));
  expand_again(&e, NULL);
  assert_true(e.tree.domain_hi[1] == 10);
  end(&e);
  expand(&e, "<scene><sphere/></scene>");
  assert_string_equal(zs_scene_units(e.scene), "");
  assert_false(e.tree.has_domain);
  end(&e);
}

static void test_views(void **state)
{
  (void)state;
  expanded e;
  zs_view view;
  load(&e, "<scene><param name='d' value='2'/><view id='a' eye='{d} 0 0' target='0 0 1' fov='40'/>"
           "<view direction='0 1 0' up='1 0 0'/><sphere/></scene>");
  assert_int_equal(zs_scene_view_count(e.scene), 2);
  assert_true(zs_scene_set(e.scene, "d", 3, &e.diag));
  assert_true(zs_scene_view(e.scene, 0, &view));
  assert_string_equal(view.id, "a");
  assert_true(view.has_eye && view.eye[0] == 3 && view.target[2] == 1 && view.up[2] == 1);
  assert_true(view.field_of_view == 40);
  assert_true(zs_scene_view(e.scene, 1, &view));
  assert_string_equal(view.id, "");
  assert_true(!view.has_eye && view.direction[1] == 1 && view.up[0] == 1);
  assert_false(zs_scene_view(e.scene, 2, &view));
  end(&e);
}

/* ---- Limits ------------------------------------------------------------- */

static void test_node_limit(void **state)
{
  (void)state;
  static const char text[] = "<scene><union><repeat for='i' from='1' to='99'><sphere/></repeat>"
                             "</union></scene>";
  zs_scene_options options;
  zs_scene_options_init(&options);
  options.maximum_nodes = 100;
  zs_scene *scene = zs_scene_parse(text, strlen(text), "x.xml", &options, NULL);
  assert_non_null(scene);
  zs_scene_free(scene);
  options.maximum_nodes = 99;
  zs_diag diag = {0};
  assert_null(zs_scene_parse(text, strlen(text), "x.xml", &options, &diag));
  assert_int_equal(diag.errors, 1);
  options.maximum_file_size = strlen(text) - 1;
  assert_null(zs_scene_parse(text, strlen(text), "x.xml", &options, &diag));
}

/* Nesting through definitions is as bounded as nesting in the file. */
static void test_depth_through_definitions(void **state)
{
  (void)state;
  enum { COUNT = 3000 };
  char *text = malloc(COUNT * 120), *at = text;
  at += sprintf(at, "<scene><define name='d0'><sphere/></define>");
  for (int i = 1; i < COUNT; i++)
    at += sprintf(at, "<define name='d%d'><offset by='0'><instance of='d%d'/></offset></define>", i,
                  i - 1);
  sprintf(at, "<instance of='d%d'/></scene>", COUNT - 1);
  zs_diag diag = {0};
  assert_null(zs_scene_parse(text, strlen(text), "x.xml", NULL, &diag));
  assert_int_equal(diag.errors, 1);
  free(text);
}

static void test_many_errors_are_cut(void **state)
{
  (void)state;
  enum { COUNT = 200 };
  char *text = malloc(COUNT * 40), *at = text;
  static printed p;
  p.length = 0;
  at += sprintf(at, "<scene><union>\n");
  for (int i = 0; i < COUNT; i++)
    at += sprintf(at, "<sphere radius='-%d'/>\n", i + 1);
  sprintf(at, "</union></scene>");
  zs_diag diag = {.report = print_diagnostic, .context = &p};
  assert_null(zs_scene_parse(text, strlen(text), "x.xml", NULL, &diag));
  assert_int_equal(diag.errors, COUNT);
  size_t lines = 0;
  for (size_t i = 0; i < p.length; i++)
    lines += p.text[i] == '\n';
  assert_int_equal(lines, 51);
  assert_non_null(strstr(p.text, "note: 150 more errors are not shown\n"));
  free(text);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_values),
    cmocka_unit_test(test_expressions_stand_for_numbers),
    cmocka_unit_test(test_comma_locale),
    cmocka_unit_test(test_placement_is_the_inverse),
    cmocka_unit_test(test_quarter_turns_are_exact),
    cmocka_unit_test(test_no_placement),
    cmocka_unit_test(test_use_is_shared),
    cmocka_unit_test(test_main_object),
    cmocka_unit_test(test_named_objects),
    cmocka_unit_test(test_unused_nodes_are_warned_of_once),
    cmocka_unit_test(test_instances),
    cmocka_unit_test(test_repeat),
    cmocka_unit_test(test_nested_repeat),
    cmocka_unit_test(test_formula),
    cmocka_unit_test(test_parts),
    cmocka_unit_test(test_places),
    cmocka_unit_test(test_parameters),
    cmocka_unit_test(test_refused_parameters),
    cmocka_unit_test(test_errors_of_new_values),
    cmocka_unit_test(test_domain_and_units),
    cmocka_unit_test(test_views),
    cmocka_unit_test(test_node_limit),
    cmocka_unit_test(test_depth_through_definitions),
    cmocka_unit_test(test_many_errors_are_cut),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
