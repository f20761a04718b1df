/* SVG path data: https://www.w3.org/TR/SVG11/paths.html */
#include "files/outline.h"

#include "base/expression.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const double MOST = 1e15; /* larger numbers are not meant */

typedef struct parser {
  zs_outline *outline;
  const double *map;
  const char *text;
  size_t length, at;
  zs_path_error *error;
  double here[2], start[2]; /* the current point, and that of the ring */
  double control[2];        /* the last one of the curve before, or the current point */
  char before;              /* the command before, as a capital */
  bool open;                /* a ring has been begun */
} parser;

__attribute__((format(printf, 2, 3))) static bool fail(parser *p, const char *format, ...)
{
  va_list arguments;
  va_start(arguments, format);
  p->error->offset = p->at;
  vsnprintf(p->error->message, sizeof p->error->message, format, arguments);
  va_end(arguments);
  return false;
}

static bool is_blank(char c)
{
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f';
}

static void skip(parser *p)
{
  while (p->at < p->length && (is_blank(p->text[p->at]) || p->text[p->at] == ','))
    p->at++;
}

/* Whether a number begins here. */
static bool at_number(parser *p)
{
  skip(p);
  return p->at < p->length && p->text[p->at] && strchr("+-.0123456789", p->text[p->at]);
}

static bool number(parser *p, double *value)
{
  skip(p);
  const size_t n = zs_number_parse(p->text + p->at, p->length - p->at, value);
  if (p->at == p->length)
    return fail(p, "expected a number at the end");
  if (!n || !(fabs(*value) < MOST))
    return fail(p, "expected a number, found '%.12s'", p->text + p->at);
  p->at += n;
  return true;
}

/* One digit, which need not be parted from what follows. */
static bool flag(parser *p, bool *value)
{
  skip(p);
  if (p->at >= p->length || (p->text[p->at] != '0' && p->text[p->at] != '1'))
    return fail(p, "expected 0 or 1 as a flag of an arc");
  *value = p->text[p->at++] == '1';
  return true;
}

/* A point, from the current one when `relative`. */
static bool point(parser *p, bool relative, double out[2])
{
  for (int k = 0; k < 2; k++) {
    if (!number(p, &out[k]))
      return false;
    out[k] += relative ? p->here[k] : 0;
  }
  return true;
}

/* ---- Strokes ------------------------------------------------------------------------ */

static bool add(parser *p, const zs_stroke *stroke)
{
  if (!p->open && stroke->kind != ZS_STROKE_MOVE) { /* behind a Z */
    const zs_stroke move = {.kind = ZS_STROKE_MOVE, .p = {{p->start[0], p->start[1]}}};
    if (!add(p, &move))
      return false;
  }
  p->open = true;
  if (zs_outline_add(p->outline, stroke, p->map))
    return true;
  p->error->memory = true;
  return false;
}

static bool go_to(parser *p, const double to[2])
{
  memcpy(p->here, to, sizeof p->here);
  return true;
}

static bool line_to(parser *p, const double to[2])
{
  const zs_stroke s = {.kind = ZS_STROKE_LINE, .p = {{to[0], to[1]}}};
  return add(p, &s) && go_to(p, to);
}

static bool cubic_to(parser *p, const double a[2], const double b[2], const double to[2])
{
  const zs_stroke s = {.kind = ZS_STROKE_CUBIC, .p = {{a[0], a[1]}, {b[0], b[1]}, {to[0], to[1]}}};
  return add(p, &s) && go_to(p, to);
}

/* A quadratic curve is a cubic one. */
static bool quadratic_to(parser *p, const double c[2], const double to[2])
{
  double a[2], b[2];
  for (int k = 0; k < 2; k++) {
    a[k] = p->here[k] + 2 * (c[k] - p->here[k]) / 3;
    b[k] = to[k] + 2 * (c[k] - to[k]) / 3;
  }
  memcpy(p->control, c, sizeof p->control);
  return cubic_to(p, a, b, to);
}

/* From end points to the centre: SVG 1.1, appendix F.6.5. */
static bool arc_to(parser *p, double rx, double ry, double degrees, bool large, bool sweep,
                   const double to[2])
{
  const double turn = degrees * (3.14159265358979323846 / 180), c = cos(turn), s = sin(turn);
  rx = fabs(rx);
  ry = fabs(ry);
  if (rx == 0 || ry == 0)
    return line_to(p, to);
  if (to[0] == p->here[0] && to[1] == p->here[1])
    return true;
  const double dx = (p->here[0] - to[0]) / 2, dy = (p->here[1] - to[1]) / 2;
  const double x = c * dx + s * dy, y = c * dy - s * dx;
  const double short_by = (x / rx) * (x / rx) + (y / ry) * (y / ry);
  if (short_by > 1) { /* radii too small to reach */
    rx *= sqrt(short_by);
    ry *= sqrt(short_by);
  }
  const double reach = rx * rx * y * y + ry * ry * x * x;
  const double k = (large == sweep ? -1 : 1) * sqrt(fmax(0, rx * rx * ry * ry / reach - 1));
  const double cx = k * rx * y / ry, cy = -k * ry * x / rx;
  const double from = atan2((y - cy) / ry, (x - cx) / rx);
  double until = atan2((-y - cy) / ry, (-x - cx) / rx);
  if (sweep && until < from)
    until += 2 * 3.14159265358979323846;
  if (!sweep && until > from)
    until -= 2 * 3.14159265358979323846;
  const zs_stroke stroke = {
    .kind = ZS_STROKE_ARC,
    .p = {{c * cx - s * cy + (p->here[0] + to[0]) / 2, s * cx + c * cy + (p->here[1] + to[1]) / 2},
          {rx * c, rx * s}, {-ry * s, ry * c}, {from, until}, {to[0], to[1]}}};
  return add(p, &stroke) && go_to(p, to);
}

/* ---- Commands ------------------------------------------------------------------------- */

/* The first control point of a smooth curve: that of the curve before mirrored, if that was
 * one of the two. */
static void mirrored(const parser *p, const char *kinds, double out[2])
{
  const bool smooth = p->before && strchr(kinds, p->before);
  for (int k = 0; k < 2; k++)
    out[k] = smooth ? 2 * p->here[k] - p->control[k] : p->here[k];
}

static bool move(parser *p, bool relative)
{
  double to[2];
  if (!point(p, relative, to))
    return false;
  const zs_stroke s = {.kind = ZS_STROKE_MOVE, .p = {{to[0], to[1]}}};
  memcpy(p->start, to, sizeof to);
  return add(p, &s) && go_to(p, to);
}

static bool curve(parser *p, char kind, bool relative)
{
  double a[2], b[2], to[2];
  if (kind == 'S')
    mirrored(p, "CS", a);
  else if (!point(p, relative, a))
    return false;
  if (!point(p, relative, b) || !point(p, relative, to))
    return false;
  memcpy(p->control, b, sizeof b);
  return cubic_to(p, a, b, to);
}

static bool arc(parser *p, bool relative)
{
  double rx, ry, degrees, to[2];
  bool large, sweep;
  return number(p, &rx) && number(p, &ry) && number(p, &degrees) && flag(p, &large) &&
         flag(p, &sweep) && point(p, relative, to) &&
         arc_to(p, rx, ry, degrees, large, sweep, to);
}

static bool step(parser *p, char kind, bool relative)
{
  double c[2], to[2] = {p->here[0], p->here[1]};
  switch (kind) {
  case 'M': return move(p, relative);
  case 'L': return point(p, relative, to) && line_to(p, to);
  case 'H':
  case 'V':
    if (!number(p, &to[kind == 'V']))
      return false;
    to[kind == 'V'] += relative ? p->here[kind == 'V'] : 0;
    return line_to(p, to);
  case 'C':
  case 'S': return curve(p, kind, relative);
  case 'Q': return point(p, relative, c) && point(p, relative, to) && quadratic_to(p, c, to);
  case 'T':
    mirrored(p, "QT", c);
    return point(p, relative, to) && quadratic_to(p, c, to);
  case 'A': return arc(p, relative);
  default: /* Z */
    memcpy(p->here, p->start, sizeof p->here);
    p->open = false;
    return true;
  }
}

static bool command(parser *p)
{
  const char letter = p->text[p->at];
  const bool relative = letter >= 'a';
  char kind = (char)(relative ? letter - 'a' + 'A' : letter);
  if (!strchr("MLHVCSQTAZ", kind) || !letter)
    return fail(p, "'%.12s' is not a command of path data", p->text + p->at);
  if (!p->before && kind != 'M')
    return fail(p, "path data has to begin with M, found '%c'", letter);
  p->at++;
  do {
    if (!step(p, kind, relative))
      return false;
    p->before = kind;
    kind = kind == 'M' ? 'L' : kind; /* what follows a point to begin at are lines */
  } while (kind != 'Z' && at_number(p));
  return true;
}

bool zs_outline_add_path(zs_outline *outline, const char *data, size_t length,
                         const double map[6], zs_path_error *error)
{
  parser p = {.outline = outline, .map = map, .text = data, .length = length, .error = error};
  *error = (zs_path_error){0};
  for (skip(&p); p.at < length; skip(&p))
    if (!command(&p))
      return false;
  return true;
}
