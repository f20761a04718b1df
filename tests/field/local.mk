zs_tests += tests/field/test_field
tests_field_test_field_SOURCES = tests/field/test_field.c tests/random.h

zs_tests += tests/field/test_threads
tests_field_test_threads_SOURCES = tests/field/test_threads.c
tests_field_test_threads_LDFLAGS = $(AM_LDFLAGS) -pthread

zs_tests += tests/field/test_blend
tests_field_test_blend_SOURCES = tests/field/test_blend.c tests/random.h

zs_tests += tests/field/test_chain
tests_field_test_chain_SOURCES = tests/field/test_chain.c tests/random.h
