EXTRA_DIST += tests/scene/broken

zs_tests += tests/scene/test_broken
tests_scene_test_broken_SOURCES = tests/scene/test_broken.c tests/scene/print.h

zs_tests += tests/scene/test_expand
tests_scene_test_expand_SOURCES = tests/scene/test_expand.c tests/scene/print.h \
  tests/comma_locale.h tests/random.h

zs_tests += tests/scene/test_include
tests_scene_test_include_SOURCES = tests/scene/test_include.c tests/scene/print.h

zs_tests += tests/scene/test_cache
tests_scene_test_cache_SOURCES = tests/scene/test_cache.c

EXTRA_DIST += tests/fuzz/seeds

zs_tests += tests/fuzz/test_fuzz
tests_fuzz_test_fuzz_SOURCES = tests/fuzz/test_fuzz.c tests/fuzz/fuzz_scene.c tests/random.h

# The library's allocations are sent to the test, which lets them fail.
zs_tests += tests/scene/test_memory
tests_scene_test_memory_SOURCES = tests/scene/test_memory.c tests/scene/print.h \
  tests/failing_allocation.h
tests_scene_test_memory_LDFLAGS = $(AM_LDFLAGS) $(failing_allocation)

# Counted by the test.
zs_tests += tests/scene/test_growth
tests_scene_test_growth_SOURCES = tests/scene/test_growth.c tests/scene/print.h
tests_scene_test_growth_LDFLAGS = $(AM_LDFLAGS) \
  -Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc,--wrap=aligned_alloc,--wrap=memchr
