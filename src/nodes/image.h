/* What nodes made of pictures share. */
#ifndef ZS_NODES_IMAGE_H
#define ZS_NODES_IMAGE_H

#include "files/gray.h"
#include "nodes/common.h"
#include "samples/raster.h"

extern const char *const zs_image_directions[];
enum { ZS_IMAGE_Y_UP, ZS_IMAGE_Y_DOWN };

/* Attributes by the names that all pictures in scenes have.  `pixel` is NaN when the file is
 * to say it. */
extern const char *const zs_image_pixels[];
#define ZS_IMAGE_PIXEL(struct_, doc_) \
  {.name = "pixel", .type = ZS_NUMBER, .offset = offsetof(struct_, pixel), .initial = "1", \
   .unit = "length", .range = ZS_RANGE_POSITIVE, .choices = zs_image_pixels, \
   .doc = "side of a pixel; `file`: as the resolution in a TIFF or PNG file says, in " \
          "millimetres" doc_}
#define ZS_IMAGE_LEVEL(struct_) \
  {.name = "level", .type = ZS_NUMBER, .offset = offsetof(struct_, level), .initial = "0.5", \
   .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 0.001, .maximum = 1, \
   .doc = "brightness of the outline, where 0 is black and 1 is white"}
#define ZS_IMAGE_Y(struct_) \
  ZS_SELECT(struct_, y, "y", "up", zs_image_directions, \
            "`up`: the last row of pixels is at the origin, and y grows upwards; `down`: the " \
            "first one is, and y grows from row to row")

/* Where pictures lie. */
typedef struct zs_image_place {
  double pixel, rows; /* a pixel's side; how many rows there are */
  double origin[3];
  bool down;
} zs_image_place;

/* The map (3 x 4) from the scene to columns, rows from the top, and pixels above the origin;
 * whole numbers at the centres of pixels. */
void zs_image_matrix(const zs_image_place *place, double matrix[12]);

/* The side of a picture's pixel: as it is given, or as the file says.  False after reporting
 * that it says nothing, or that pixels are not square. */
bool zs_image_side(double *side, double given, const double in_file[2], const zs_node *node,
                   zs_diag *diag);

/* f of a raster in its own coordinates.  It lives as long as the field. */
zs_value zs_raster_emit(zs_compiler *compiler, const zs_raster *raster, const zs_coordinates *at);

#endif
