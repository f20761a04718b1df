#include "scene/gate.h"

#include <stdio.h>

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

static void pass(zs_diag *outer, const zs_diagnostic *d)
{
  if (outer->report)
    outer->report(outer->context, d);
}

static void report(void *context, const zs_diagnostic *d)
{
  zs_gate *gate = context;
  zs_diag *outer = gate->outer;
  bool warning = d->severity == ZS_WARNING;
  if (!outer || !(warning ? is_new(&gate->warned->names, &gate->warned->arena, d)
                          : is_new(&gate->errors, &gate->arena, d)))
    return;
  if (warning)
    outer->warnings++;
  if (d->severity != ZS_ERROR) {
    pass(outer, d);
    return;
  }
  if (!outer->errors)
    outer->status = d->code;
  outer->errors++;
  if (gate->shown < ZS_GATE_MAXIMUM)
    pass(outer, d);
  gate->shown++;
}

void zs_gate_open(zs_gate *gate, zs_diag *outer, zs_warned *warned)
{
  *gate = (zs_gate){.outer = outer, .warned = warned};
  gate->diag = (zs_diag){.report = report, .context = gate};
}

bool zs_gate_close(zs_gate *gate)
{
  if (gate->shown > ZS_GATE_MAXIMUM)
    zs_report(gate->outer, ZS_NOTE, ZS_OK, NULL, NULL,
              "%u more errors; the first %d are shown", gate->shown - ZS_GATE_MAXIMUM,
              ZS_GATE_MAXIMUM);
  zs_arena_free(&gate->arena);
  return gate->diag.errors == 0;
}
