#include "cli/commands.h"
#include "cli/session.h"

#include <math.h>
#include <string.h>

/* ---- Text -------------------------------------------------------------- */

/* "28.7 kB" */
static const char *bytes_text(uint64_t bytes, char text[24])
{
  if (bytes < 1000000)
    snprintf(text, 24, "%.1f kB", 1e-3 * (double)bytes);
  else
    snprintf(text, 24, "%.1f MB", 1e-6 * (double)bytes);
  return text;
}

static void print_parameters(const zs_scene *scene)
{
  size_t count = zs_scene_parameter_count(scene);
  for (size_t i = 0; i < count; i++) {
    zs_parameter p;
    if (!zs_scene_parameter(scene, i, &p))
      continue;
    printf("%s  %s = %.9g", i == 0 ? "parameters\n" : "", p.name, p.value);
    if (p.minimum > -INFINITY || p.maximum < INFINITY)
      printf("  (%.9g .. %.9g)", p.minimum, p.maximum);
    printf("%s%s\n", *p.doc ? "  " : "", p.doc);
  }
}

static void print_names(const zs_scene *scene)
{
  size_t objects = zs_scene_object_count(scene), views = zs_scene_view_count(scene);
  for (size_t i = 0; i < objects; i++)
    printf("%s%s%s", i == 0 ? "objects     " : " ", zs_scene_object(scene, i),
           i + 1 == objects ? "\n" : "");
  for (size_t i = 0; i < views; i++) {
    zs_view view;
    if (zs_scene_view(scene, i, &view))
      printf("%s%s%s", i == 0 ? "views       " : " ", *view.id ? view.id : "(unnamed)",
             i + 1 == views ? "\n" : "");
  }
}

static void print_box(bool known, const double lo[3], const double hi[3])
{
  if (known)
    printf("bounds      %.9g %.9g %.9g  to  %.9g %.9g %.9g\n", lo[0], lo[1], lo[2], hi[0], hi[1],
           hi[2]);
  else
    printf("bounds      none: the solid is unbounded or empty, and the scene has no domain\n");
}

static void print_fits(const zs_field *field, size_t count)
{
  char bytes[24];
  for (size_t i = 0; i < count; i++) {
    zs_fit_info fit;
    if (zs_field_fit(field, i, &fit))
      printf("fit         <%s> of line %u: kernel %s, dimension %u, %zu constraints, %s, %.3f s, "
             "residual %.3g, %s\n",
             fit.element, fit.line, fit.kernel, fit.dimension, fit.constraints, fit.method,
             fit.seconds, fit.residual, bytes_text(fit.bytes, bytes));
  }
}

/* How far the pair that goes farthest goes along the levels. */
static double longest_way(const zs_correspondence *c)
{
  double longest = 0;
  for (size_t i = 0; i < c->count; i++) {
    const double *from = c->ways + 3 * c->places * i, *to = from + 3 * (c->places - 1);
    double along = 0, square = 0;
    for (int k = 0; k < 3; k++) {
      along += (to[k] - from[k]) * c->normal[k];
      square += (to[k] - from[k]) * (to[k] - from[k]);
    }
    longest = fmax(longest, sqrt(fmax(square - along * along, 0)));
  }
  return longest;
}

static void print_correspondences(const zs_field *field)
{
  zs_correspondence c;
  for (size_t i = 0; zs_field_correspondence(field, i, &c); i++) {
    printf("pairs       <%s> of line %u, from level %.9g to %.9g: %zu %s", c.element, c.line,
           c.level[0], c.level[1], c.count, c.found ? "found" : "given");
    if (c.ways)
      printf(", of which the longest goes %.4g", longest_way(&c));
    printf("\n");
  }
}

static void print_info(const cli_session *session, bool bounded)
{
  char bytes[24];
  zs_field_info info;
  zs_field_describe(session->field, &info);
  printf("scene       %s\n", session->options->scene);
  if (*zs_scene_units(session->scene))
    printf("units       %s\n", zs_scene_units(session->scene));
  print_parameters(session->scene);
  print_names(session->scene);
  print_box(bounded, session->lo, session->hi);
  printf("nodes       %zu\n", info.nodes);
  printf("operations  %zu, of which %zu can be pruned; %zu registers, %s\n",
         info.instructions, info.choices, info.registers, bytes_text(info.bytes, bytes));
  print_fits(session->field, info.fits);
  print_correspondences(session->field);
}

/* ---- JSON -------------------------------------------------------------- */

static void json_parameters(cli_json *json, const zs_scene *scene)
{
  cli_json_begin(json, "parameters", '[');
  size_t count = zs_scene_parameter_count(scene);
  for (size_t i = 0; i < count; i++) {
    zs_parameter p;
    if (!zs_scene_parameter(scene, i, &p))
      continue;
    cli_json_begin(json, NULL, '{');
    cli_json_string(json, "name", p.name);
    cli_json_number(json, "value", p.value);
    cli_json_number(json, "minimum", p.minimum);
    cli_json_number(json, "maximum", p.maximum);
    cli_json_string(json, "doc", p.doc);
    cli_json_end(json, '}');
  }
  cli_json_end(json, ']');
}

static void json_names(cli_json *json, const zs_scene *scene)
{
  size_t objects = zs_scene_object_count(scene), views = zs_scene_view_count(scene);
  cli_json_begin(json, "objects", '[');
  for (size_t i = 0; i < objects; i++)
    cli_json_string(json, NULL, zs_scene_object(scene, i));
  cli_json_end(json, ']');
  cli_json_begin(json, "views", '[');
  for (size_t i = 0; i < views; i++) {
    zs_view view;
    if (zs_scene_view(scene, i, &view))
      cli_json_string(json, NULL, view.id);
  }
  cli_json_end(json, ']');
}

static void json_box(cli_json *json, bool known, const double lo[3], const double hi[3])
{
  if (!known) {
    cli_json_null(json, "bounds");
    return;
  }
  cli_json_begin(json, "bounds", '[');
  for (int k = 0; k < 6; k++)
    cli_json_number(json, NULL, k < 3 ? lo[k] : hi[k - 3]);
  cli_json_end(json, ']');
}

static void json_fits(cli_json *json, const zs_field *field, size_t count)
{
  cli_json_begin(json, "fits", '[');
  for (size_t i = 0; i < count; i++) {
    zs_fit_info fit;
    if (!zs_field_fit(field, i, &fit))
      continue;
    cli_json_begin(json, NULL, '{');
    cli_json_string(json, "element", fit.element);
    cli_json_integer(json, "line", fit.line);
    cli_json_string(json, "kernel", fit.kernel);
    cli_json_integer(json, "dimension", fit.dimension);
    cli_json_integer(json, "constraints", (int64_t)fit.constraints);
    cli_json_string(json, "method", fit.method);
    cli_json_number(json, "seconds", fit.seconds);
    cli_json_number(json, "residual", fit.residual);
    cli_json_integer(json, "bytes", (int64_t)fit.bytes);
    cli_json_end(json, '}');
  }
  cli_json_end(json, ']');
}

/* With the ends of every pair, in the scene's coordinates. */
static void json_correspondences(cli_json *json, const zs_field *field)
{
  zs_correspondence c;
  cli_json_begin(json, "correspondences", '[');
  for (size_t i = 0; zs_field_correspondence(field, i, &c); i++) {
    cli_json_begin(json, NULL, '{');
    cli_json_string(json, "element", c.element);
    cli_json_integer(json, "line", c.line);
    cli_json_string(json, "pairs", c.found ? "found" : "given");
    cli_json_number(json, "from", c.level[0]);
    cli_json_number(json, "to", c.level[1]);
    cli_json_integer(json, "count", (int64_t)c.count);
    if (c.ways)
      cli_json_number(json, "longest", longest_way(&c));
    cli_json_begin(json, "ways", '[');
    for (size_t w = 0; c.ways && w < c.count; w++) {
      const double *from = c.ways + 3 * c.places * w, *to = from + 3 * (c.places - 1);
      cli_json_begin(json, NULL, '[');
      for (int k = 0; k < 6; k++)
        cli_json_number(json, NULL, k < 3 ? from[k] : to[k - 3]);
      cli_json_end(json, ']');
    }
    cli_json_end(json, ']');
    cli_json_end(json, '}');
  }
  cli_json_end(json, ']');
}

static void json_info(const cli_session *session, bool bounded)
{
  zs_field_info info;
  zs_field_describe(session->field, &info);
  cli_json json = {.stream = stdout};
  cli_json_begin(&json, NULL, '{');
  cli_json_string(&json, "scene", session->options->scene);
  cli_json_string(&json, "units", zs_scene_units(session->scene));
  json_parameters(&json, session->scene);
  json_names(&json, session->scene);
  json_box(&json, bounded, session->lo, session->hi);
  cli_json_integer(&json, "nodes", (int64_t)info.nodes);
  cli_json_integer(&json, "operations", (int64_t)info.instructions);
  cli_json_integer(&json, "registers", (int64_t)info.registers);
  cli_json_integer(&json, "choices", (int64_t)info.choices);
  cli_json_integer(&json, "bytes", (int64_t)info.bytes);
  json_fits(&json, session->field, info.fits);
  json_correspondences(&json, session->field);
  cli_json_end(&json, '}');
  fputc('\n', stdout);
}

int cli_info(const cli_options *options)
{
  cli_session session;
  bool done = cli_session_open(&session, options) && cli_session_compile(&session, options->object);
  if (done) {
    cli_progress_clear(&session.progress);
    /* An unbounded solid is worth describing: no complaint. */
    bool bounded = zs_field_box(session.field, session.lo, session.hi, NULL);
    (options->json ? json_info : print_info)(&session, bounded);
  }
  return cli_session_close(&session, done);
}
