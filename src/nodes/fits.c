#include "nodes/fits.h"

#include "base/output.h"
#include "nodes/variational.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

/* A file is the magic text, then for each fit the numbers of `head` and its arrays,
 * then a head of zeros, then a checksum of all before it.  All are 8 bytes, the
 * lowest first; real numbers as IEEE 754 has them. */
static const char MAGIC[16] = "zeroset fits 2\n";

static const char *const methods[] = {"dense", "iterative"};
enum { METHODS = sizeof methods / sizeof *methods };

/* The sizes of a fit come first, so that a reader knows what follows. */
typedef struct head {
  uint64_t dimension, kernel, method, count, terms, point_count, key[2], bytes;
} head;
enum { HEAD = sizeof(head) / sizeof(uint64_t), SCALARS = 5 };

/* ---- Writing --------------------------------------------------------------------- */

typedef struct writer {
  FILE *stream;
  unsigned long check;
  size_t count;
} writer;

static void put(writer *w, uint64_t number)
{
  unsigned char bytes[8];
  for (int i = 0; i < 8; i++)
    bytes[i] = (unsigned char)(number >> 8 * i);
  w->check = crc32(w->check, bytes, 8);
  fwrite(bytes, 1, 8, w->stream); /* errors are found when the file is closed */
}

static void put_numbers(writer *w, const double *numbers, size_t count)
{
  for (size_t i = 0; i < count; i++) {
    uint64_t bits;
    memcpy(&bits, &numbers[i], sizeof bits);
    put(w, bits);
  }
}

static uint64_t method_of(const zs_rbf *rbf)
{
  uint64_t method = 0;
  while (method + 1 < METHODS && strcmp(rbf->method, methods[method]) != 0)
    method++;
  return method;
}

static bool put_fit(void *context, void *data)
{
  writer *w = context;
  const zs_variational_fit *fit = data;
  const zs_rbf *rbf = fit->rbf;
  const head h = {rbf->dimension, rbf->radial.kernel, method_of(rbf), rbf->count, rbf->terms,
                  fit->point_count, {fit->key[0], fit->key[1]}, rbf->bytes};
  uint64_t numbers[HEAD];
  memcpy(numbers, &h, sizeof numbers);
  for (int i = 0; i < HEAD; i++)
    put(w, numbers[i]);
  const double scalars[SCALARS] = {rbf->size, rbf->radial.rate, rbf->residual, rbf->seconds,
                                   fit->separation};
  put_numbers(w, scalars, SCALARS);
  put_numbers(w, rbf->centre, rbf->dimension);
  put_numbers(w, rbf->polynomial, rbf->terms);
  put_numbers(w, rbf->centres, rbf->count * rbf->dimension);
  put_numbers(w, rbf->weights, rbf->count);
  put_numbers(w, fit->points, 3 * fit->point_count);
  w->count++;
  return true;
}

bool zs_fits_write(const zs_cache *cache, const char *path, size_t *count, zs_diag *diag)
{
  zs_output output;
  if (!zs_output_open(&output, path, diag))
    return false;
  writer w = {.stream = output.stream, .check = crc32(0, NULL, 0)};
  fwrite(MAGIC, 1, sizeof MAGIC, w.stream);
  zs_cache_each(cache, &zs_variational_fit_type, put_fit, &w);
  for (int i = 0; i < HEAD; i++)
    put(&w, 0);
  put(&w, w.check);
  if (count)
    *count = w.count;
  return zs_output_commit(&output, diag);
}

/* ---- Reading --------------------------------------------------------------------- */

typedef struct reader {
  FILE *stream;
  const char *path;
  zs_diag *diag;
  unsigned long check;
  bool ended; /* too early */
} reader;

static bool fail(const reader *r, const char *problem)
{
  return zs_fail(r->diag, ZS_ERROR_SYNTAX, r->path, "%s; make it anew with zeroset fit", problem);
}

static uint64_t get(reader *r)
{
  unsigned char bytes[8] = {0};
  uint64_t number = 0;
  r->ended = r->ended || fread(bytes, 1, 8, r->stream) != 8;
  for (int i = 0; i < 8; i++)
    number |= (uint64_t)bytes[i] << 8 * i;
  r->check = crc32(r->check, bytes, 8);
  return number;
}

static void get_numbers(reader *r, double *numbers, size_t count)
{
  for (size_t i = 0; i < count && !r->ended; i++) {
    const uint64_t bits = get(r);
    memcpy(&numbers[i], &bits, sizeof bits);
  }
}

/* Numbers in a new array, which grows as they come: a damaged count is no reason
 * to ask for all of memory.  NULL when that is out, or at the end of the file. */
static double *get_array(reader *r, size_t count)
{
  enum { STEP = 1 << 16 };
  double *array = NULL;
  for (size_t done = 0; done < count || !array;) {
    const size_t step = count - done < STEP ? count - done : STEP;
    double *larger = realloc(array, (done + step + 1) * sizeof *larger);
    if (!larger || r->ended) {
      free(larger ? larger : array);
      return NULL;
    }
    array = larger;
    get_numbers(r, array + done, step);
    done += step;
  }
  return array;
}

static bool head_is_good(const head *h)
{
  double terms[ZS_RBF_MAXIMUM_TERMS];
  const double origin[ZS_RBF_MAXIMUM_DIMENSION] = {0};
  if (h->dimension < 2 || h->dimension > ZS_RBF_MAXIMUM_DIMENSION ||
      h->kernel >= ZS_RBF_KERNEL_COUNT || h->method >= METHODS || h->count == 0 ||
      h->count > ZS_RBF_MAXIMUM_COUNT || h->point_count > ZS_RBF_MAXIMUM_COUNT)
    return false;
  const unsigned dimension = (unsigned)h->dimension;
  return h->terms == zs_rbf_monomials(dimension, 1, origin, terms) ||
         h->terms == zs_rbf_monomials(dimension, 2, origin, terms);
}

static bool all_finite(const double *numbers, size_t count)
{
  for (size_t i = 0; i < count; i++)
    if (!isfinite(numbers[i]))
      return false;
  return true;
}

static bool fit_is_good(const zs_variational_fit *fit)
{
  const zs_rbf *rbf = fit->rbf;
  const bool gaussian = rbf->radial.kernel == ZS_RBF_GAUSSIAN;
  return rbf->size > 0 && isfinite(rbf->size) && isfinite(fit->separation) &&
         isfinite(rbf->radial.rate) && (gaussian ? rbf->radial.rate > 0 : rbf->radial.rate == 0) &&
         all_finite(rbf->centre, rbf->dimension) && all_finite(rbf->polynomial, rbf->terms) &&
         all_finite(rbf->centres, rbf->count * rbf->dimension) &&
         all_finite(rbf->weights, rbf->count) && all_finite(fit->points, 3 * fit->point_count);
}

static void fill(reader *r, zs_variational_fit *fit, const head *h)
{
  zs_rbf *rbf = fit->rbf;
  double scalars[SCALARS] = {0};
  rbf->dimension = (unsigned)h->dimension;
  rbf->radial.kernel = (zs_rbf_kernel)h->kernel;
  rbf->method = methods[h->method];
  rbf->count = h->count;
  rbf->terms = (unsigned)h->terms;
  rbf->bytes = h->bytes;
  memcpy(fit->key, h->key, sizeof fit->key);
  fit->point_count = h->point_count;
  get_numbers(r, scalars, SCALARS);
  rbf->size = scalars[0];
  rbf->radial.rate = scalars[1];
  rbf->residual = scalars[2];
  rbf->seconds = scalars[3];
  fit->separation = scalars[4];
  get_numbers(r, rbf->centre, rbf->dimension);
  get_numbers(r, rbf->polynomial, rbf->terms);
  rbf->centres = get_array(r, rbf->count * rbf->dimension);
  rbf->weights = get_array(r, rbf->count);
  fit->points = get_array(r, 3 * fit->point_count);
}

/* A fit with one reference, or NULL after reporting. */
static zs_variational_fit *get_fit(reader *r, const head *h)
{
  zs_variational_fit *fit = calloc(1, sizeof *fit);
  zs_rbf *rbf = calloc(1, sizeof *rbf);
  if (!fit || !rbf) {
    free(fit);
    free(rbf);
    zs_fail_memory(r->diag);
    return NULL;
  }
  atomic_init(&fit->references, 1);
  fit->rbf = rbf;
  fill(r, fit, h);
  const bool memory = rbf->centres && rbf->weights && fit->points;
  if (!r->ended && memory && fit_is_good(fit))
    return fit;
  if (r->ended)
    fail(r, "the file of fits ends too early");
  else if (!memory)
    zs_fail_memory(r->diag);
  else
    fail(r, "the file of fits is damaged");
  zs_variational_fit_unref(fit);
  return NULL;
}

/* Read fits until the head of zeros. */
static bool get_fits(reader *r, zs_cache *cache)
{
  for (;;) {
    uint64_t numbers[HEAD], any = 0;
    head h;
    for (int i = 0; i < HEAD; i++)
      any |= numbers[i] = get(r);
    memcpy(&h, numbers, sizeof h);
    if (r->ended)
      return fail(r, "the file of fits ends too early");
    if (!any)
      break;
    if (!head_is_good(&h))
      return fail(r, "the file of fits is damaged");
    zs_variational_fit *fit = get_fit(r, &h);
    if (!fit)
      return false;
    const bool kept = zs_cache_add(cache, fit->key, &zs_variational_fit_type, fit);
    zs_variational_fit_unref(fit);
    if (!kept)
      return zs_fail_memory(r->diag);
  }
  const unsigned long check = r->check;
  const bool whole = get(r) == check && !r->ended;
  if (!whole || fgetc(r->stream) != EOF)
    return fail(r, "the file of fits is damaged");
  return true;
}

bool zs_fits_read(zs_cache *cache, const char *path, zs_diag *diag)
{
  char magic[sizeof MAGIC];
  reader r = {.path = path, .diag = diag, .check = crc32(0, NULL, 0), .stream = fopen(path, "rb")};
  if (!r.stream)
    return zs_fail(diag, ZS_ERROR_IO, path, "cannot be opened: %s", strerror(errno));
  bool done = fread(magic, 1, sizeof magic, r.stream) == sizeof magic &&
              memcmp(magic, MAGIC, sizeof magic) == 0;
  done = done ? get_fits(&r, cache) : fail(&r, "this is not a file of fits of this program");
  fclose(r.stream);
  return done;
}
