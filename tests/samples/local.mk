zs_tests += tests/samples/test_polygon
tests_samples_test_polygon_SOURCES = tests/samples/test_polygon.c tests/random.h
