#include "language/documents.h"

#include "scene/document.h"

#include <string.h>

char *zs_document_text(zs_document document)
{
  static void (*const writers[])(zs_text *text) = {
    [ZS_DOCUMENT_RELAX_NG] = zs_relaxng_write,
    [ZS_DOCUMENT_XSD] = zs_xsd_write,
    [ZS_DOCUMENT_NODES] = zs_manual_write,
    [ZS_DOCUMENT_SUMMARY] = zs_manual_write_summary,
  };
  if ((size_t)document >= ZS_COUNT_OF(writers))
    return NULL;
  zs_text text = {0};
  writers[document](&text);
  return zs_text_finish(&text);
}

/* The part of that name of any node, or NULL. */
static const zs_kind *find_part(const zs_kind *const *parts, const char *name)
{
  for (; parts && *parts; parts++) {
    if (strcmp((*parts)->name, name) == 0)
      return *parts;
    const zs_kind *inner = find_part((*parts)->parts, name);
    if (inner)
      return inner;
  }
  return NULL;
}

static const zs_kind *find(const char *name)
{
  const zs_kind *found = zs_kind_find(name);
  if (!found)
    found = zs_document_kind_find(name);
  for (const zs_kind *const *kind = zs_kinds; *kind && !found; kind++)
    found = find_part((*kind)->parts, name);
  return found;
}

enum { MAXIMUM_NAMES = 256 };

static bool fail_unknown(const char *name, zs_diag *diag)
{
  const char *names[MAXIMUM_NAMES];
  size_t count = 0;
  for (const zs_kind *const *kind = zs_kinds; *kind && count < MAXIMUM_NAMES; kind++)
    names[count++] = (*kind)->name;
  for (const zs_kind *const *kind = zs_document_kinds; *kind && count < MAXIMUM_NAMES; kind++)
    names[count++] = (*kind)->name;
  const char *nearest = zs_suggest(name, names, count);
  if (nearest)
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL, "no element is called '%s'; did you mean '%s'?",
                   name, nearest);
  return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL, "no element is called '%s'", name);
}

char *zs_document_node(const char *name, zs_diag *diag)
{
  const zs_kind *kind = find(name);
  if (!kind) {
    fail_unknown(name, diag);
    return NULL;
  }
  zs_text text = {0};
  zs_manual_write_kind(&text, kind, 1);
  char *section = zs_text_finish(&text);
  if (!section)
    zs_fail_memory(diag);
  return section;
}
