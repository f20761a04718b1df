/* A picture as a plane shape, by the distance to its outline. */
#include "nodes/image.h"

#include "samples/picture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rows and columns of black pixels around a picture that distances are found at too: f is
 * then negative along the whole edge. */
enum { MARGIN = 2 };

const char *const zs_image_directions[] = {"up", "down", NULL};
const char *const zs_image_pixels[] = {"file", NULL};

struct image {
  const char *src;
  double pixel, level, origin[3];
  int page, y;
};

static const zs_attribute attributes[] = {
  {.name = "src", .type = ZS_FILE, .offset = offsetof(struct image, src), .unit = "",
   .doc = "a PNG, PGM or TIFF file; white is inside"},
  {.name = "page", .type = ZS_INTEGER, .offset = offsetof(struct image, page), .initial = "1",
   .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 1, .maximum = 1e6,
   .doc = "which page of a TIFF file"},
  ZS_IMAGE_PIXEL(struct image, ""),
  ZS_IMAGE_LEVEL(struct image),
  ZS_POINT(struct image, origin, "origin", "0 0 0",
           "where the picture's corner is that has the least x and y; z is left out"),
  ZS_IMAGE_Y(struct image),
};

bool zs_image_side(double *side, double given, const double in_file[2], const zs_node *node,
                   zs_diag *diag)
{
  *side = isnan(given) ? in_file[0] : given;
  if (!isnan(given))
    return true;
  if (!(in_file[0] > 0 && in_file[1] > 0 && isfinite(in_file[0] + in_file[1])))
    return zs_node_fail(node, diag, "pixel",
                        "the file does not say how large pixels are; expected a length");
  if (!(fabs(in_file[0] - in_file[1]) <= 1e-3 * in_file[0]))
    return zs_node_fail(node, diag, "pixel", "pixels have the sides %g and %g in the file; "
                        "expected square ones", in_file[0], in_file[1]);
  return true;
}

/* The distances of a picture as a raster without heights, in pixels, and a pixel's side; NULL
 * after reporting. */
static zs_raster *measured(const zs_node *node, double *side, zs_diag *diag)
{
  const struct image *p = node->parameters;
  zs_gray gray;
  if (!zs_gray_read(&gray, p->src, (size_t)p->page, diag))
    return NULL;
  if (!zs_image_side(side, p->pixel, gray.side, node, diag)) {
    zs_gray_clear(&gray);
    return NULL;
  }
  const uint32_t count[3] = {gray.width + 2 * MARGIN, gray.height + 2 * MARGIN, 1};
  const float height = 0;
  zs_raster *raster = zs_raster_new(count, &height);
  float *distance = malloc((size_t)count[0] * count[1] * sizeof *distance);
  const zs_picture picture = {gray.width, gray.height, gray.pixels, (float)p->level};
  const zs_picture_result result =
    raster && distance ? zs_picture_distance(&picture, MARGIN, distance) : ZS_PICTURE_MEMORY;
  bool done = result == ZS_PICTURE_DONE;
  if (done) {
    for (size_t y = 0; y < count[1]; y++)
      for (size_t x = 0; x < count[0]; x++)
        *zs_raster_sample(raster, x, y, 0) = distance[y * count[0] + x];
    done = zs_raster_finish(raster);
  }
  if (result == ZS_PICTURE_EMPTY)
    zs_node_fail(node, diag, "src", "no pixel of the picture is as bright as the level, %g",
                 p->level);
  else if (!done)
    zs_fail_memory(diag);
  free(distance);
  zs_gray_clear(&gray);
  if (!done) {
    zs_raster_free(raster);
    raster = NULL;
  }
  return raster;
}

void zs_image_matrix(const zs_image_place *place, double matrix[12])
{
  const double s = 1 / place->pixel, *o = place->origin;
  const double down = place->down ? s : -s, from = place->down ? -0.5 : place->rows - 0.5;
  const double rows[12] = {s, 0, 0, -0.5 - o[0] * s, 0, down, 0, from - o[1] * down,
                           0, 0, s, -o[2] * s};
  memcpy(matrix, rows, sizeof rows);
}

zs_value zs_raster_emit(zs_compiler *compiler, const zs_raster *raster, const zs_coordinates *at)
{
  zs_value in[3];
  for (int k = 0; k < 3; k++)
    in[k] = k < 2 || raster->count[2] > 1 ? zs_emit_coordinate(compiler, at, k)
                                          : zs_emit_constant(compiler, 0);
  return zs_emit_operation(compiler, &zs_raster_operation, raster, in[0], in[1], in[2]);
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct image *p = node->parameters;
  double pixel;
  zs_raster *raster = measured(node, &pixel, zs_compiler_diag(compiler));
  if (!raster)
    return zs_emit_constant(compiler, 0);
  if (!zs_compiler_keep(compiler, raster, zs_raster_free))
    return zs_emit_constant(compiler, 0);
  const zs_image_place place = {pixel, raster->count[1] - 2 * MARGIN,
                                {p->origin[0], p->origin[1], 0}, p->y == ZS_IMAGE_Y_DOWN};
  double matrix[12];
  zs_image_matrix(&place, matrix);
  matrix[3] += MARGIN;
  matrix[7] += MARGIN;
  const zs_coordinates own = zs_coordinates_affine(at, matrix);
  return zs_emit_scaled(compiler, zs_raster_emit(compiler, raster, &own), pixel);
}

const zs_kind zs_kind_image = {
  .name = "image",
  .family = ZS_FAMILY_SHAPE,
  .summary = "the outline in a grey picture",
  .doc = "f is the distance to where brightness passes through the level between the centres of "
         "pixels, found at these centres and interpolated by cubics between them: inside are the "
         "pixels at least as bright as the level. Around the picture it is black; beyond two more "
         "pixels f falls by the distance from there.",
  .source = "Felzenszwalb, Huttenlocher, \"Distance transforms of sampled functions\" (2012)",
  .trait = "exact distance at the centres of pixels",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct image),
  .children = ZS_CHILDREN_NONE,
  .emit = emit,
};
