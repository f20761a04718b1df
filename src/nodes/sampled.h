/* What nodes whose f is interpolated between samples have in common. */
#ifndef ZS_NODES_SAMPLED_H
#define ZS_NODES_SAMPLED_H

#include "nodes/common.h"
#include "samples/voxels.h"

/* Choices of the attributes `interpolation` and `outside`. */
extern const char *const zs_sampled_interpolations[], *const zs_sampled_outsides[];
enum { ZS_SAMPLED_LINEAR, ZS_SAMPLED_CUBIC };
enum { ZS_SAMPLED_EMPTY, ZS_SAMPLED_EXTEND };

#define ZS_SAMPLED_ATTRIBUTES(struct_) \
  ZS_SELECT(struct_, interpolation, "interpolation", "linear", zs_sampled_interpolations, \
            "between the samples: `linear`, or `cubic`, smoother and slower, by splines through " \
            "the samples"), \
  ZS_SELECT(struct_, outside, "outside", "empty", zs_sampled_outsides, \
            "beyond the outer faces of the outermost voxels: `empty`, where the solid ends, or " \
            "`extend`, as at the nearest sample")

/* Samples that fields and the scene's cache share, and where they lie: sample
 * (i, j, k) at `matrix` (3 x 4) applied to (i, j, k). */
typedef struct zs_sampled zs_sampled;
extern const struct zs_cache_type zs_sampled_type;

/* Takes over the voxels, also when it fails; NULL when memory is out. */
zs_sampled *zs_sampled_new(zs_voxels *voxels, const uint32_t samples[3], const double matrix[12]);
void zs_sampled_unref(void *sampled);

/* f at coordinates; takes over the caller's reference. */
zs_value zs_sampled_emit(zs_compiler *compiler, zs_sampled *sampled, int outside,
                         const zs_coordinates *at);

#endif
