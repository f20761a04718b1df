/* What OpenMP knows of threads, where there is OpenMP: a build for the thread sanitizer is
 * without, and every loop then runs on the thread that meets it. */
#ifndef ZS_BASE_THREADS_H
#define ZS_BASE_THREADS_H

#if defined _OPENMP
#include <omp.h>
#endif

/* Number of the calling thread within a parallel loop, 0 being the one that met the loop. */
static inline unsigned zs_thread_number(void)
{
#if defined _OPENMP
  return (unsigned)omp_get_thread_num();
#else
  return 0;
#endif
}

/* Threads that run at once. */
static inline unsigned zs_processors(void)
{
#if defined _OPENMP
  const int processors = omp_get_num_procs();
  return processors > 0 ? (unsigned)processors : 1;
#else
  return 1;
#endif
}

#endif
