/* A sink between the reader and the caller's.  What is met again and again in
 * repeated or shared parts of a scene is reported once, and all is reported in
 * the order of the text. */
#ifndef ZS_GATE_H
#define ZS_GATE_H

#include "base/arena.h"
#include "base/diagnostic.h"
#include "base/names.h"

enum {
  ZS_GATE_SHOWN = 50,  /* errors passed on in one run */
  ZS_GATE_KEPT = 10000 /* diagnostics remembered; later ones are only counted */
};

/* Warnings that a scene has given; they are not repeated by later runs. */
typedef struct zs_warned {
  zs_arena arena;
  zs_names names;
} zs_warned;

typedef struct zs_gate_entry {
  zs_diagnostic diagnostic; /* with copies of its strings */
  unsigned file, sequence;  /* order in which files, diagnostics were met */
  struct zs_gate_entry *next;
} zs_gate_entry;

typedef struct zs_gate {
  zs_diag diag; /* report to this one; counts repetitions too */
  zs_diag *outer;
  zs_warned *warned;
  zs_arena arena;
  zs_names errors, files; /* met in this run */
  zs_gate_entry *entries; /* the newest first */
  unsigned count, dropped;
} zs_gate;

/* The gate must stay where it is until it is closed.  `outer` may be NULL. */
void zs_gate_open(zs_gate *gate, zs_diag *outer, zs_warned *warned);

/* Pass everything on.  Returns true when there was no error. */
bool zs_gate_close(zs_gate *gate);

#endif
