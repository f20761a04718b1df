zs_tests += tests/field/test_field
tests_field_test_field_SOURCES = tests/field/test_field.c tests/random.h
