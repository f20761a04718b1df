#include "scene/gate.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KEY_SIZE = 512 };

static size_t make_key(char key[KEY_SIZE], const zs_diagnostic *d)
{
  int length = snprintf(key, KEY_SIZE, "%u:%u:%s:%s:%s", d->line, d->column, d->message,
                        d->file ? d->file : "", d->attribute ? d->attribute : "");
  return length < KEY_SIZE ? (size_t)length : KEY_SIZE - 1;
}

/* Whether a diagnostic is new; remembers it.  Out of memory it is new: better
 * told twice than not at all. */
static bool is_new(zs_names *names, zs_arena *arena, const zs_diagnostic *d)
{
  char key[KEY_SIZE];
  size_t length = make_key(key, d);
  if (zs_names_find(names, key, length))
    return false;
  const char *copy = zs_arena_string(arena, key, length);
  if (copy)
    zs_names_add(names, arena, copy, length, 0);
  return true;
}

/* Number of a file in the order of their first diagnostics. */
static unsigned file_number(zs_gate *gate, const char *file)
{
  const char *name = file ? file : "";
  const zs_name *known = zs_names_find(&gate->files, name, strlen(name));
  if (known)
    return known->value;
  unsigned number = gate->files.count;
  const char *copy = zs_arena_string(&gate->arena, name, strlen(name));
  if (copy)
    zs_names_add(&gate->files, &gate->arena, copy, strlen(name), number);
  return number;
}

/* Copy a string that may be NULL. */
static const char *keep(zs_gate *gate, const char *text, bool *good)
{
  const char *copy = text ? zs_arena_string(&gate->arena, text, strlen(text)) : NULL;
  *good = *good && (copy || !text);
  return copy;
}

/* Remember a diagnostic; false when memory is out. */
static bool add(zs_gate *gate, const zs_diagnostic *d)
{
  zs_gate_entry *entry = ZS_ARENA_NEW(&gate->arena, zs_gate_entry, 1);
  if (!entry)
    return false;
  bool good = true;
  entry->diagnostic = *d;
  entry->diagnostic.file = keep(gate, d->file, &good);
  entry->diagnostic.element = keep(gate, d->element, &good);
  entry->diagnostic.attribute = keep(gate, d->attribute, &good);
  entry->diagnostic.message = keep(gate, d->message, &good);
  entry->diagnostic.hint = keep(gate, d->hint, &good);
  entry->diagnostic.source_line = keep(gate, d->source_line, &good);
  if (!good)
    return false;
  entry->file = file_number(gate, d->file);
  entry->sequence = gate->count++;
  entry->next = gate->entries;
  gate->entries = entry;
  return true;
}

/* Hand one diagnostic to the caller's sink. */
static void pass(zs_diag *outer, const zs_diagnostic *d, bool shown)
{
  if (d->severity == ZS_ERROR) {
    if (!outer->errors)
      outer->status = d->code;
    outer->errors++;
  } else if (d->severity == ZS_WARNING) {
    outer->warnings++;
  }
  if (shown && outer->report)
    outer->report(outer->context, d);
}

static void report(void *context, const zs_diagnostic *d)
{
  zs_gate *gate = context;
  if (!gate->outer)
    return;
  bool fresh = d->severity == ZS_WARNING
                 ? is_new(&gate->warned->names, &gate->warned->arena, d)
                 : is_new(&gate->errors, &gate->arena, d);
  if (!fresh)
    return;
  if (gate->count == ZS_GATE_KEPT)
    gate->dropped += d->severity == ZS_ERROR;
  else if (!add(gate, d))
    pass(gate->outer, d, true);
}

void zs_gate_open(zs_gate *gate, zs_diag *outer, zs_warned *warned)
{
  *gate = (zs_gate){.outer = outer, .warned = warned};
  gate->diag = (zs_diag){.report = report, .context = gate};
}

static int compare(const void *left, const void *right)
{
  const zs_gate_entry *a = *(zs_gate_entry *const *)left, *b = *(zs_gate_entry *const *)right;
  if (a->file != b->file)
    return a->file < b->file ? -1 : 1;
  const zs_diagnostic *c = &a->diagnostic, *d = &b->diagnostic;
  if (c->line != d->line)
    return c->line < d->line ? -1 : 1;
  if (c->column != d->column)
    return c->column < d->column ? -1 : 1;
  return a->sequence < b->sequence ? -1 : 1;
}

/* Pass the entries on in the order of the text. */
static void pass_all(zs_gate *gate, zs_gate_entry **sorted)
{
  unsigned errors = 0, i = gate->count;
  for (zs_gate_entry *entry = gate->entries; entry; entry = entry->next)
    sorted[--i] = entry;
  qsort(sorted, gate->count, sizeof(zs_gate_entry *), compare);
  for (i = 0; i < gate->count; i++) {
    const zs_diagnostic *d = &sorted[i]->diagnostic;
    errors += d->severity == ZS_ERROR;
    pass(gate->outer, d, errors <= ZS_GATE_SHOWN);
  }
  errors += gate->dropped;
  gate->outer->errors += gate->dropped;
  if (errors > ZS_GATE_SHOWN)
    zs_report(gate->outer, ZS_NOTE, ZS_OK, NULL, NULL, "%u more errors are not shown",
              errors - ZS_GATE_SHOWN);
}

bool zs_gate_close(zs_gate *gate)
{
  if (gate->count) {
    zs_gate_entry **sorted = ZS_ARENA_NEW(&gate->arena, zs_gate_entry *, gate->count);
    if (sorted)
      pass_all(gate, sorted);
    else
      zs_fail_memory(gate->outer);
  }
  zs_arena_free(&gate->arena);
  return gate->diag.errors == 0;
}
