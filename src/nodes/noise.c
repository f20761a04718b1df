#include "nodes/common.h"
#include "nodes/extent.h"

#include <math.h>

struct noise {
  double amplitude, frequency, phase, gain;
  int octaves;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct noise, amplitude, "amplitude", "0.1", ZS_RANGE_ANY,
            "the most that the noise adds and takes away"),
  {.name = "frequency",
   .type = ZS_NUMBER,
   .offset = offsetof(struct noise, frequency),
   .initial = "1",
   .unit = "1 per length",
   .range = ZS_RANGE_POSITIVE,
   .doc = "waves per unit of length"},
  ZS_ANGLE(struct noise, phase, "phase", "80",
           "how far the waves along one axis shift those along another: 0 is regular, and other "
           "numbers give other patterns"),
  {.name = "octaves",
   .type = ZS_INTEGER,
   .offset = offsetof(struct noise, octaves),
   .initial = "1",
   .unit = "1",
   .range = ZS_RANGE_BETWEEN,
   .minimum = 1,
   .maximum = 12,
   .doc = "how many times finer noise is added, of twice the frequency each time"},
  {.name = "gain",
   .type = ZS_NUMBER,
   .offset = offsetof(struct noise, gain),
   .initial = "0.5",
   .unit = "1",
   .range = ZS_RANGE_BETWEEN,
   .minimum = 0,
   .maximum = 1,
   .doc = "amplitude of every octave by that of the one before"},
};

/* The waves along x, shifted by those along z. */
#define WAVES(X, Z) \
  "(sin(k * " X ") + sin(k * " X " / 1.35 + rad(phase) * sin(k * " Z ")) / 1.17)"
static const char noise[] = "let k = 2 * pi * frequency; " WAVES("x", "z") " * " WAVES("y", "x")
                            " * " WAVES("z", "y") " / (1 + 1 / 1.17)^3";

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct noise *p = node->parameters;
  double all = 0, part = 1, scale = 1;
  for (int i = 0; i < p->octaves; i++, part *= p->gain)
    all += part;
  zs_value f = zs_children_emit(compiler, node, at);
  part = p->amplitude / all;
  for (int i = 0; i < p->octaves && part != 0; i++, part *= p->gain, scale *= 2) {
    const double finer[12] = {scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0};
    const zs_coordinates own = zs_coordinates_affine(at, finer);
    f = zs_emit(compiler, ZS_FUNCTION_ADD, f,
                zs_emit_scaled(compiler, zs_formula_emit(compiler, node, noise, &own, 0, 0), part),
                0);
  }
  return f;
}

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct noise *p = node->parameters;
  return zs_box_grown(children[0], fabs(p->amplitude));
}

const zs_kind zs_kind_noise = {
  .name = "noise",
  .family = ZS_FAMILY_FUNCTION_MAP,
  .summary = "the child with a surface roughened by waves that hardly repeat",
  .doc = "To f is added amplitude S(x, z) S(y, x) S(z, y) / (1 + 1/1.17)^3, where S(x, z) = "
         "sin(k x) + sin(k x/1.35 + phase sin(k z)) / 1.17 and k = 2 pi frequency; with octaves, their "
         "sum, so weighted that it stays within the amplitude.",
  .source = "G. Gardner, Simulation of natural scenes using textured quadric surfaces, 1984",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct noise),
  .children = ZS_CHILDREN_ONE,
  .emit = emit,
  .box = box,
};
