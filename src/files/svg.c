#include "files/svg.h"

#include "base/expression.h"
#include "base/names.h"
#include "files/svg_values.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DEPTH = 256, LARGEST = 1 << 30 };

static const zs_xml_language language = {
  .name_space = "http://www.w3.org/2000/svg", .root = "svg", .document_type = true};

static const double IDENTITY[6] = {1, 0, 0, 1, 0, 0};
static const double MILLIMETRE = 96 / 25.4; /* in pixels */

/* ---- Shapes ------------------------------------------------------------------------------ */

static bool stroke(zs_svg_reader *r, const zs_svg_context *c, zs_stroke s)
{
  return zs_outline_add(r->outline, &s, c->map) || zs_svg_fail_memory(r);
}

static bool begin(zs_svg_reader *r, const zs_svg_context *c)
{
  return zs_outline_begin(r->outline, c->even_odd) || zs_svg_fail_memory(r);
}

/* Part of an ellipse about (x, y), in quarters of a turn, to where it ends. */
static bool quarter_arcs(zs_svg_reader *r, const zs_svg_context *c, const double centre[2],
                         const double radius[2], int from, int count)
{
  const double turn = 3.14159265358979323846 / 2;
  const int end = from + count;
  const double to[2] = {centre[0] + (end % 2 ? 0 : end % 4 ? -1 : 1) * radius[0],
                        centre[1] + (end % 2 ? (end % 4 == 1 ? 1 : -1) : 0) * radius[1]};
  return stroke(r, c, (zs_stroke){ZS_STROKE_ARC, {{centre[0], centre[1]}, {radius[0], 0},
                                                  {0, radius[1]}, {from * turn, end * turn},
                                                  {to[0], to[1]}}});
}

static bool read_ellipse(zs_svg_reader *r, const zs_element *e, const zs_svg_context *c)
{
  const bool circle = strcmp(e->name, "circle") == 0;
  const double diagonal = hypot(c->size[0], c->size[1]) / sqrt(2);
  double centre[2], radius[2];
  if (!zs_svg_length(r, e, "cx", c->size[0], 0, &centre[0]) ||
      !zs_svg_length(r, e, "cy", c->size[1], 0, &centre[1]) ||
      !zs_svg_length(r, e, circle ? "r" : "rx", circle ? diagonal : c->size[0], 0, &radius[0]) ||
      !zs_svg_length(r, e, circle ? "r" : "ry", circle ? diagonal : c->size[1], 0, &radius[1]))
    return false;
  if (radius[0] < 0 || radius[1] < 0)
    return zs_svg_fail(r, e, circle ? "r" : radius[0] < 0 ? "rx" : "ry", "is negative");
  if (radius[0] == 0 || radius[1] == 0)
    return true;
  return begin(r, c) &&
         stroke(r, c, (zs_stroke){ZS_STROKE_MOVE, {{centre[0] + radius[0], centre[1]}}}) &&
         quarter_arcs(r, c, centre, radius, 0, 4);
}

/* The radii of a rectangle's corners: one that is not given is as the other. */
static bool corner_radii(zs_svg_reader *r, const zs_element *e, const zs_svg_context *c,
                         const double size[2], double radius[2])
{
  if (!zs_svg_length(r, e, "rx", c->size[0], NAN, &radius[0]) ||
      !zs_svg_length(r, e, "ry", c->size[1], NAN, &radius[1]))
    return false;
  for (int k = 0; k < 2; k++)
    if (isnan(radius[k]))
      radius[k] = isnan(radius[1 - k]) ? 0 : radius[1 - k];
  for (int k = 0; k < 2; k++)
    radius[k] = fmin(fmax(radius[k], 0), size[k] / 2);
  return true;
}

static bool read_rectangle(zs_svg_reader *r, const zs_element *e, const zs_svg_context *c)
{
  double at[2], size[2], radius[2];
  if (!zs_svg_length(r, e, "x", c->size[0], 0, &at[0]) ||
      !zs_svg_length(r, e, "y", c->size[1], 0, &at[1]) ||
      !zs_svg_length(r, e, "width", c->size[0], 0, &size[0]) ||
      !zs_svg_length(r, e, "height", c->size[1], 0, &size[1]))
    return false;
  if (size[0] < 0 || size[1] < 0)
    return zs_svg_fail(r, e, size[0] < 0 ? "width" : "height", "is negative");
  if (size[0] == 0 || size[1] == 0)
    return true;
  if (!corner_radii(r, e, c, size, radius) || !begin(r, c))
    return false;
  const bool round = radius[0] > 0 && radius[1] > 0;
  for (int i = 0; i < 4; i++) { /* corners, from the lower right one in numbers */
    const double sx = i == 0 || i == 3 ? 1 : 0, sy = i < 2 ? 1 : 0;
    const double corner[2] = {at[0] + sx * size[0], at[1] + sy * size[1]};
    const double centre[2] = {corner[0] - (2 * sx - 1) * radius[0],
                              corner[1] - (2 * sy - 1) * radius[1]};
    const double first[2] = {i % 2 ? centre[0] : corner[0], i % 2 ? corner[1] : centre[1]};
    const double *to = round ? first : corner;
    if (!stroke(r, c, (zs_stroke){i ? ZS_STROKE_LINE : ZS_STROKE_MOVE, {{to[0], to[1]}}}) ||
        (round && !quarter_arcs(r, c, centre, radius, i, 1)))
      return false;
  }
  return true;
}

static bool read_polygon(zs_svg_reader *r, const zs_element *e, const zs_svg_context *c)
{
  const char *text = zs_svg_value(e, "points"), *const end = text ? text + strlen(text) : NULL;
  if (!text)
    return true;
  if (!begin(r, c))
    return false;
  for (bool first = true; *(text = zs_svg_skip(text)); first = false) {
    double p[2];
    for (int k = 0; k < 2; k++) {
      text = zs_svg_skip(text);
      const size_t n = zs_number_parse(text, (size_t)(end - text), &p[k]);
      if (!n || !isfinite(p[k]))
        return zs_svg_fail(r, e, "points", "is not a list of points, x and y of each");
      text += n;
    }
    if (!stroke(r, c, (zs_stroke){first ? ZS_STROKE_MOVE : ZS_STROKE_LINE, {{p[0], p[1]}}}))
      return false;
  }
  return true;
}

static bool read_path(zs_svg_reader *r, const zs_element *e, const zs_svg_context *c)
{
  const zs_xml_attribute *d = zs_element_attribute(e, "d");
  zs_path_error error;
  if (!d || strcmp(d->value, "none") == 0)
    return true;
  if (!begin(r, c))
    return false;
  if (zs_outline_add_path(r->outline, d->value, d->length, c->map, &error))
    return true;
  if (error.memory)
    return zs_svg_fail_memory(r);
  const zs_place place = zs_attribute_place(e, d, error.offset);
  r->failed = true;
  return zs_report(r->diag, ZS_ERROR, ZS_ERROR_SYNTAX, &place, NULL, "%s", error.message);
}

/* ---- Elements ---------------------------------------------------------------------------- */

static bool is_one_of(const char *name, const char *const *list)
{
  for (; *list; list++)
    if (strcmp(name, *list) == 0)
      return true;
  return false;
}

static const struct {
  const char *name;
  bool (*read)(zs_svg_reader *r, const zs_element *e, const zs_svg_context *c);
} shapes[] = {{"path", read_path},       {"rect", read_rectangle}, {"circle", read_ellipse},
              {"ellipse", read_ellipse}, {"polygon", read_polygon}, {"polyline", read_polygon}};

static void read_children(zs_svg_reader *r, const zs_element *parent, const zs_svg_context *c);

/* A document inside the document. */
static bool enter_nested(zs_svg_reader *r, const zs_element *e, zs_svg_context *c)
{
  double at[2], size[2];
  if (!zs_svg_length(r, e, "x", c->size[0], 0, &at[0]) ||
      !zs_svg_length(r, e, "y", c->size[1], 0, &at[1]) ||
      !zs_svg_length(r, e, "width", c->size[0], c->size[0], &size[0]) ||
      !zs_svg_length(r, e, "height", c->size[1], c->size[1], &size[1]))
    return false;
  zs_svg_compose(c->map, (const double[6]){1, 0, 0, 1, at[0], at[1]});
  return zs_svg_apply_view_box(r, e, size, c->map, c->size);
}

/* What an element changes of its surroundings. */
static bool enter(zs_svg_reader *r, const zs_element *e, zs_svg_context *c)
{
  if (zs_svg_is_property(e, "fill-rule", "evenodd"))
    c->even_odd = true;
  else if (zs_svg_is_property(e, "fill-rule", "nonzero"))
    c->even_odd = false;
  return zs_svg_apply_transform(r, e, c->map);
}

static void read_element(zs_svg_reader *r, const zs_element *e, const zs_svg_context *around)
{
  static const char *const groups[] = {"g", "a", "switch", "svg", NULL};
  static const char *const lost[] = {"use", "text", "image", "foreignObject", NULL};
  zs_svg_context c = *around;
  const char *id = zs_svg_value(e, "id");
  if (zs_svg_is_property(e, "display", "none"))
    return;
  if (!c.wanted && id && strcmp(id, r->group) == 0)
    c.wanted = r->found = true;
  if (!enter(r, e, &c))
    return;
  if (is_one_of(e->name, groups)) {
    if (strcmp(e->name, "svg") != 0 || enter_nested(r, e, &c))
      read_children(r, e, &c);
    return;
  }
  for (size_t i = 0; c.wanted && i < sizeof shapes / sizeof *shapes; i++)
    if (strcmp(e->name, shapes[i].name) == 0)
      shapes[i].read(r, e, &c);
  if (c.wanted && is_one_of(e->name, lost) && !r->left_out) {
    const zs_place place = zs_element_place(e);
    r->left_out = true;
    zs_report(r->diag, ZS_WARNING, ZS_ERROR_SCHEMA, &place, NULL,
              "<%s> is left out; expected paths and basic shapes", e->name);
  }
}

static void read_children(zs_svg_reader *r, const zs_element *parent, const zs_svg_context *c)
{
  for (const zs_element *e = parent->first; e && !r->failed; e = e->next)
    read_element(r, e, c);
}

/* Whether a length is in a unit of the real world. */
static bool is_physical(const zs_element *e, const char *name)
{
  static const char *const units[] = {"mm", "cm", "in", "pt", "pc", "Q"};
  const char *text = zs_svg_value(e, name);
  for (size_t i = 0; text && i < sizeof units / sizeof *units; i++)
    if (strstr(text, units[i]))
      return true;
  return false;
}

static bool is_relative(const zs_element *e, const char *name)
{
  const char *text = zs_svg_value(e, name);
  return !text || strchr(text, '%') || strcmp(text, "auto") == 0;
}

/* The page: its size, and the map from the document to what is wanted. */
static bool enter_page(zs_svg_reader *r, const zs_element *root, bool down, zs_svg_context *c)
{
  double box[4] = {0, 0, 0, 0}, size[2];
  const char *view = zs_svg_value(root, "viewBox");
  if (view && zs_svg_numbers(view, box, 4) != 4)
    return zs_svg_fail(r, root, "viewBox", "is not x, y, width and height");
  for (int k = 0; k < 2; k++) {
    const char *name = k ? "height" : "width";
    if (is_relative(root, name)) /* as large as it likes */
      size[k] = box[2 + k];
    else if (!zs_svg_length(r, root, name, 0, 0, &size[k]))
      return false;
  }
  const bool physical = is_physical(root, "width") || is_physical(root, "height");
  const double unit = physical ? 1 / MILLIMETRE : 1;
  zs_svg_compose(c->map, (const double[6]){unit, 0, 0, down ? unit : -unit, 0,
                                           down ? 0 : unit * size[1]});
  return zs_svg_apply_view_box(r, root, size, c->map, c->size);
}

static bool mentions(const zs_element *e, const char *word)
{
  const size_t length = strlen(word);
  for (size_t i = 0; e->text && i + length <= e->text_length; i++)
    if (memcmp(e->text + i, word, length) == 0)
      return true;
  return false;
}

/* Warn of a style sheet that says what would matter here. */
static void warn_of_sheets(zs_svg_reader *r, const zs_element *parent)
{
  for (const zs_element *e = parent->first; e; e = e->next) {
    if (is_one_of(e->name, (const char *const[]){"defs", "g", NULL}))
      warn_of_sheets(r, e);
    if (strcmp(e->name, "style") != 0 || r->sheet ||
        !(mentions(e, "display") || mentions(e, "fill-rule")))
      continue;
    const zs_place place = zs_element_place(e);
    r->sheet = true;
    zs_report(r->diag, ZS_WARNING, ZS_ERROR_SCHEMA, &place,
              "give 'display' and 'fill-rule' as attributes, or in style=\"...\"",
              "the style sheet is left out");
  }
}

static bool begin_document(zs_svg_reader *r, const zs_element *root, bool down, zs_svg_context *c)
{
  warn_of_sheets(r, root);
  *c = (zs_svg_context){.wanted = !r->group};
  memcpy(c->map, IDENTITY, sizeof c->map);
  if (strcmp(root->name, "svg") != 0)
    return zs_svg_fail(r, root, NULL, "the root element is no <svg>");
  return enter_page(r, root, down, c);
}

static bool read_document(zs_svg_reader *r, const zs_element *root, bool down)
{
  zs_svg_context c;
  if (begin_document(r, root, down, &c))
    read_children(r, root, &c);
  if (r->failed)
    return false;
  const zs_place place = zs_element_place(root);
  if (r->group && !r->found)
    return zs_report(r->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
                     "there is no element with the id '%.60s'", r->group);
  return r->outline->stroke_count > 0 ||
         zs_report(r->diag, ZS_ERROR, ZS_ERROR_GEOMETRY, &place, NULL,
                   "there are no shapes; expected paths and basic shapes");
}

/* ---- Groups ------------------------------------------------------------------------------ */

static bool is_group(const zs_element *e)
{
  return strcmp(e->name, "g") == 0 && !zs_svg_is_property(e, "display", "none");
}

static size_t count_groups(const zs_element *parent)
{
  size_t count = 0;
  for (const zs_element *e = parent->first; e; e = e->next)
    count += is_group(e);
  return count;
}

/* The element whose children are the groups: the root, or a group about all others. */
static const zs_element *find_parent(zs_svg_reader *r, const zs_element *root, zs_svg_context *c)
{
  for (const zs_element *parent = root;;) {
    const zs_element *inner = NULL;
    for (const zs_element *e = parent->first; e; e = e->next)
      inner = is_group(e) ? e : inner;
    if (count_groups(parent) != 1 || count_groups(inner) < 2)
      return parent;
    if (!enter(r, inner, c))
      return NULL;
    parent = inner;
  }
}

/* A shape that is in no group. */
static void warn_apart(zs_svg_reader *r, const zs_element *e)
{
  const zs_place place = zs_element_place(e);
  for (size_t i = 0; !r->left_out && i < sizeof shapes / sizeof *shapes; i++)
    if (strcmp(e->name, shapes[i].name) == 0) {
      r->left_out = true;
      zs_report(r->diag, ZS_WARNING, ZS_ERROR_SCHEMA, &place, NULL,
                "<%s> is left out; expected shapes in groups, one group a slice", e->name);
    }
}

static int compare_groups(const void *left, const void *right)
{
  const zs_svg_group *a = left, *b = right;
  const int order = zs_compare_naturally(a->name, b->name);
  return order ? order : (a->place > b->place) - (a->place < b->place);
}

static bool read_groups(zs_svg_reader *r, const zs_element *root, bool down, zs_svg_groups *all)
{
  zs_svg_context c;
  const zs_element *parent =
    begin_document(r, root, down, &c) ? find_parent(r, root, &c) : NULL;
  if (!parent)
    return false;
  const zs_place place = zs_element_place(parent);
  const size_t count = count_groups(parent);
  if (count == 0)
    return zs_report(r->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
                     "there are no groups; expected a <g> for every slice");
  all->groups = calloc(count, sizeof *all->groups);
  if (!all->groups)
    return zs_svg_fail_memory(r);
  for (const zs_element *e = parent->first; e && !r->failed; e = e->next) {
    if (!is_group(e)) {
      warn_apart(r, e);
      continue;
    }
    const char *id = zs_svg_value(e, "id");
    zs_svg_group *group = &all->groups[all->count];
    group->place = all->count++;
    group->name = malloc(id ? strlen(id) + 1 : 1);
    if (!group->name)
      return zs_svg_fail_memory(r);
    strcpy(group->name, id ? id : "");
    r->outline = &group->outline;
    read_element(r, e, &c);
  }
  qsort(all->groups, all->count, sizeof *all->groups, compare_groups);
  return !r->failed;
}

void zs_svg_groups_clear(zs_svg_groups *groups)
{
  for (size_t i = 0; i < groups->count; i++) {
    free(groups->groups[i].name);
    zs_outline_clear(&groups->groups[i].outline);
  }
  free(groups->groups);
  *groups = (zs_svg_groups){0};
}

/* ---- Files ------------------------------------------------------------------------------- */

/* The text of a file, for free(); NULL after reporting. */
static char *load(const char *path, size_t *length, zs_diag *diag)
{
  FILE *stream = fopen(path, "rb");
  size_t capacity = 1 << 16;
  char *text = stream ? malloc(capacity) : NULL;
  *length = 0;
  while (text && *length < LARGEST) {
    *length += fread(text + *length, 1, capacity - *length, stream);
    if (*length < capacity)
      break;
    char *larger = realloc(text, capacity *= 2);
    if (!larger)
      free(text);
    text = larger;
  }
  const bool readable = stream && !ferror(stream), fits = *length < LARGEST;
  if (!readable)
    zs_fail(diag, ZS_ERROR_IO, path, "cannot be read: %s", strerror(errno));
  else if (!text)
    zs_fail_memory(diag);
  else if (!fits)
    zs_fail(diag, ZS_ERROR_IO, path, "the file has %d bytes or more", LARGEST);
  if (stream)
    fclose(stream);
  if (readable && fits)
    return text;
  free(text);
  return NULL;
}

/* Read a file into the reader's outline, or into groups unless they are NULL. */
static bool read_file(zs_svg_reader *r, const char *path, bool down, zs_svg_groups *groups)
{
  zs_arena arena = {0};
  zs_source source = {.name = path};
  char *text = load(path, &source.length, r->diag);
  source.text = text;
  const zs_element *root =
    text ? zs_xml_parse(&source, &language, DEPTH, &arena, r->diag) : NULL;
  const bool done =
    root && (groups ? read_groups(r, root, down, groups) : read_document(r, root, down));
  zs_arena_free(&arena);
  free(text);
  return done;
}

bool zs_svg_read(zs_outline *outline, const char *path, const char *group, bool down,
                 zs_diag *diag)
{
  zs_svg_reader r = {.outline = outline, .group = group, .diag = diag};
  *outline = (zs_outline){0};
  const bool done = read_file(&r, path, down, NULL);
  if (!done)
    zs_outline_clear(outline);
  return done;
}

bool zs_svg_read_groups(zs_svg_groups *groups, const char *path, bool down, zs_diag *diag)
{
  zs_svg_reader r = {.diag = diag};
  *groups = (zs_svg_groups){0};
  const bool done = read_file(&r, path, down, groups);
  if (!done)
    zs_svg_groups_clear(groups);
  return done;
}
