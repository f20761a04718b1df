/* Shapes by SVG path data, and by SVG files. */
#include "nodes/outlined.h"

#include "files/svg.h"
#include "nodes/common.h"

#include <math.h>
#include <string.h>

/* How far chords are from curves, by the size of the whole. */
static const double TOLERANCE = 1e-5;

struct path {
  const char *d, *src, *group;
  int fill_rule, y;
  double tolerance;
};

static const char *const fill_rules[] = {"nonzero", "even-odd", NULL};
static const char *const directions[] = {"up", "down", NULL};
static const char *const words[] = {"auto", NULL};
enum { EVEN_ODD = 1, Y_DOWN = 1 };

static const zs_attribute attributes[] = {
  {.name = "d", .type = ZS_TEXT, .offset = offsetof(struct path, d), .initial = "", .unit = "",
   .doc = "SVG path data, with the commands M L H V C S Q T A Z and m l h v c s q t a z; its x and "
          "y are the scene's, so that y grows upwards"},
  {.name = "src", .type = ZS_FILE, .offset = offsetof(struct path, src), .initial = "", .unit = "",
   .doc = "instead of `d`: an SVG file, whose paths and basic shapes are joined"},
  {.name = "group", .type = ZS_TEXT, .offset = offsetof(struct path, group), .initial = "",
   .unit = "", .doc = "of the file, only the element with this id and what is in it"},
  ZS_SELECT(struct path, fill_rule, "fill-rule", "nonzero", fill_rules,
            "what `d` encloses: `nonzero`, where it winds around, or `even-odd`, where a ray "
            "crosses it an odd number of times; shapes of a file say it themselves"),
  ZS_SELECT(struct path, y, "y", "up", directions,
            "of a file, whose y grows downwards: `up`, turned over so that the lower side of the "
            "page is at y = 0; `down`, as it is"),
  {.name = "tolerance", .type = ZS_NUMBER, .offset = offsetof(struct path, tolerance),
   .initial = "auto", .unit = "length", .range = ZS_RANGE_POSITIVE, .choices = words,
   .doc = "how far straight pieces may be from the curves that they stand for; auto is a "
          "hundred-thousandth of the size of the whole"},
};

static bool check(const zs_node *node, zs_diag *diag)
{
  static const char *const of_data[] = {"fill-rule", NULL}, *const of_file[] = {"group", "y", NULL};
  const bool d = zs_node_has(node, "d"), src = zs_node_has(node, "src");
  if (d == src)
    return zs_node_misuse(node, diag, d ? "src" : NULL,
                          d ? "'src' cannot be combined with 'd'"
                            : "neither 'd' nor 'src' is there; expected one of them");
  for (const char *const *name = d ? of_file : of_data; *name; name++)
    if (zs_node_has(node, *name))
      return zs_node_misuse(node, diag, *name, "'%s' belongs with '%s'", *name, d ? "src" : "d");
  return true;
}

static bool read_data(const zs_node *node, zs_outline *outline, zs_diag *diag)
{
  static const double identity[6] = {1, 0, 0, 1, 0, 0};
  const struct path *p = node->parameters;
  zs_path_error error = {.memory = true};
  if (zs_outline_begin(outline, p->fill_rule == EVEN_ODD) &&
      zs_outline_add_path(outline, p->d, strlen(p->d), identity, &error))
    return true;
  if (error.memory)
    return zs_fail_memory(diag);
  return zs_node_misuse(node, diag, "d", "%s (character %zu)", error.message, error.offset + 1);
}

static bool read_outline(const zs_node *node, zs_outline *outline, zs_diag *diag)
{
  const struct path *p = node->parameters;
  *outline = (zs_outline){0};
  const char *group = zs_node_has(node, "group") ? p->group : NULL;
  const bool done = p->src ? zs_svg_read(outline, p->src, group, p->y == Y_DOWN, diag)
                           : read_data(node, outline, diag);
  if (!done)
    zs_outline_clear(outline);
  return done;
}

/* What the node fills. */
static bool outline_of(const zs_node *node, zs_fill *fill, zs_diag *diag)
{
  const struct path *p = node->parameters;
  const bool given = !isnan(p->tolerance);
  zs_outline outline;
  if (!read_outline(node, &outline, diag))
    return false;
  const bool done = zs_outlined_fill(&outline, given ? p->tolerance : TOLERANCE, given, node,
                                     p->src ? "src" : "d", NULL, fill, diag);
  zs_outline_clear(&outline);
  return done;
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  zs_fill fill = {0};
  const zs_value f = outline_of(node, &fill, zs_compiler_diag(compiler))
                       ? zs_outlined_emit(compiler, &fill, at)
                       : zs_emit_constant(compiler, 0);
  zs_fill_clear(&fill);
  return f;
}

const zs_kind zs_kind_path = {
  .name = "path",
  .family = ZS_FAMILY_SHAPE,
  .summary = "a shape with curved edges, by SVG path data or from an SVG file",
  .doc = "f is the distance to the nearest edge, positive inside. Edges within what is filled, as "
         "where outlines overlap, do not count. Of a file all shapes are taken, however they are "
         "painted, but not text, pictures, clones and what is not displayed, which attributes and "
         "`style` say, but no style sheet. A page whose size is in a unit of length is read in "
         "millimetres, others in pixels.",
  .source = "https://www.w3.org/TR/SVG11/paths.html",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct path),
  .children = ZS_CHILDREN_NONE,
  .check = check,
  .emit = emit,
  .outline = outline_of,
};
