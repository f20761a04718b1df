/* OpenBLAS, where it is the LAPACK at hand, starts a thread for every processor when it is loaded.
 * These wait by yielding for some time, a tenth of a second where processors are virtual, in the way
 * of ours. */
#ifndef CLI_BLAS_H
#define CLI_BLAS_H

#if defined __GNUC__
extern int blas_thread_shutdown_(void) __attribute__((weak));
#endif

/* Stop them: they start again when a matrix is large enough for them.  For programs, not for the
 * library: threads of its host's are not its own. */
static inline void cli_blas_stop_threads(void)
{
#if defined __GNUC__
  if (blas_thread_shutdown_)
    blas_thread_shutdown_();
#endif
}

#endif
