#include "rbf/poll.h"

#include "base/threads.h"

/* Only the thread that began may tell, and it takes part in every loop as number 0. */
static bool may_tell(void)
{
  return zs_thread_number() == 0;
}

static bool tell(zs_rbf_poll *poll, double part)
{
  const zs_control *control = poll->control;
  if (control && control->progress &&
      !control->progress(control->context, poll->stage,
                         poll->from + (poll->to - poll->from) * part))
    atomic_store_explicit(&poll->cancelled, true, memory_order_relaxed);
  return !atomic_load_explicit(&poll->cancelled, memory_order_relaxed);
}

bool zs_rbf_poll_begin(zs_rbf_poll *poll, size_t rounds, double from, double to)
{
  poll->from = from;
  poll->to = to;
  poll->rounds = rounds;
  atomic_store(&poll->done, 0);
  return !atomic_load(&poll->cancelled) && tell(poll, 0);
}

bool zs_rbf_poll_rounds(zs_rbf_poll *poll, size_t count)
{
  const size_t done =
    atomic_fetch_add_explicit(&poll->done, count, memory_order_relaxed) + count;
  return may_tell() ? tell(poll, (double)done / (double)poll->rounds)
                    : !atomic_load_explicit(&poll->cancelled, memory_order_relaxed);
}

bool zs_rbf_poll_fail(const zs_rbf_poll *poll, zs_diag *diag)
{
  return atomic_load(&poll->cancelled) ? zs_fail(diag, ZS_CANCELLED, NULL, "cancelled")
                                       : zs_fail_memory(diag);
}
