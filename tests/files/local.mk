# This room adds to the lists that Makefile.am describes.
zs_test_folder = tests/files/set_up.h tests/files/scratch.h

zs_tests += \
  tests/files/test_gray \
  tests/files/test_image \
  tests/files/test_points \
  tests/files/test_rings \
  tests/files/test_tiff \
  tests/files/test_volume \
  tests/files/test_volume_read
tests_files_test_gray_SOURCES = tests/files/test_gray.c $(zs_test_folder)
tests_files_test_image_SOURCES = tests/files/test_image.c $(zs_test_folder)
tests_files_test_volume_SOURCES = tests/files/test_volume.c $(zs_test_folder)
tests_files_test_points_SOURCES = \
  tests/files/test_points.c $(zs_test_folder) tests/random.h
tests_files_test_rings_SOURCES = tests/files/test_rings.c $(zs_test_folder)
tests_files_test_volume_read_SOURCES = \
  tests/files/test_volume_read.c $(zs_test_folder) tests/random.h
tests_files_test_tiff_SOURCES = tests/files/test_tiff.c $(zs_test_folder) tests/random.h
