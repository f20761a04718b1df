# This room adds to the lists that Makefile.am describes.
zs_tests += \
  tests/files/test_gray \
  tests/files/test_image \
  tests/files/test_points \
  tests/files/test_rings \
  tests/files/test_tiff \
  tests/files/test_volume \
  tests/files/test_volume_read
tests_files_test_gray_SOURCES = tests/files/test_gray.c tests/files/scratch.h
tests_files_test_image_SOURCES = tests/files/test_image.c tests/files/scratch.h
tests_files_test_volume_SOURCES = tests/files/test_volume.c tests/files/scratch.h
tests_files_test_points_SOURCES = \
  tests/files/test_points.c tests/files/scratch.h tests/random.h
tests_files_test_rings_SOURCES = tests/files/test_rings.c tests/files/scratch.h
tests_files_test_volume_read_SOURCES = \
  tests/files/test_volume_read.c tests/files/scratch.h tests/random.h
tests_files_test_tiff_SOURCES = tests/files/test_tiff.c tests/files/scratch.h tests/random.h
