#include "scene/document.h"

#include <string.h>

#define TEXT(struct_, member, name_, initial_, doc_) \
  {.name = name_, .type = ZS_TEXT, .offset = offsetof(struct_, member), .initial = initial_, \
   .unit = "", .doc = doc_}

const zs_attribute zs_placement_attributes[ZS_PLACEMENT_ATTRIBUTES] = {
  ZS_POINT(struct zs_placement, at, "at", "0 0 0", "moves the node's origin there"),
  {.name = "rotate", .type = ZS_VECTOR3, .offset = offsetof(struct zs_placement, rotate),
   .initial = "0 0 0", .unit = "degrees",
   .doc = "turns about the x axis, then y, then z, before it is moved"},
  {.name = "scale", .type = ZS_SCALE, .offset = offsetof(struct zs_placement, scale),
   .initial = "1", .unit = "1", .range = ZS_RANGE_NOT_ZERO,
   .doc = "one factor, or one each for x, y and z, before it is turned"},
};

static const zs_kind *const scene_parts[] = {
  &zs_document_param,  &zs_document_domain, &zs_document_object, &zs_document_define,
  &zs_document_include, &zs_document_view,  NULL};

static const zs_attribute scene_attributes[] = {
  TEXT(struct zs_document_scene, units, "units", "",
       "the unit of length, such as `mm`, for files that can say so"),
  TEXT(struct zs_document_scene, main, "main", "",
       "id of the main object; default: the last object of the file, or the nodes in the root"),
  {.name = "fits", .type = ZS_FILE, .offset = offsetof(struct zs_document_scene, fits),
   .initial = "", .unit = "",
   .doc = "a file of fits that have been made already, as `zeroset fit` writes it; what they depend "
          "on and has changed since is fitted anew"},
};

const zs_kind zs_document_scene = {
  .name = "scene",
  .family = ZS_FAMILY_PART,
  .summary = "the root of a scene file",
  .doc = "Nodes that stand in the root, in no object, are united to the main object of a scene "
         "that has no `object` of its own.",
  .attributes = scene_attributes,
  .attribute_count = ZS_COUNT_OF(scene_attributes),
  .parameters_size = sizeof(struct zs_document_scene),
  .children = ZS_CHILDREN_MANY,
  .parts = scene_parts,
};

static const zs_attribute param_attributes[] = {
  TEXT(struct zs_document_param, name, "name", NULL,
       "letters, digits and `_`; known to all expressions and formulas"),
  ZS_PLAIN(struct zs_document_param, value, "value", NULL, ZS_RANGE_ANY,
           "default; an expression may use the parameters before it"),
  ZS_PLAIN(struct zs_document_param, minimum, "min", "", ZS_RANGE_ANY, "least value allowed"),
  ZS_PLAIN(struct zs_document_param, maximum, "max", "", ZS_RANGE_ANY, "greatest value allowed"),
  TEXT(struct zs_document_param, doc, "doc", "", "what it means, for people"),
};

const zs_kind zs_document_param = {
  .name = "param",
  .family = ZS_FAMILY_PART,
  .summary = "a named number that the command line or a program may set",
  .attributes = param_attributes,
  .attribute_count = ZS_COUNT_OF(param_attributes),
  .parameters_size = sizeof(struct zs_document_param),
  .children = ZS_CHILDREN_NONE,
};

static const zs_attribute domain_attributes[] = {
  ZS_POINT(struct zs_document_domain, minimum, "min", NULL, "lower corner"),
  ZS_POINT(struct zs_document_domain, maximum, "max", NULL, "upper corner"),
};

const zs_kind zs_document_domain = {
  .name = "domain",
  .family = ZS_FAMILY_PART,
  .summary = "the box that meshes, volumes and pictures show by default",
  .doc = "Without it the box is found around the solid, which must then be bounded.",
  .attributes = domain_attributes,
  .attribute_count = ZS_COUNT_OF(domain_attributes),
  .parameters_size = sizeof(struct zs_document_domain),
  .children = ZS_CHILDREN_NONE,
};

static const zs_attribute object_attributes[] = {
  TEXT(struct zs_document_object, id, "id", NULL, "name for `use` and the command line"),
  TEXT(struct zs_document_object, title, "title", "", "what it is, for people"),
};

const zs_kind zs_document_object = {
  .name = "object",
  .family = ZS_FAMILY_PART,
  .summary = "names a node, or the union of several",
  .attributes = object_attributes,
  .attribute_count = ZS_COUNT_OF(object_attributes),
  .parameters_size = sizeof(struct zs_document_object),
  .children = ZS_CHILDREN_ONE,
};

static const zs_attribute use_attributes[] = {
  TEXT(struct zs_document_use, object, "object", NULL, "id of the object, before or after"),
};

const zs_kind zs_document_use = {
  .name = "use",
  .family = ZS_FAMILY_PART,
  .summary = "an object, shared",
  .doc = "However often it is used, an object is fitted and compiled once. It is placed with "
         "`at`, `rotate` and `scale` like any node.",
  .attributes = use_attributes,
  .attribute_count = ZS_COUNT_OF(use_attributes),
  .parameters_size = sizeof(struct zs_document_use),
  .children = ZS_CHILDREN_NONE,
};

static const zs_kind *const define_parts[] = {&zs_document_argument, NULL};

static const zs_attribute define_attributes[] = {
  TEXT(struct zs_document_define, name, "name", NULL, "name for `instance`"),
};

const zs_kind zs_document_define = {
  .name = "define",
  .family = ZS_FAMILY_PART,
  .summary = "a node with arguments, or the union of several, for `instance`",
  .doc = "The body knows its arguments and the scene's parameters.",
  .attributes = define_attributes,
  .attribute_count = ZS_COUNT_OF(define_attributes),
  .parameters_size = sizeof(struct zs_document_define),
  .children = ZS_CHILDREN_ONE,
  .parts = define_parts,
};

static const zs_attribute argument_attributes[] = {
  TEXT(struct zs_document_argument, name, "name", NULL, "letters, digits and `_`"),
  ZS_PLAIN(struct zs_document_argument, value, "value", "", ZS_RANGE_ANY,
           "default; without one every instance must give the argument"),
};

const zs_kind zs_document_argument = {
  .name = "argument",
  .family = ZS_FAMILY_PART,
  .summary = "a number that each instance of a `define` may give",
  .attributes = argument_attributes,
  .attribute_count = ZS_COUNT_OF(argument_attributes),
  .parameters_size = sizeof(struct zs_document_argument),
  .children = ZS_CHILDREN_NONE,
};

static const zs_attribute instance_attributes[] = {
  TEXT(struct zs_document_instance, of, "of", NULL, "name of the definition, before or after"),
};

const zs_kind zs_document_instance = {
  .name = "instance",
  .family = ZS_FAMILY_PART,
  .summary = "a definition's node, with its arguments as attributes",
  .doc = "It is placed with `at`, `rotate` and `scale` like any node.",
  .attributes = instance_attributes,
  .attribute_count = ZS_COUNT_OF(instance_attributes),
  .parameters_size = sizeof(struct zs_document_instance),
  .children = ZS_CHILDREN_NONE,
};

static const zs_attribute repeat_attributes[] = {
  TEXT(struct zs_document_repeat, variable, "for", NULL, "name of the counter in expressions"),
  ZS_PLAIN(struct zs_document_repeat, from, "from", NULL, ZS_RANGE_ANY, "first value"),
  ZS_PLAIN(struct zs_document_repeat, to, "to", NULL, ZS_RANGE_ANY,
           "last value; the children are left out when it cannot be reached"),
  ZS_PLAIN(struct zs_document_repeat, step, "step", "1", ZS_RANGE_NOT_ZERO,
           "from one value to the next, negative to count down"),
};

const zs_kind zs_document_repeat = {
  .name = "repeat",
  .family = ZS_FAMILY_PART,
  .summary = "its children, once for each value of a counter",
  .doc = "The children stand in the place of `repeat`, in order.",
  .attributes = repeat_attributes,
  .attribute_count = ZS_COUNT_OF(repeat_attributes),
  .parameters_size = sizeof(struct zs_document_repeat),
  .children = ZS_CHILDREN_ONE,
};

static const zs_attribute include_attributes[] = {
  {.name = "href", .type = ZS_FILE, .offset = offsetof(struct zs_document_include, href),
   .unit = "", .doc = "the scene file, relative to this one"},
};

const zs_kind zs_document_include = {
  .name = "include",
  .family = ZS_FAMILY_PART,
  .summary = "the objects, parameters and definitions of another scene file",
  .doc = "A file that is included twice is read once.",
  .attributes = include_attributes,
  .attribute_count = ZS_COUNT_OF(include_attributes),
  .parameters_size = sizeof(struct zs_document_include),
  .children = ZS_CHILDREN_NONE,
};

static const zs_attribute view_attributes[] = {
  TEXT(struct zs_document_view, id, "id", "", "name for the command line"),
  ZS_POINT(struct zs_document_view, eye, "eye", "", "where the camera is"),
  ZS_POINT(struct zs_document_view, target, "target", "0 0 0", "what an `eye` looks at"),
  {.name = "up", .type = ZS_VECTOR3, .offset = offsetof(struct zs_document_view, up),
   .initial = "0 0 1", .unit = "1", .doc = "direction that is up in the picture"},
  {.name = "direction", .type = ZS_VECTOR3,
   .offset = offsetof(struct zs_document_view, direction), .initial = "", .unit = "1",
   .doc = "instead of `eye`: look this way at the whole solid"},
  {.name = "fov", .type = ZS_NUMBER, .offset = offsetof(struct zs_document_view, field_of_view),
   .initial = "35", .unit = "degrees", .range = ZS_RANGE_BETWEEN, .minimum = 1, .maximum = 170,
   .doc = "field of view from the top to the bottom of the picture"},
};

const zs_kind zs_document_view = {
  .name = "view",
  .family = ZS_FAMILY_PART,
  .summary = "a camera for pictures",
  .attributes = view_attributes,
  .attribute_count = ZS_COUNT_OF(view_attributes),
  .parameters_size = sizeof(struct zs_document_view),
  .children = ZS_CHILDREN_NONE,
};

const zs_kind *const zs_document_kinds[] = {
  &zs_document_scene,   &zs_document_param,    &zs_document_domain,   &zs_document_object,
  &zs_document_use,     &zs_document_define,   &zs_document_argument, &zs_document_instance,
  &zs_document_repeat,  &zs_document_include,  &zs_document_view,     NULL};

const zs_kind *zs_document_kind_find(const char *name)
{
  for (const zs_kind *const *kind = zs_document_kinds; *kind; kind++)
    if ((*kind)->name[0] == name[0] && strcmp((*kind)->name, name) == 0)
      return *kind;
  return NULL;
}

bool zs_document_kind_is_node(const zs_kind *kind)
{
  return kind == &zs_document_use || kind == &zs_document_instance || kind == &zs_document_repeat;
}
