/* From samples of a surface to constraints of a variational fit. */
#ifndef ZS_RBF_CONSTRAINTS_H
#define ZS_RBF_CONSTRAINTS_H

#include "base/diagnostic.h"

/* A point where f has a known value, perhaps with the direction out of the
 * solid, of any length; 0 0 0: unknown, and then perhaps to be estimated from
 * its neighbours (rbf/normals.h). */
typedef struct zs_rbf_sample {
  double position[3], normal[3], value;
  bool estimate;
} zs_rbf_sample;

/* A growing list of samples. */
typedef struct zs_rbf_samples {
  zs_rbf_sample *samples;
  size_t count, capacity;
} zs_rbf_samples;

/* Append a sample; false after reporting when memory is out. */
bool zs_rbf_samples_add(zs_rbf_samples *list, const zs_rbf_sample *sample, zs_diag *diag);
void zs_rbf_samples_clear(zs_rbf_samples *list);

/* Twice the largest distance from the samples' mean: about the diagonal of their
 * box, but however they are turned the same. */
double zs_rbf_samples_size(const zs_rbf_samples *list);

/* Copy the samples from `first` on that lie on the surface and have a normal, 3 numbers each, the
 * normals at unit length; returns how many there are. */
size_t zs_rbf_samples_oriented(const zs_rbf_samples *list, size_t first, double *positions,
                               double *normals);

/* Whether there are any, not more than can be fitted, and of a size that can be evaluated; reports
 * when not. */
bool zs_rbf_samples_check(const zs_rbf_samples *samples, const zs_place *place, zs_diag *diag);

/* How samples become constraints. */
typedef struct zs_rbf_rules {
  unsigned dimension; /* 2 or 3; 2: z is 0 in all samples */
  double offset;      /* most, of constraints beside the surface; NaN: automatic */
  bool both;          /* on both sides of the surface, or inside only */
} zs_rbf_rules;

/* Positions (`dimension` each) and values to fit. */
typedef struct zs_rbf_constraints {
  size_t count;
  double *positions, *values;
} zs_rbf_constraints;

/* The constraints of some samples: each sample itself, and where its normal is
 * known one more on the inner side, valued `value` + distance, and with `both`
 * one on the outer side, valued `value` - distance, so that f falls by one per
 * unit of length along the normal.
 *
 * The distance is the offset, automatically a hundredth of the samples' size,
 * but at most half the radius of the largest ball that
 * touches the sample on that side and holds no other sample of the same value:
 * a ball's centre is where distance stops being smooth (the medial axis).
 * Where next to nothing is left, the constraint is left out.
 *
 * False after reporting at `place`: no samples, more than can be fitted, or
 * values that are all the same, which do not say where the inside is. */
bool zs_rbf_constraints_build(zs_rbf_constraints *constraints, const zs_rbf_samples *samples,
                              const zs_rbf_rules *rules, const zs_control *control,
                              const zs_place *place, zs_diag *diag);
void zs_rbf_constraints_clear(zs_rbf_constraints *constraints);

#endif
