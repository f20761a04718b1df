#include "files/svg.h"

#include "base/expression.h"
#include "base/xml.h"

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

typedef struct reader {
  zs_outline *outline;
  const char *group;
  zs_diag *diag;
  bool failed, found, left_out;
} reader;

/* What an element takes from those around it. */
typedef struct context {
  double map[6];
  double size[2]; /* of the viewport, for percentages */
  bool even_odd;
  bool wanted;    /* inside the group that is read */
} context;

/* ---- Messages --------------------------------------------------------------------------- */

static bool fail(reader *r, const zs_element *e, const char *attribute, const char *problem)
{
  const zs_xml_attribute *a = attribute ? zs_element_attribute(e, attribute) : NULL;
  const zs_place place = a ? zs_attribute_place(e, a, 0) : zs_element_place(e);
  r->failed = true;
  if (a)
    return zs_report(r->diag, ZS_ERROR, ZS_ERROR_SYNTAX, &place, NULL, "'%.40s' %s", a->value,
                     problem);
  return zs_report(r->diag, ZS_ERROR, ZS_ERROR_SYNTAX, &place, NULL, "%s", problem);
}

static bool fail_memory(reader *r)
{
  if (!r->failed)
    zs_fail_memory(r->diag);
  r->failed = true;
  return false;
}

/* ---- Values -------------------------------------------------------------------------------- */

static const char *value(const zs_element *e, const char *name)
{
  const zs_xml_attribute *a = zs_element_attribute(e, name);
  return a ? a->value : NULL;
}

static const char *skip(const char *text)
{
  return text + strspn(text, " \t\r\n,");
}

/* Numbers separated by blanks and commas; how many, or -1. */
static int numbers(const char *text, double *out, int most)
{
  const char *const end = text + strlen(text);
  int count = 0;
  for (text = skip(text); *text; text = skip(text)) {
    double number;
    const size_t n = zs_number_parse(text, (size_t)(end - text), &number);
    if (!n || count == most || !isfinite(number))
      return -1;
    out[count++] = number;
    text += n;
  }
  return count;
}

/* Pixels of a unit; 0: there is no such. */
static double unit_of(const char *text)
{
  static const struct {
    const char *name;
    double factor;
  } units[] = {{"", 1}, {"px", 1}, {"mm", 96 / 25.4}, {"cm", 960 / 25.4}, {"in", 96},
               {"pt", 96.0 / 72}, {"pc", 16}, {"Q", 24 / 25.4}};
  char name[4] = "";
  size_t n = 0;
  while (*text && !strchr(" \t\r\n", *text) && n < 3)
    name[n++] = *text++;
  for (size_t i = 0; i < sizeof units / sizeof *units; i++)
    if (strcmp(name, units[i].name) == 0)
      return units[i].factor;
  return 0;
}

/* A length in pixels; per cent are of `whole`. */
static bool length(reader *r, const zs_element *e, const char *name, double whole, double otherwise,
                   double *out)
{
  const char *text = value(e, name);
  *out = otherwise;
  if (!text)
    return true;
  text = skip(text);
  const size_t n = zs_number_parse(text, strlen(text), out);
  const double unit = text[n] == '%' ? whole / 100 : unit_of(text + n);
  if (!n || !isfinite(*out) || (unit == 0 && text[n] != '%'))
    return fail(r, e, name, "is not a length in px, mm, cm, in, pt, pc, Q or %");
  *out *= unit;
  return true;
}

/* A property, as an attribute or in a style; its length, 0 when it is not there. */
static size_t property(const zs_element *e, const char *name, const char **text)
{
  const char *style = value(e, "style");
  const size_t n = strlen(name);
  while (style && *style) {
    style += strspn(style, " \t\r\n;");
    const size_t end = strcspn(style, ";");
    if (strncmp(style, name, n) == 0 && style[n + strspn(style + n, " \t\r\n")] == ':') {
      *text = strchr(style, ':') + 1;
      *text += strspn(*text, " \t\r\n");
      return strcspn(*text, "; \t\r\n");
    }
    style += end;
  }
  *text = value(e, name);
  if (!*text)
    return 0;
  *text += strspn(*text, " \t\r\n");
  return strcspn(*text, " \t\r\n");
}

static bool is_property(const zs_element *e, const char *name, const char *expected)
{
  const char *text;
  const size_t n = property(e, name, &text);
  return n == strlen(expected) && memcmp(text, expected, n) == 0;
}

/* ---- Maps -------------------------------------------------------------------------------- */

/* map = map * inner: `inner` is applied first. */
static void compose(double map[6], const double inner[6])
{
  const double m[6] = {map[0] * inner[0] + map[2] * inner[1],
                       map[1] * inner[0] + map[3] * inner[1],
                       map[0] * inner[2] + map[2] * inner[3],
                       map[1] * inner[2] + map[3] * inner[3],
                       map[0] * inner[4] + map[2] * inner[5] + map[4],
                       map[1] * inner[4] + map[3] * inner[5] + map[5]};
  memcpy(map, m, sizeof m);
}

/* One function of a transform list; false when there is no such with that many numbers. */
static bool transform(const char *name, size_t n, const double v[6], int count, double map[6])
{
  const double turn = v[0] * (3.14159265358979323846 / 180);
  const double inner[][6] = {{v[0], v[1], v[2], v[3], v[4], v[5]},
                             {1, 0, 0, 1, v[0], count > 1 ? v[1] : 0},
                             {v[0], 0, 0, count > 1 ? v[1] : v[0], 0, 0},
                             {cos(turn), sin(turn), -sin(turn), cos(turn), 0, 0},
                             {1, 0, tan(turn), 1, 0, 0},
                             {1, tan(turn), 0, 1, 0, 0}};
  static const struct {
    const char *name;
    int least, most;
  } functions[] = {{"matrix", 6, 6}, {"translate", 1, 2}, {"scale", 1, 2},
                   {"rotate", 1, 3}, {"skewX", 1, 1},     {"skewY", 1, 1}};
  for (size_t i = 0; i < sizeof functions / sizeof *functions; i++) {
    if (strlen(functions[i].name) != n || memcmp(name, functions[i].name, n) != 0)
      continue;
    if (count < functions[i].least || count > functions[i].most || (i == 3 && count == 2))
      return false;
    if (count == 3)
      compose(map, (const double[6]){1, 0, 0, 1, v[1], v[2]});
    compose(map, inner[i]);
    if (count == 3)
      compose(map, (const double[6]){1, 0, 0, 1, -v[1], -v[2]});
    return true;
  }
  return false;
}

static bool apply_transform(reader *r, const zs_element *e, double map[6])
{
  const char *text = value(e, "transform");
  for (text = text ? skip(text) : ""; *text; text = skip(text)) {
    const size_t n = strcspn(text, " \t\r\n(");
    const char *open = text + n + strspn(text + n, " \t\r\n");
    const char *close = *open == '(' ? strchr(open, ')') : NULL;
    char list[256];
    double v[6] = {0};
    if (!close || (size_t)(close - open) >= sizeof list)
      return fail(r, e, "transform", "is not a list of transforms");
    memcpy(list, open + 1, (size_t)(close - open) - 1);
    list[close - open - 1] = '\0';
    if (!transform(text, n, v, numbers(list, v, 6), map))
      return fail(r, e, "transform", "is not a list of transforms");
    text = close + 1;
  }
  return true;
}

/* From the viewBox to a viewport of that size at the origin; *box becomes what the size
 * of the viewport is inside. */
static bool apply_view_box(reader *r, const zs_element *e, const double size[2], double map[6],
                           double box[2])
{
  double v[4];
  const char *text = value(e, "viewBox"), *fit = value(e, "preserveAspectRatio");
  memcpy(box, size, 2 * sizeof *box);
  if (!text)
    return true;
  if (numbers(text, v, 4) != 4 || !(v[2] > 0 && v[3] > 0))
    return fail(r, e, "viewBox", "is not x, y, width and height");
  double sx = size[0] / v[2], sy = size[1] / v[3];
  const bool slice = fit && strstr(fit, "slice");
  if (!fit || !strstr(fit, "none"))
    sx = sy = slice ? fmax(sx, sy) : fmin(sx, sy);
  const double x = fit && strstr(fit, "xMin") ? 0 : fit && strstr(fit, "xMax") ? 1 : 0.5;
  const double y = fit && strstr(fit, "YMin") ? 0 : fit && strstr(fit, "YMax") ? 1 : 0.5;
  compose(map, (const double[6]){sx, 0, 0, sy, x * (size[0] - sx * v[2]) - sx * v[0],
                                 y * (size[1] - sy * v[3]) - sy * v[1]});
  box[0] = v[2];
  box[1] = v[3];
  return true;
}

/* ---- Shapes ------------------------------------------------------------------------------ */

static bool stroke(reader *r, const context *c, zs_stroke s)
{
  return zs_outline_add(r->outline, &s, c->map) || fail_memory(r);
}

static bool begin(reader *r, const context *c)
{
  return zs_outline_begin(r->outline, c->even_odd) || fail_memory(r);
}

/* Part of an ellipse about (x, y), in quarters of a turn, to where it ends. */
static bool quarter_arcs(reader *r, const context *c, const double centre[2],
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

static bool read_ellipse(reader *r, const zs_element *e, const context *c)
{
  const bool circle = strcmp(e->name, "circle") == 0;
  const double diagonal = hypot(c->size[0], c->size[1]) / sqrt(2);
  double centre[2], radius[2];
  if (!length(r, e, "cx", c->size[0], 0, &centre[0]) ||
      !length(r, e, "cy", c->size[1], 0, &centre[1]) ||
      !length(r, e, circle ? "r" : "rx", circle ? diagonal : c->size[0], 0, &radius[0]) ||
      !length(r, e, circle ? "r" : "ry", circle ? diagonal : c->size[1], 0, &radius[1]))
    return false;
  if (radius[0] < 0 || radius[1] < 0)
    return fail(r, e, circle ? "r" : radius[0] < 0 ? "rx" : "ry", "is negative");
  if (radius[0] == 0 || radius[1] == 0)
    return true;
  return begin(r, c) &&
         stroke(r, c, (zs_stroke){ZS_STROKE_MOVE, {{centre[0] + radius[0], centre[1]}}}) &&
         quarter_arcs(r, c, centre, radius, 0, 4);
}

/* The radii of a rectangle's corners: one that is not given is as the other. */
static bool corner_radii(reader *r, const zs_element *e, const context *c, const double size[2],
                         double radius[2])
{
  if (!length(r, e, "rx", c->size[0], NAN, &radius[0]) ||
      !length(r, e, "ry", c->size[1], NAN, &radius[1]))
    return false;
  for (int k = 0; k < 2; k++)
    if (isnan(radius[k]))
      radius[k] = isnan(radius[1 - k]) ? 0 : radius[1 - k];
  for (int k = 0; k < 2; k++)
    radius[k] = fmin(fmax(radius[k], 0), size[k] / 2);
  return true;
}

static bool read_rectangle(reader *r, const zs_element *e, const context *c)
{
  double at[2], size[2], radius[2];
  if (!length(r, e, "x", c->size[0], 0, &at[0]) || !length(r, e, "y", c->size[1], 0, &at[1]) ||
      !length(r, e, "width", c->size[0], 0, &size[0]) ||
      !length(r, e, "height", c->size[1], 0, &size[1]))
    return false;
  if (size[0] < 0 || size[1] < 0)
    return fail(r, e, size[0] < 0 ? "width" : "height", "is negative");
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

static bool read_polygon(reader *r, const zs_element *e, const context *c)
{
  const char *text = value(e, "points"), *const end = text ? text + strlen(text) : NULL;
  if (!text)
    return true;
  if (!begin(r, c))
    return false;
  for (bool first = true; *(text = skip(text)); first = false) {
    double p[2];
    for (int k = 0; k < 2; k++) {
      text = skip(text);
      const size_t n = zs_number_parse(text, (size_t)(end - text), &p[k]);
      if (!n || !isfinite(p[k]))
        return fail(r, e, "points", "is not a list of points, x and y of each");
      text += n;
    }
    if (!stroke(r, c, (zs_stroke){first ? ZS_STROKE_MOVE : ZS_STROKE_LINE, {{p[0], p[1]}}}))
      return false;
  }
  return true;
}

static bool read_path(reader *r, const zs_element *e, const context *c)
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
    return fail_memory(r);
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
  bool (*read)(reader *r, const zs_element *e, const context *c);
} shapes[] = {{"path", read_path},       {"rect", read_rectangle}, {"circle", read_ellipse},
              {"ellipse", read_ellipse}, {"polygon", read_polygon}, {"polyline", read_polygon}};

static void read_children(reader *r, const zs_element *parent, const context *c);

/* A document inside the document. */
static bool enter_nested(reader *r, const zs_element *e, context *c)
{
  double at[2], size[2];
  if (!length(r, e, "x", c->size[0], 0, &at[0]) || !length(r, e, "y", c->size[1], 0, &at[1]) ||
      !length(r, e, "width", c->size[0], c->size[0], &size[0]) ||
      !length(r, e, "height", c->size[1], c->size[1], &size[1]))
    return false;
  compose(c->map, (const double[6]){1, 0, 0, 1, at[0], at[1]});
  return apply_view_box(r, e, size, c->map, c->size);
}

static void read_element(reader *r, const zs_element *e, const context *around)
{
  static const char *const groups[] = {"g", "a", "switch", "svg", NULL};
  static const char *const lost[] = {"use", "text", "image", "foreignObject", NULL};
  context c = *around;
  const char *id = value(e, "id");
  if (is_property(e, "display", "none"))
    return;
  if (!c.wanted && id && strcmp(id, r->group) == 0)
    c.wanted = r->found = true;
  if (is_property(e, "fill-rule", "evenodd"))
    c.even_odd = true;
  else if (is_property(e, "fill-rule", "nonzero"))
    c.even_odd = false;
  if (!apply_transform(r, e, c.map))
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

static void read_children(reader *r, const zs_element *parent, const context *c)
{
  for (const zs_element *e = parent->first; e && !r->failed; e = e->next)
    read_element(r, e, c);
}

/* Whether a length is in a unit of the real world. */
static bool is_physical(const zs_element *e, const char *name)
{
  static const char *const units[] = {"mm", "cm", "in", "pt", "pc", "Q"};
  const char *text = value(e, name);
  for (size_t i = 0; text && i < sizeof units / sizeof *units; i++)
    if (strstr(text, units[i]))
      return true;
  return false;
}

static bool is_relative(const zs_element *e, const char *name)
{
  const char *text = value(e, name);
  return !text || strchr(text, '%') || strcmp(text, "auto") == 0;
}

/* The page: its size, and the map from the document to what is wanted. */
static bool enter_page(reader *r, const zs_element *root, bool down, context *c)
{
  double box[4] = {0, 0, 0, 0}, size[2];
  const char *view = value(root, "viewBox");
  if (view && numbers(view, box, 4) != 4)
    return fail(r, root, "viewBox", "is not x, y, width and height");
  for (int k = 0; k < 2; k++) {
    const char *name = k ? "height" : "width";
    if (is_relative(root, name)) /* as large as it likes */
      size[k] = box[2 + k];
    else if (!length(r, root, name, 0, 0, &size[k]))
      return false;
  }
  const bool physical = is_physical(root, "width") || is_physical(root, "height");
  const double unit = physical ? 1 / MILLIMETRE : 1;
  compose(c->map, (const double[6]){unit, 0, 0, down ? unit : -unit, 0, down ? 0 : unit * size[1]});
  return apply_view_box(r, root, size, c->map, c->size);
}

static bool read_document(reader *r, const zs_element *root, bool down)
{
  context c = {.wanted = !r->group};
  memcpy(c.map, IDENTITY, sizeof c.map);
  if (strcmp(root->name, "svg") != 0)
    return fail(r, root, NULL, "the root element is no <svg>");
  if (enter_page(r, root, down, &c))
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
  const bool readable = stream && !ferror(stream);
  if (!readable)
    zs_fail(diag, ZS_ERROR_IO, path, "cannot be read: %s", strerror(errno));
  else if (!text)
    zs_fail_memory(diag);
  if (stream)
    fclose(stream);
  if (readable)
    return text;
  free(text);
  return NULL;
}

bool zs_svg_read(zs_outline *outline, const char *path, const char *group, bool down,
                 zs_diag *diag)
{
  reader r = {.outline = outline, .group = group, .diag = diag};
  zs_arena arena = {0};
  zs_source source = {.name = path};
  *outline = (zs_outline){0};
  char *text = load(path, &source.length, diag);
  source.text = text;
  const zs_element *root =
    text ? zs_xml_parse(&source, &language, DEPTH, &arena, diag) : NULL;
  const bool done = root && read_document(&r, root, down);
  zs_arena_free(&arena);
  free(text);
  if (!done)
    zs_outline_clear(outline);
  return done;
}
