/* The progress of loops that threads share, and their cancellation. */
#ifndef ZS_RBF_POLL_H
#define ZS_RBF_POLL_H

#include "base/diagnostic.h"

#include <stdatomic.h>

typedef struct zs_rbf_poll {
  const zs_control *control; /* may be NULL */
  const char *stage;
  double from, to;    /* the part of the progress that the present loop is */
  size_t rounds;      /* of the loop */
  atomic_size_t done;
  atomic_bool cancelled;
} zs_rbf_poll;

/* Begin a loop, on the thread that began the work.  False when cancelled, now or before. */
bool zs_rbf_poll_begin(zs_rbf_poll *poll, size_t rounds, double from, double to);

/* Some more rounds are done, by any thread.  False when cancelled. */
bool zs_rbf_poll_rounds(zs_rbf_poll *poll, size_t count);

/* Report why work did not end well: it was cancelled, or memory is out.  False. */
bool zs_rbf_poll_fail(const zs_rbf_poll *poll, zs_diag *diag);

#endif
