zs_tests += \
  tests/samples/test_picture \
  tests/samples/test_polygon \
  tests/samples/test_raster
tests_samples_test_picture_SOURCES = tests/samples/test_picture.c tests/random.h
tests_samples_test_polygon_SOURCES = tests/samples/test_polygon.c tests/random.h
tests_samples_test_raster_SOURCES = tests/samples/test_raster.c tests/random.h
zs_tests += tests/samples/test_triangles
tests_samples_test_triangles_SOURCES = tests/samples/test_triangles.c tests/random.h
zs_tests += tests/samples/test_fill
tests_samples_test_fill_SOURCES = tests/samples/test_fill.c tests/random.h
zs_tests += tests/samples/test_minkowski
tests_samples_test_minkowski_SOURCES = tests/samples/test_minkowski.c tests/random.h
