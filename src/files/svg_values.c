#include "files/svg_values.h"

#include "base/expression.h"

#include <math.h>
#include <string.h>

/* ---- Messages --------------------------------------------------------------------------- */

bool zs_svg_fail(zs_svg_reader *r, const zs_element *e, const char *attribute, const char *problem)
{
  const zs_xml_attribute *a = attribute ? zs_element_attribute(e, attribute) : NULL;
  const zs_place place = a ? zs_attribute_place(e, a, 0) : zs_element_place(e);
  r->failed = true;
  if (a)
    return zs_report(r->diag, ZS_ERROR, ZS_ERROR_SYNTAX, &place, NULL, "'%.40s' %s", a->value,
                     problem);
  return zs_report(r->diag, ZS_ERROR, ZS_ERROR_SYNTAX, &place, NULL, "%s", problem);
}

bool zs_svg_fail_memory(zs_svg_reader *r)
{
  if (!r->failed)
    zs_fail_memory(r->diag);
  r->failed = true;
  return false;
}

/* ---- Values -------------------------------------------------------------------------------- */

const char *zs_svg_value(const zs_element *e, const char *name)
{
  const zs_xml_attribute *a = zs_element_attribute(e, name);
  return a ? a->value : NULL;
}

const char *zs_svg_skip(const char *text)
{
  return text + strspn(text, " \t\r\n,");
}

/* Numbers separated by blanks and commas; how many, or -1. */
int zs_svg_numbers(const char *text, double *out, int most)
{
  const char *const end = text + strlen(text);
  int count = 0;
  for (text = zs_svg_skip(text); *text; text = zs_svg_skip(text)) {
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
bool zs_svg_length(zs_svg_reader *r, const zs_element *e, const char *name, double whole,
                   double otherwise, double *out)
{
  const char *text = zs_svg_value(e, name);
  *out = otherwise;
  if (!text)
    return true;
  text = zs_svg_skip(text);
  const size_t n = zs_number_parse(text, strlen(text), out);
  const double unit = text[n] == '%' ? whole / 100 : unit_of(text + n);
  if (!n || !isfinite(*out) || (unit == 0 && text[n] != '%'))
    return zs_svg_fail(r, e, name, "is not a length in px, mm, cm, in, pt, pc, Q or %");
  *out *= unit;
  return true;
}

/* A property, as an attribute or in a style; its length, 0 when it is not there. */
static size_t property(const zs_element *e, const char *name, const char **text)
{
  const char *style = zs_svg_value(e, "style");
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
  *text = zs_svg_value(e, name);
  if (!*text)
    return 0;
  *text += strspn(*text, " \t\r\n");
  return strcspn(*text, " \t\r\n");
}

bool zs_svg_is_property(const zs_element *e, const char *name, const char *expected)
{
  const char *text;
  const size_t n = property(e, name, &text);
  return n == strlen(expected) && memcmp(text, expected, n) == 0;
}

/* ---- Maps -------------------------------------------------------------------------------- */

/* map = map * inner: `inner` is applied first. */
void zs_svg_compose(double map[6], const double inner[6])
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
      zs_svg_compose(map, (const double[6]){1, 0, 0, 1, v[1], v[2]});
    zs_svg_compose(map, inner[i]);
    if (count == 3)
      zs_svg_compose(map, (const double[6]){1, 0, 0, 1, -v[1], -v[2]});
    return true;
  }
  return false;
}

bool zs_svg_apply_transform(zs_svg_reader *r, const zs_element *e, double map[6])
{
  const char *text = zs_svg_value(e, "transform");
  for (text = text ? zs_svg_skip(text) : ""; *text; text = zs_svg_skip(text)) {
    const size_t n = strcspn(text, " \t\r\n(");
    const char *open = text + n + strspn(text + n, " \t\r\n");
    const char *close = *open == '(' ? strchr(open, ')') : NULL;
    char list[256];
    double v[6] = {0};
    if (!close || (size_t)(close - open) >= sizeof list)
      return zs_svg_fail(r, e, "transform", "is not a list of transforms");
    memcpy(list, open + 1, (size_t)(close - open) - 1);
    list[close - open - 1] = '\0';
    if (!transform(text, n, v, zs_svg_numbers(list, v, 6), map))
      return zs_svg_fail(r, e, "transform", "is not a list of transforms");
    text = close + 1;
  }
  return true;
}

/* From the viewBox to a viewport of that size at the origin; *box becomes what the size
 * of the viewport is inside. */
bool zs_svg_apply_view_box(zs_svg_reader *r, const zs_element *e, const double size[2],
                           double map[6], double box[2])
{
  double v[4];
  const char *text = zs_svg_value(e, "viewBox"), *fit = zs_svg_value(e, "preserveAspectRatio");
  memcpy(box, size, 2 * sizeof *box);
  if (!text)
    return true;
  if (zs_svg_numbers(text, v, 4) != 4 || !(v[2] > 0 && v[3] > 0))
    return zs_svg_fail(r, e, "viewBox", "is not x, y, width and height");
  double sx = size[0] / v[2], sy = size[1] / v[3];
  const bool slice = fit && strstr(fit, "slice");
  if (!fit || !strstr(fit, "none"))
    sx = sy = slice ? fmax(sx, sy) : fmin(sx, sy);
  const double x = fit && strstr(fit, "xMin") ? 0 : fit && strstr(fit, "xMax") ? 1 : 0.5;
  const double y = fit && strstr(fit, "YMin") ? 0 : fit && strstr(fit, "YMax") ? 1 : 0.5;
  zs_svg_compose(map, (const double[6]){sx, 0, 0, sy, x * (size[0] - sx * v[2]) - sx * v[0],
                                 y * (size[1] - sy * v[3]) - sy * v[1]});
  box[0] = v[2];
  box[1] = v[3];
  return true;
}
