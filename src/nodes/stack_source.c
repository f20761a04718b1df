#include "nodes/stack_source.h"

#include "base/key.h"
#include "scene/tree.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void *ref(void *source)
{
  atomic_fetch_add_explicit(&((zs_stack_source *)source)->references, 1, memory_order_relaxed);
  return source;
}

void zs_stack_source_unref(void *source)
{
  zs_stack_source *s = source;
  if (!s || atomic_fetch_sub_explicit(&s->references, 1, memory_order_acq_rel) > 1)
    return;
  zs_volume_clear(&s->volume);
  free(s->white);
  free(s);
}

static const zs_cache_type type = {ref, zs_stack_source_unref};

/* ---- Pictures ---------------------------------------------------------------------------- */

static double number_of(const zs_gray *gray, size_t i)
{
  return (double)gray->pixels[i] * gray->white;
}

/* The narrowest type that holds the numbers of a picture. */
static zs_voxel_type type_of(const zs_gray *gray)
{
  zs_voxel_type narrowest = ZS_VOXEL_U8;
  for (size_t i = 0; i < (size_t)gray->width * gray->height; i++) {
    const double number = number_of(gray, i), whole = rint(number);
    /* Brightness in single precision gives numbers back to a 2^24th. */
    if (!(whole >= 0 && whole <= UINT16_MAX && fabs(number - whole) <= 0x1p-23 * whole))
      return ZS_VOXEL_F32;
    if (whole > UINT8_MAX)
      narrowest = ZS_VOXEL_U16;
  }
  return narrowest;
}

static int rank(zs_voxel_type type)
{
  return type == ZS_VOXEL_U8 ? 0 : type == ZS_VOXEL_U16 ? 1 : 2;
}

/* Give the slices room for one more, whose numbers are of another type perhaps. */
static bool grow(zs_volume *v, zs_voxel_type wanted)
{
  const size_t area = (size_t)v->size[0] * v->size[1], before = area * v->size[2];
  const zs_voxel_type from = v->type, to = before && rank(from) > rank(wanted) ? from : wanted;
  void *grown = realloc(v->numbers, (before + area) * zs_voxel_size(to));
  if (!grown)
    return false;
  v->numbers = grown;
  v->type = to;
  for (size_t i = before; from != to && i-- > 0;) { /* from the end: they widen in place */
    double number;
    v->type = from;
    zs_volume_values(v, i, 1, &number);
    v->type = to;
    zs_volume_store(v, i, number);
  }
  return true;
}

static bool add_picture(zs_stack_source *s, const zs_gray *gray, zs_diag *diag)
{
  zs_volume *v = &s->volume;
  uint32_t *white = realloc(s->white, (v->size[2] + 1) * sizeof *white);
  s->white = white ? white : s->white;
  v->size[0] = gray->width;
  v->size[1] = gray->height;
  if (!white || !grow(v, type_of(gray)))
    return zs_fail_memory(diag);
  const size_t area = (size_t)gray->width * gray->height, first = area * v->size[2];
  for (size_t i = 0; i < area; i++)
    zs_volume_store(v, first + i, number_of(gray, i));
  white[v->size[2]++] = gray->white;
  if (v->size[2] == 1)
    memcpy(s->side, gray->side, sizeof s->side);
  return true;
}

/* Whether a picture can be the next slice. */
static bool check_picture(const zs_stack_source *s, const zs_gray *gray, const zs_node *node,
                          const char *name, zs_diag *diag)
{
  const struct stack *p = node->parameters;
  const zs_volume *v = &s->volume;
  char page[40] = "";
  if (p->src.count == 1)
    snprintf(page, sizeof page, "page %zu of ", s->total);
  if (p->label.count && gray->colour)
    return zs_node_fail(node, diag, "label", "%s'%.80s' is in colour; expected numbers, in a grey "
                        "picture or one with a palette", page, name);
  if (v->size[2] && (v->size[0] != gray->width || v->size[1] != gray->height))
    return zs_node_fail(node, diag, "src", "%s'%.80s' has %u x %u pixels; those before have %u x "
                        "%u", page, name, gray->width, gray->height, v->size[0], v->size[1]);
  if ((double)gray->width * gray->height * (v->size[2] + 1.0) > ZS_VOLUME_MOST)
    return zs_node_fail(node, diag, "src", "there are more than %d pixels in all", ZS_VOLUME_MOST);
  return true;
}

/* The pictures of one file. */
static bool read_file(zs_stack_source *s, const zs_node *node, const char *path, zs_diag *diag)
{
  const struct stack *p = node->parameters;
  const char *name = zs_stack_file_name(path);
  zs_gray_file *file =
    zs_gray_open(path, p->label.count ? ZS_GRAY_NUMBERS : ZS_GRAY_BRIGHTNESS, diag);
  zs_gray_page page = file ? zs_gray_next(file) : ZS_GRAY_FAILED;
  for (size_t pages = 1; page == ZS_GRAY_PAGE; pages++) {
    zs_gray gray;
    if (pages > 1 && p->src.count > 1) {
      zs_node_fail(node, diag, "src", "'%.80s' has several pages; expected one file of them, or "
                   "one page in each file", name);
      page = ZS_GRAY_FAILED;
      break;
    }
    const bool wanted = s->total++ % (size_t)p->every == 0;
    bool done = !wanted || zs_gray_load(file, &gray);
    if (wanted && done) {
      done = check_picture(s, &gray, node, name, diag) && add_picture(s, &gray, diag);
      zs_gray_clear(&gray);
    }
    page = done ? zs_gray_next(file) : ZS_GRAY_FAILED;
  }
  zs_gray_close(file);
  return page == ZS_GRAY_END;
}

static bool read_pictures(zs_stack_source *s, const zs_node *node, zs_diag *diag)
{
  const struct stack *p = node->parameters;
  s->volume = (zs_volume){.slope = 1};
  for (size_t i = 0; i < p->src.count; i++)
    if (!read_file(s, node, p->src.paths[i], diag))
      return false;
  return true;
}

/* ---- Once for all ----------------------------------------------------------------------- */

static bool key_of(const zs_node *node, uint64_t key[2])
{
  const struct stack *p = node->parameters;
  const bool volume = zs_stack_is_volume(node);
  const int reading[] = {volume, volume ? 1 : p->every, !volume && p->label.count};
  zs_key_begin(key, "slices");
  zs_key_add(key, reading, sizeof reading);
  for (size_t i = 0; i < p->src.count; i++)
    if (!zs_key_add_file(key, p->src.paths[i]))
      return false;
  return true;
}

zs_stack_source *zs_stack_source_find(zs_compiler *compiler, const zs_node *node)
{
  const struct stack *p = node->parameters;
  struct zs_cache *cache = zs_compiler_cache(compiler);
  zs_diag *diag = zs_compiler_diag(compiler);
  uint64_t key[2];
  const bool has_key = key_of(node, key);
  zs_stack_source *s = has_key ? zs_cache_find(cache, key, &type) : NULL;
  if (s)
    return s;
  s = calloc(1, sizeof *s);
  if (!s) {
    zs_fail_memory(diag);
    return NULL;
  }
  atomic_init(&s->references, 1);
  if (!(zs_stack_is_volume(node) ? zs_volume_read(&s->volume, p->src.paths[0], diag)
                                 : read_pictures(s, node, diag))) {
    zs_stack_source_unref(s);
    return NULL;
  }
  /* What cannot be remembered is only read again. */
  if (has_key && cache)
    zs_cache_add(cache, key, &type, s);
  return s;
}
