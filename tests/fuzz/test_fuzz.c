/* Runs the fuzzer's target over the corpus of broken scenes, over scenes that
 * are right, and over random mutations of both. */
#include "../random.h"

#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { MOST_SEEDS = 256, LARGEST = 1 << 14, MUTATIONS = 20000 };

static struct {
  uint8_t *data;
  size_t size;
} seeds[MOST_SEEDS];
static size_t seed_count;

static void add_seed(const char *path)
{
  uint8_t *data = malloc(LARGEST);
  FILE *stream = fopen(path, "rb");
  if (!stream || seed_count == MOST_SEEDS) {
    free(data);
    return;
  }
  seeds[seed_count].size = fread(data, 1, LARGEST, stream);
  seeds[seed_count++].data = data;
  fclose(stream);
}

static void add_folder(const char *top, const char *name)
{
  char path[4096];
  snprintf(path, sizeof path, "%s/%s", top, name);
  DIR *folder = opendir(path);
  for (struct dirent *entry; folder && (entry = readdir(folder)) != NULL;) {
    size_t length = strlen(entry->d_name);
    if (length < 5 || strcmp(entry->d_name + length - 4, ".xml") != 0)
      continue;
    snprintf(path, sizeof path, "%s/%s/%s", top, name, entry->d_name);
    add_seed(path);
  }
  if (folder)
    closedir(folder);
}

static int read_seeds(void **state)
{
  (void)state;
  const char *top = getenv("top_srcdir");
  add_folder(top ? top : ".", "tests/scene/broken");
  add_folder(top ? top : ".", "tests/fuzz/seeds");
  return seed_count > 50 ? 0 : -1;
}

static int free_seeds(void **state)
{
  (void)state;
  for (size_t i = 0; i < seed_count; i++)
    free(seeds[i].data);
  return 0;
}

static void test_seeds(void **state)
{
  (void)state;
  for (size_t i = 0; i < seed_count; i++)
    assert_int_equal(LLVMFuzzerTestOneInput(seeds[i].data, seeds[i].size), 0);
}

/* Change a few bytes, or replace a stretch by one of another seed. */
static size_t mutate(uint64_t *random, uint8_t *data, size_t size)
{
  static const char interesting[] = "<>/\"'={}&;: \n\t0123456789.-+*^?eE()[]!x";
  for (unsigned n = 1 + random_below(random, 4); n > 0 && size > 0; n--) {
    size_t at = random_below(random, (unsigned)size), length = 1 + random_below(random, 16);
    if (length > size - at)
      length = size - at;
    switch (random_below(random, 5)) {
    case 0: data[at] = (uint8_t)random_bits(random); break;
    case 1:
      data[at] = (uint8_t)interesting[random_below(random, sizeof interesting - 1)];
      break;
    case 2: /* leave some bytes out */
      memmove(data + at, data + at + length, size - at - length);
      size -= length;
      break;
    case 3: { /* copy some bytes from elsewhere */
      size_t from = random_below(random, (unsigned)size);
      if (length > size - from)
        length = size - from;
      memmove(data + at, data + from, length);
      break;
    }
    default: {
      size_t other = random_below(random, (unsigned)seed_count);
      size_t from = seeds[other].size ? random_below(random, (unsigned)seeds[other].size) : 0;
      if (length > seeds[other].size - from)
        length = seeds[other].size - from;
      memcpy(data + at, seeds[other].data + from, length);
    }
    }
  }
  return size;
}

static void test_mutations(void **state)
{
  (void)state;
  uint64_t random = 2024;
  for (unsigned i = 0; i < MUTATIONS; i++) {
    size_t seed = random_below(&random, (unsigned)seed_count);
    /* A buffer of just the right size shows reading beyond it. */
    uint8_t *larger = malloc(LARGEST + 32);
    memcpy(larger, seeds[seed].data, seeds[seed].size);
    size_t size = mutate(&random, larger, seeds[seed].size);
    uint8_t *data = malloc(size + 1);
    memcpy(data, larger, size);
    assert_int_equal(LLVMFuzzerTestOneInput(data, size), 0);
    free(data);
    free(larger);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_seeds),
    cmocka_unit_test(test_mutations),
  };
  return cmocka_run_group_tests(tests, read_seeds, free_seeds);
}
