/* Loading scenes: files, includes, and the definitions of the document. */
#include "files/number.h"
#include "nodes/fits.h"
#include "scene/scene.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const zs_scene_options default_options = {
  .maximum_depth = 256, .maximum_nodes = 10000000, .maximum_file_size = (uint64_t)1 << 30};

void zs_scene_options_init(zs_scene_options *options)
{
  *options = default_options;
}

void *zs_list_add(void *items, size_t *count, size_t *capacity, size_t size, zs_arena *arena,
                  zs_diag *diag)
{
  void *old;
  memcpy(&old, items, sizeof old);
  if (*count == *capacity) {
    size_t larger = *capacity ? 2 * *capacity : 16;
    void *moved = zs_arena_alloc(arena, larger, size);
    if (!moved) {
      zs_fail_memory(diag);
      return NULL;
    }
    if (*count)
      memcpy(moved, old, *count * size);
    memcpy(items, &moved, sizeof moved);
    *capacity = larger;
    old = moved;
  }
  return (char *)old + size * (*count)++;
}

/* ---- Files ------------------------------------------------------------- */

/* Where a file is asked for: an include's attribute, or nothing. */
typedef struct request {
  const zs_element *element;
  const zs_xml_attribute *attribute;
} request;

/* An error about a file, at the place that asks for it or about the file. */
static bool fail_file(zs_diag *diag, const char *path, const request *from, zs_status status,
                      const char *problem)
{
  if (!from)
    return zs_fail(diag, status, path, "%s", problem);
  zs_place place = zs_attribute_place(from->element, from->attribute, 0);
  return zs_report(diag, ZS_ERROR, status, &place, NULL, "'%s': %s", from->attribute->value,
                   problem);
}

/* Twice the room for a text in the arena, or NULL. */
static char *larger_text(zs_arena *arena, const char *text, size_t *capacity)
{
  char *larger = zs_arena_reserve(arena, 2, *capacity);
  if (larger)
    memcpy(larger, text, *capacity);
  *capacity *= 2;
  return larger;
}

/* Read all of an open file, of `expected` bytes if known, into the arena; the
 * text ends with a zero. */
static bool read_all(int descriptor, size_t expected, uint64_t limit, zs_arena *arena,
                     zs_source *source, const char **problem)
{
  size_t capacity = (expected ? expected : 1 << 16) + 1, length = 0;
  char *text = zs_arena_reserve(arena, 1, capacity);
  *problem = NULL;
  for (;;) {
    if (text && length == capacity)
      text = larger_text(arena, text, &capacity);
    if (!text)
      *problem = "out of memory";
    if (*problem)
      return false;
    ssize_t got = read(descriptor, text + length, capacity - length);
    if (got == 0)
      break;
    if (got < 0 && errno != EINTR)
      *problem = strerror(errno);
    length += got > 0 ? (size_t)got : 0;
    if (length > limit)
      *problem = "larger than the limit for scene files";
  }
  text[length] = '\0'; /* there was room to read more */
  source->text = text;
  source->length = length;
  return true;
}

/* Open and read a file, and learn which one it is. */
static bool read_file(zs_scene *scene, zs_file *file, const request *from, zs_diag *diag)
{
  const char *path = file->source.name, *problem = NULL;
  int descriptor = open(path, O_RDONLY | O_CLOEXEC);
  struct stat status;
  if (descriptor < 0 || fstat(descriptor, &status) != 0) {
    problem = strerror(errno);
  } else if (S_ISDIR(status.st_mode)) {
    problem = "is a folder";
  } else if (from && !S_ISREG(status.st_mode)) {
    problem = "is not a regular file";
  } else {
    file->device = (uint64_t)status.st_dev;
    file->inode = (uint64_t)status.st_ino;
    const uint64_t limit = scene->options.maximum_file_size;
    const uint64_t size = S_ISREG(status.st_mode) ? (uint64_t)status.st_size : 0;
    read_all(descriptor, size <= limit ? (size_t)size : 0, limit, &scene->arena, &file->source,
             &problem);
  }
  if (descriptor >= 0)
    close(descriptor);
  return !problem || fail_file(diag, path, from, ZS_ERROR_IO, problem);
}

static zs_file *new_file(zs_scene *scene, const char *name, const zs_file *includer,
                         zs_diag *diag)
{
  zs_file *file = ZS_ARENA_NEW(&scene->arena, zs_file, 1);
  if (file) {
    file->source.name = zs_arena_string(&scene->arena, name, strlen(name));
    file->folder = zs_path_folder(name, &scene->arena);
    file->includer = includer;
    file->lines.arena = &scene->arena;
    file->source.lines = &file->lines;
  }
  if (!file || !file->source.name || !file->folder) {
    zs_fail_memory(diag);
    return NULL;
  }
  return file;
}

static void append_file(zs_scene *scene, zs_file *file)
{
  zs_file **end = &scene->files;
  while (*end)
    end = &(*end)->next;
  *end = file;
}

/* ---- Definitions ------------------------------------------------------- */

static void collect(zs_scene *scene, zs_file *file, zs_diag *diag);

static void fail_duplicate(zs_diag *diag, const zs_element *element,
                           const zs_xml_attribute *attribute, const zs_element *first)
{
  zs_place place = zs_attribute_place(element, attribute, 0);
  if (element->source == first->source)
    zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL, "'%s' is taken already, in line %u",
              attribute->value, first->line);
  else
    zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
              "'%s' is taken already, in %s, line %u", attribute->value, first->source->name,
              first->line);
}

/* Read a definition's attributes, of which those with expressions will be
 * looked at later. */
static const void *read_texts(zs_scene *scene, const zs_element *element, const zs_kind *kind,
                              zs_diag *diag)
{
  zs_reading reading = {.scene = scene, .arena = &scene->arena, .diag = diag};
  return zs_attributes_read(&reading, element, (zs_attribute_rule){.kind = kind}, NULL, NULL,
                            NULL);
}

/* Elements that hold no others. */
static void check_childless(const zs_element *element, zs_diag *diag)
{
  if (!element->first)
    return;
  zs_place place = zs_element_place(element->first);
  zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL, "<%s> has no elements inside",
            element->name);
}

/* The attribute that names a definition, when it is a name that is free. */
static const zs_xml_attribute *naming_attribute(const zs_element *element, const char *name,
                                                bool identifier, zs_diag *diag)
{
  const zs_xml_attribute *attribute = zs_element_attribute(element, name);
  if (!attribute)
    return NULL; /* reported as missing */
  if (identifier)
    return zs_identifier_check(element, attribute, diag) ? attribute : NULL;
  if (attribute->length > 0)
    return attribute;
  zs_place place = zs_attribute_place(element, attribute, 0);
  zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL, "'' is not a name");
  return NULL;
}

static bool add_name(zs_scene *scene, zs_names *names, const zs_xml_attribute *attribute,
                     size_t index, zs_diag *diag)
{
  return zs_names_add(names, &scene->arena, attribute->value, attribute->length,
                      (uint32_t)index) ||
         zs_fail_memory(diag);
}

static void collect_param(zs_scene *scene, const zs_element *element, zs_diag *diag)
{
  check_childless(element, diag);
  const zs_xml_attribute *name = naming_attribute(element, "name", true, diag);
  const zs_name *taken =
    name ? zs_names_find(&scene->parameter_names, name->value, name->length) : NULL;
  if (taken)
    fail_duplicate(diag, element, name, scene->parameters.items[taken->value].element);
  if (taken || !name) {
    read_texts(scene, element, &zs_document_param, diag);
    return;
  }
  size_t index = scene->parameters.count;
  zs_scene_parameter_state *parameter = ZS_LIST_ADD(scene->parameters, scene, diag);
  if (!parameter)
    return;
  *parameter = (zs_scene_parameter_state){.element = element, .at.name = name->value};
  add_name(scene, &scene->parameter_names, name, index, diag);
}

static void collect_object(zs_scene *scene, const zs_element *element, zs_diag *diag)
{
  read_texts(scene, element, &zs_document_object, diag);
  const zs_xml_attribute *id = naming_attribute(element, "id", false, diag);
  const zs_name *taken = id ? zs_names_find(&scene->object_names, id->value, id->length) : NULL;
  if (taken)
    fail_duplicate(diag, element, id, scene->objects.items[taken->value].element);
  /* Objects without a usable name are kept, so that their errors are found. */
  size_t index = scene->objects.count;
  zs_scene_object_state *object = ZS_LIST_ADD(scene->objects, scene, diag);
  if (!object)
    return;
  *object = (zs_scene_object_state){id ? id->value : "", element};
  if (id && !taken)
    add_name(scene, &scene->object_names, id, index, diag);
}

/* Names that an instance's attributes have already. */
static bool check_argument_name(const zs_element *element, const zs_xml_attribute *name,
                                zs_diag *diag)
{
  static const char *const taken[] = {"of", "at", "rotate", "scale"};
  for (size_t i = 0; i < sizeof taken / sizeof taken[0]; i++) {
    if (strcmp(name->value, taken[i]) == 0) {
      zs_place place = zs_attribute_place(element, name, 0);
      return zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
                       "'%s' is an attribute of every instance; expected another name",
                       name->value);
    }
  }
  return true;
}

/* Add an argument to its definition; returns its name, or NULL after an error.
 * `scope` holds the arguments before it. */
static const char *collect_argument(zs_scene *scene, zs_definition *definition,
                             const zs_element *element, const zs_scope *scope, zs_diag *diag)
{
  check_childless(element, diag);
  zs_reading reading = {.scene = scene, .arena = &scene->arena, .diag = diag, .scope = scope};
  zs_attributes_read(&reading, element, (zs_attribute_rule){.kind = &zs_document_argument}, NULL,
                     NULL, NULL);
  const zs_xml_attribute *name = naming_attribute(element, "name", true, diag);
  if (!name || !check_argument_name(element, name, diag))
    return NULL;
  for (size_t i = 0; i < definition->argument_count; i++) {
    if (strcmp(definition->argument_names[i], name->value) == 0) {
      fail_duplicate(diag, element, name, definition->arguments[i]);
      return NULL;
    }
  }
  definition->arguments[definition->argument_count] = element;
  definition->argument_names[definition->argument_count++] = name->value;
  return name->value;
}

static void collect_define(zs_scene *scene, const zs_element *element, zs_diag *diag)
{
  read_texts(scene, element, &zs_document_define, diag);
  const zs_xml_attribute *name = naming_attribute(element, "name", false, diag);
  const zs_name *taken =
    name ? zs_names_find(&scene->definition_names, name->value, name->length) : NULL;
  if (taken)
    fail_duplicate(diag, element, name, scene->definitions.items[taken->value].element);
  size_t count = 0, index = scene->definitions.count;
  for (const zs_element *child = element->first; child; child = child->next)
    count += strcmp(child->name, "argument") == 0;
  zs_definition *definition = ZS_LIST_ADD(scene->definitions, scene, diag);
  if (!definition)
    return;
  *definition = (zs_definition){.name = name ? name->value : "", .element = element};
  definition->arguments = ZS_ARENA_NEW(&scene->arena, const zs_element *, count);
  definition->argument_names = ZS_ARENA_NEW(&scene->arena, const char *, count);
  if (!definition->arguments || !definition->argument_names) {
    zs_fail_memory(diag);
    return;
  }
  if (name && !taken)
    add_name(scene, &scene->definition_names, name, index, diag);
}

/* Arguments are read when all parameters are known. */
static void collect_arguments(zs_scene *scene, zs_diag *diag)
{
  for (size_t i = 0; i < scene->definitions.count; i++) {
    zs_definition *definition = &scene->definitions.items[i];
    const zs_scope *scope = NULL;
    for (const zs_element *child = definition->element->first; child; child = child->next) {
      if (strcmp(child->name, "argument") != 0)
        continue;
      zs_scope *inner = ZS_ARENA_NEW(&scene->arena, zs_scope, 1);
      if (!inner) {
        zs_fail_memory(diag);
        return;
      }
      const char *name = collect_argument(scene, definition, child, scope, diag);
      *inner = (zs_scope){name, 1, false, scope};
      scope = name ? inner : scope;
    }
  }
}

static void collect_domain(zs_scene *scene, zs_file *file, const zs_element *element,
                           zs_diag *diag)
{
  check_childless(element, diag);
  if (file != scene->files)
    return; /* only objects, parameters and definitions are included */
  if (!scene->domain) {
    scene->domain = element;
    return;
  }
  zs_place place = zs_element_place(element);
  zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
            "the scene has a domain already, in line %u", scene->domain->line);
}

static void collect_view(zs_scene *scene, zs_file *file, const zs_element *element, zs_diag *diag)
{
  check_childless(element, diag);
  if (file != scene->files)
    return;
  const zs_xml_attribute *id = zs_element_attribute(element, "id");
  const zs_name *taken = id ? zs_names_find(&scene->view_names, id->value, id->length) : NULL;
  if (taken)
    fail_duplicate(diag, element, id, scene->views.items[taken->value].element);
  size_t index = scene->views.count;
  zs_scene_view_state *view = ZS_LIST_ADD(scene->views, scene, diag);
  if (!view)
    return;
  *view = (zs_scene_view_state){.element = element};
  if (id && !taken)
    add_name(scene, &scene->view_names, id, index, diag);
}

/* Report "a.xml -> b.xml -> a.xml". */
static void fail_include_circle(zs_diag *diag, const request *from, const zs_file *includer,
                                const zs_file *again)
{
  char path[1024] = "";
  size_t start = sizeof path - 1;
  /* From the innermost file outwards, written from the end. */
  const char *name = again->source.name;
  for (const zs_file *f = includer;; f = f->includer) {
    size_t length = strlen(name), arrow = start == sizeof path - 1 ? 0 : 4;
    if (length + arrow > start)
      break;
    memcpy(path + (start -= arrow), " -> ", arrow);
    memcpy(path + (start -= length), name, length);
    if (!f)
      break;
    name = f->source.name;
    if (f == again) {
      length = strlen(name);
      if (length + 4 <= start) {
        memcpy(path + (start -= 4), " -> ", 4);
        memcpy(path + (start -= length), name, length);
      }
      break;
    }
  }
  zs_place place = zs_attribute_place(from->element, from->attribute, 0);
  zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL, "includes itself: %s", path + start);
}

static void collect_include(zs_scene *scene, zs_file *file, const zs_element *element,
                            zs_diag *diag)
{
  check_childless(element, diag);
  const struct zs_document_include *include =
    read_texts(scene, element, &zs_document_include, diag);
  const zs_xml_attribute *href = zs_element_attribute(element, "href");
  if (!include || !href || !include->href)
    return;
  request from = {element, href};
  zs_file *read = new_file(scene, include->href, file, diag);
  if (!read || !read_file(scene, read, &from, diag))
    return;
  for (const zs_file *f = scene->files; f; f = f->next) {
    if (f->device == read->device && f->inode == read->inode) {
      if (f->open)
        fail_include_circle(diag, &from, file, f);
      return; /* what it defines is known already */
    }
  }
  read->root = zs_xml_parse(&read->source, &zs_xml_scene, scene->options.maximum_depth,
                            &scene->arena, diag);
  if (!read->root)
    return;
  append_file(scene, read);
  collect(scene, read, diag);
}

static void collect_element(zs_scene *scene, zs_file *file, const zs_element *element,
                            zs_diag *diag)
{
  const zs_kind *kind = zs_document_kind_find(element->name);
  if (kind == &zs_document_param)
    collect_param(scene, element, diag);
  else if (kind == &zs_document_object)
    collect_object(scene, element, diag);
  else if (kind == &zs_document_define)
    collect_define(scene, element, diag);
  else if (kind == &zs_document_domain)
    collect_domain(scene, file, element, diag);
  else if (kind == &zs_document_view)
    collect_view(scene, file, element, diag);
  else if (kind == &zs_document_include)
    collect_include(scene, file, element, diag);
}

/* Take the definitions out of a file, in order, with those it includes. */
static void collect(zs_scene *scene, zs_file *file, zs_diag *diag)
{
  const zs_element *root = file->root;
  file->open = true;
  if (strcmp(root->name, "scene") != 0) {
    zs_place place = zs_element_place(root);
    zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
              "the root element is <%s>; expected <scene>", root->name);
  } else {
    const struct zs_document_scene *attributes =
      read_texts(scene, root, &zs_document_scene, diag);
    if (attributes && file == scene->files)
      scene->attributes = *attributes;
    if (attributes && attributes->fits)
      zs_fits_read(scene->cache, attributes->fits, diag);
    for (const zs_element *child = root->first; child; child = child->next)
      collect_element(scene, file, child, diag);
  }
  file->open = false;
}

/* ---- Values that depend on parameters ---------------------------------- */

/* Whether a value is in the parameter's range; reports at `place`. */
static bool check_range(const zs_scene_parameter_state *parameter, double value,
                        const zs_place *place, zs_status status, zs_diag *diag)
{
  double lo = parameter->at.minimum, hi = parameter->at.maximum;
  if (!(value < lo) && !(value > hi))
    return true;
  char seen[ZS_NUMBER_SIZE], least[ZS_NUMBER_SIZE], most[ZS_NUMBER_SIZE];
  zs_number_format(seen, value);
  zs_number_format(least, lo);
  zs_number_format(most, hi);
  const char *name = parameter->at.name;
  if (isnan(lo))
    return zs_report(diag, ZS_ERROR, status, place, NULL,
                     "%s = %s is too large; expected at most %s", name, seen, most);
  if (isnan(hi))
    return zs_report(diag, ZS_ERROR, status, place, NULL,
                     "%s = %s is too small; expected at least %s", name, seen, least);
  return zs_report(diag, ZS_ERROR, status, place, NULL,
                   "%s = %s is out of range; expected %s to %s", name, seen, least, most);
}

/* Evaluate parameter `index`; those before it have their values. */
static void update_parameter(zs_scene *scene, size_t index, zs_arena *arena, zs_diag *diag)
{
  zs_scene_parameter_state *parameter = &scene->parameters.items[index];
  const zs_element *element = parameter->element;
  const zs_xml_attribute *value = zs_element_attribute(element, "value");
  const char *name = parameter->at.name, *doc = parameter->at.doc;
  zs_reading reading = {.scene = scene, .arena = arena, .diag = diag};
  zs_diag count = {0};
  zs_diag *counted = diag ? diag : &count;
  unsigned errors = counted->errors;
  reading.diag = counted;
  scene->visible_parameters = index;
  parameter->known = false;
  const struct zs_document_param *now = zs_attributes_read(
    &reading, element, (zs_attribute_rule){.kind = &zs_document_param}, NULL, NULL, NULL);
  if (!now)
    return;
  parameter->at = *now;
  parameter->at.name = name;
  /* Texts do not change; keep the copy that lives as long as the scene. */
  const zs_xml_attribute *text = zs_element_attribute(element, "doc");
  parameter->at.doc = doc ? doc : text ? text->value : "";
  if (parameter->set)
    parameter->at.value = parameter->chosen;
  zs_place place = value ? zs_attribute_place(element, value, 0) : zs_element_place(element);
  if (counted->errors != errors || reading.unknown)
    return;
  parameter->known = true;
  if (now->minimum > now->maximum)
    zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL, "min is greater than max");
  else
    check_range(parameter, parameter->at.value, &place, ZS_ERROR_SCHEMA, diag);
}

static bool is_zero(const double v[3])
{
  return v[0] == 0 && v[1] == 0 && v[2] == 0;
}

static void update_view(zs_scene *scene, zs_scene_view_state *state, zs_arena *arena,
                        zs_diag *diag)
{
  const zs_element *element = state->element;
  zs_reading reading = {.scene = scene, .arena = arena, .diag = diag};
  const struct zs_document_view *now = zs_attributes_read(
    &reading, element, (zs_attribute_rule){.kind = &zs_document_view}, NULL, NULL, NULL);
  if (!now)
    return;
  const zs_xml_attribute *id = zs_element_attribute(element, "id");
  zs_view *view = &state->view;
  view->id = id ? id->value : "";
  view->has_eye = zs_element_attribute(element, "eye");
  memcpy(view->eye, now->eye, sizeof view->eye);
  memcpy(view->target, now->target, sizeof view->target);
  memcpy(view->up, now->up, sizeof view->up);
  memcpy(view->direction, now->direction, sizeof view->direction);
  view->field_of_view = now->field_of_view;
  bool direction = zs_element_attribute(element, "direction");
  zs_place place = zs_element_place(element);
  if (view->has_eye == direction) {
    zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
              direction ? "both an eye and a direction; expected one of them"
                        : "no eye and no direction; expected one of them");
    return;
  }
  if (view->has_eye && memcmp(view->eye, view->target, sizeof view->eye) == 0)
    zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, &place, NULL, "the eye is at its target");
  if (direction && is_zero(view->direction))
    zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, &place, NULL, "the direction is 0 0 0");
  if (is_zero(view->up))
    zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, &place, NULL, "up is 0 0 0");
}

void zs_scene_update(zs_scene *scene, zs_diag *diag)
{
  zs_arena arena = {0};
  for (size_t i = 0; i < scene->parameters.count; i++)
    update_parameter(scene, i, &arena, diag);
  scene->visible_parameters = scene->parameters.count;
  for (size_t i = 0; i < scene->views.count; i++)
    update_view(scene, &scene->views.items[i], &arena, diag);
  zs_arena_free(&arena);
}

bool zs_scene_domain(zs_scene *scene, double lo[3], double hi[3], zs_diag *diag)
{
  if (!scene->domain)
    return false;
  zs_arena arena = {0};
  zs_diag count = {0};
  zs_reading reading = {.scene = scene, .arena = &arena, .diag = diag ? diag : &count};
  unsigned errors = reading.diag->errors;
  const struct zs_document_domain *domain = zs_attributes_read(
    &reading, scene->domain, (zs_attribute_rule){.kind = &zs_document_domain}, NULL, NULL, NULL);
  bool good = domain && reading.diag->errors == errors;
  for (int i = 0; good && i < 3; i++) {
    lo[i] = domain->minimum[i];
    hi[i] = domain->maximum[i];
    if (lo[i] < hi[i])
      continue;
    zs_place place = zs_element_place(scene->domain);
    good = zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, &place, NULL,
                     "max is not greater than min along %c", "xyz"[i]);
  }
  zs_arena_free(&arena);
  return good;
}

/* ---- Scenes ------------------------------------------------------------ */

/* `main` names an object. */
static void check_main(zs_scene *scene, zs_diag *diag)
{
  const zs_element *root = scene->files->root;
  const zs_xml_attribute *attribute = zs_element_attribute(root, "main");
  if (!attribute || zs_names_find(&scene->object_names, attribute->value, attribute->length))
    return;
  zs_place place = zs_attribute_place(root, attribute, 0);
  zs_fail_reference(&place, "object", attribute->value, &scene->object_names, diag);
}

static zs_scene *new_scene(const char *name, const zs_scene_options *options, zs_diag *diag)
{
  zs_scene *scene = calloc(1, sizeof *scene);
  zs_cache *cache = zs_cache_new();
  if (!scene || !cache) {
    free(scene);
    zs_cache_free(cache);
    zs_fail_memory(diag);
    return NULL;
  }
  scene->cache = cache;
  scene->options = options ? *options : default_options;
  if (!zs_paths_init(scene, name, diag)) {
    zs_scene_free(scene);
    return NULL;
  }
  /* The caller's list need not outlive this call; the roots are copies. */
  scene->options.allow_paths = NULL;
  scene->options.allow_path_count = 0;
  return scene;
}

/* Everything after the text is there. */
static zs_scene *finish(zs_scene *scene, zs_file *file, zs_diag *diag)
{
  zs_gate gate;
  zs_gate_open(&gate, diag, &scene->warned);
  file->root = zs_xml_parse(&file->source, &zs_xml_scene, scene->options.maximum_depth,
                            &scene->arena, &gate.diag);
  if (file->root) {
    append_file(scene, file);
    collect(scene, file, &gate.diag);
    if (strcmp(file->root->name, "scene") == 0) {
      zs_scene_update(scene, &gate.diag);
      collect_arguments(scene, &gate.diag);
      double lo[3], hi[3];
      zs_scene_domain(scene, lo, hi, &gate.diag);
      check_main(scene, &gate.diag);
      zs_scene_validate(scene, &gate.diag);
    }
  }
  if (zs_gate_close(&gate))
    return scene;
  zs_scene_free(scene);
  return NULL;
}

zs_scene *zs_scene_load(const char *path, const zs_scene_options *options, zs_diag *diag)
{
  zs_scene *scene = new_scene(path, options, diag);
  zs_file *file = scene ? new_file(scene, path, NULL, diag) : NULL;
  if (!file || !read_file(scene, file, NULL, diag)) {
    zs_scene_free(scene);
    return NULL;
  }
  return finish(scene, file, diag);
}

zs_scene *zs_scene_parse(const char *text, size_t length, const char *name,
                         const zs_scene_options *options, zs_diag *diag)
{
  zs_scene *scene = new_scene(name, options, diag);
  zs_file *file = scene ? new_file(scene, name, NULL, diag) : NULL;
  if (!file) {
    zs_scene_free(scene);
    return NULL;
  }
  if (length > scene->options.maximum_file_size) {
    zs_fail(diag, ZS_ERROR_IO, name, "larger than the limit for scene files");
    zs_scene_free(scene);
    return NULL;
  }
  file->source.text = zs_arena_string(&scene->arena, text, length);
  file->source.length = length;
  if (!file->source.text) {
    zs_fail_memory(diag);
    zs_scene_free(scene);
    return NULL;
  }
  return finish(scene, file, diag);
}

void zs_scene_free(zs_scene *scene)
{
  if (!scene)
    return;
  zs_cache_free(scene->cache);
  zs_arena_free(&scene->warned.arena);
  zs_arena_free(&scene->arena);
  free(scene);
}

const char *zs_scene_units(const zs_scene *scene)
{
  return scene->attributes.units;
}

size_t zs_scene_parameter_count(const zs_scene *scene)
{
  return scene->parameters.count;
}

bool zs_scene_parameter(const zs_scene *scene, size_t index, zs_parameter *parameter)
{
  if (index >= scene->parameters.count)
    return false;
  const struct zs_document_param *p = &scene->parameters.items[index].at;
  *parameter = (zs_parameter){.name = p->name, .doc = p->doc, .value = p->value,
                              .minimum = isnan(p->minimum) ? -INFINITY : p->minimum,
                              .maximum = isnan(p->maximum) ? INFINITY : p->maximum};
  return true;
}

bool zs_scene_set(zs_scene *scene, const char *name, double value, zs_diag *diag)
{
  const zs_name *entry = zs_names_find(&scene->parameter_names, name, strlen(name));
  if (!entry)
    return zs_fail_reference(NULL, "parameter", name, &scene->parameter_names, diag);
  zs_scene_parameter_state *parameter = &scene->parameters.items[entry->value];
  char seen[ZS_NUMBER_SIZE];
  if (!isfinite(value))
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL, "%s = %s is not a finite number", name,
                   zs_number_format(seen, value));
  if (!check_range(parameter, value, NULL, ZS_ERROR_ARGUMENT, diag))
    return false;
  parameter->set = true;
  parameter->chosen = value;
  /* Other parameters follow; if one of them leaves its range, compiling says
   * so, since a later call may bring it back. */
  zs_scene_update(scene, NULL);
  return true;
}

size_t zs_scene_object_count(const zs_scene *scene)
{
  return scene->objects.count;
}

const char *zs_scene_object(const zs_scene *scene, size_t index)
{
  return index < scene->objects.count ? scene->objects.items[index].id : NULL;
}

size_t zs_scene_view_count(const zs_scene *scene)
{
  return scene->views.count;
}

bool zs_scene_view(const zs_scene *scene, size_t index, zs_view *view)
{
  if (index >= scene->views.count)
    return false;
  *view = scene->views.items[index].view;
  return true;
}
