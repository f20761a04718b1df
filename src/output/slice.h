/* Inside the slicers: a plane sampled at the centres of a picture's pixels. */
#ifndef ZS_SLICE_H
#define ZS_SLICE_H

#include "output/drawing.h"
#include "output/job.h"

/* Where the pixels of the picture are.  Cells (i, j) count from the box's low
 * corner along the two axes of the plane; the picture shows them turned. */
typedef struct zs_slice_plane {
  int axis, right, up; /* of space */
  bool mirrored;       /* the picture's right is the axis' low end */
  double at, pixel;
  double lo[2];        /* corner of cell (0, 0) */
  uint32_t count[2];   /* cells, those in the box only */
  uint32_t column, row; /* the top left pixel of those that show cells */
  uint32_t width, height;
} zs_slice_plane;

/* A slice under way. */
typedef struct zs_slicer {
  zs_slice_plane plane;
  float *values;   /* by pixel, NaN outside the box; NULL for INSIDE */
  uint8_t *pixels; /* by pixel; NULL for VALUE */
  zs_counter *evaluations; /* by thread */
} zs_slicer;

zs_slice_plane zs_slice_plane_of(const double lo[3], const double hi[3],
                                 const zs_slice_options *options);

/* Whether the options are those of a plane through the box; reports when not. */
bool zs_slice_options_check(const double lo[3], const double hi[3],
                            const zs_slice_options *options, zs_diag *diag);

/* Buffers for a quantity, to be freed each.  False when memory is out. */
bool zs_slicer_prepare(zs_slicer *slicer, zs_quantity quantity, unsigned threads);
/* How many samples are inside. */
uint64_t zs_slicer_inside(const zs_slicer *slicer);

/* Fill in the values or pixels.  False after reporting. */
bool zs_slicer_sample(zs_slicer *slicer, zs_field *field, const zs_control *control,
                      zs_diag *diag);

/* From a place in the picture (pixels from the left and the top) to space, on the plane. */
void zs_slice_place(const zs_slice_plane *plane, const double picture[2], double space[3]);
/* And back, whatever space's distance from the plane is. */
void zs_slice_picture(const zs_slice_plane *plane, const double space[3], double picture[2]);

/* What |f| of a value picture saturates at, and how far its contour lines are apart; negative
 * when memory is out. */
float zs_slice_scale(const float *values, size_t n);
float zs_slice_spacing(float scale);

/* slice_outline.c: the lines where f is `level` on a slicer's values or, if it has pixels, where
 * it is 0.  With `whole` they are closed along the edges of the box, and found between pixels
 * to what f's precision allows.  False when memory is out. */
bool zs_slice_outline(zs_drawing *drawing, const zs_slicer *slicer, zs_field *field, float level,
                      bool whole);

/* slice_correspondence.c: arrows and outlines of what becomes what, for options that ask for
 * them.  False after reporting. */
bool zs_slice_correspondences(zs_drawing *drawing, const zs_slice_plane *plane, zs_field *field,
                              const zs_control *control, zs_diag *diag);

#endif
