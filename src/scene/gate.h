/* A sink between the reader and the caller's: what is met again and again in
 * repeated or shared parts of a scene is reported once. */
#ifndef ZS_GATE_H
#define ZS_GATE_H

#include "base/arena.h"
#include "base/diagnostic.h"
#include "base/names.h"

enum { ZS_GATE_MAXIMUM = 50 }; /* errors shown in one run */

/* Warnings that a scene has given; they are not repeated by later runs. */
typedef struct zs_warned {
  zs_arena arena;
  zs_names names;
} zs_warned;

typedef struct zs_gate {
  zs_diag diag; /* report to this one; counts repetitions too */
  zs_diag *outer;
  zs_warned *warned;
  zs_arena arena;
  zs_names errors; /* reported in this run */
  unsigned shown;
} zs_gate;

/* The gate must stay where it is until it is closed.  `outer` may be NULL. */
void zs_gate_open(zs_gate *gate, zs_diag *outer, zs_warned *warned);

/* Returns true when there was no error. */
bool zs_gate_close(zs_gate *gate);

#endif
