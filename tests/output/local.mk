# This room adds to the lists that Makefile.am describes.

zs_tests += tests/output/test_contour_table
tests_output_test_contour_table_SOURCES = tests/output/test_contour_table.c
zs_tests += tests/output/test_polygonize
tests_output_test_polygonize_SOURCES = \
  tests/output/test_polygonize.c tests/output/formula.h tests/random.h
