# This room adds to the lists that Makefile.am describes.

zs_tests += tests/output/test_contour_table
tests_output_test_contour_table_SOURCES = tests/output/test_contour_table.c
zs_tests += tests/output/test_collapse
tests_output_test_collapse_SOURCES = \
  tests/output/test_collapse.c tests/output/formula.h tests/output/meshes.h tests/random.h
zs_tests += tests/output/test_features
tests_output_test_features_SOURCES = \
  tests/output/test_features.c tests/output/formula.h tests/output/meshes.h tests/random.h
zs_tests += tests/output/test_polygonize
tests_output_test_polygonize_SOURCES = \
  tests/output/test_polygonize.c tests/output/formula.h tests/output/meshes.h \
  tests/random.h

zs_tests += \
  tests/output/test_creases \
  tests/output/test_grid \
  tests/output/test_quadric \
  tests/output/test_render \
  tests/output/test_slice \
  tests/output/test_voxelize
tests_output_test_creases_SOURCES = tests/output/test_creases.c tests/random.h
tests_output_test_grid_SOURCES = tests/output/test_grid.c tests/random.h
tests_output_test_quadric_SOURCES = tests/output/test_quadric.c tests/random.h
tests_output_test_render_SOURCES = tests/output/test_render.c tests/output/formula.h
tests_output_test_slice_SOURCES = tests/output/test_slice.c tests/output/formula.h
tests_output_test_voxelize_SOURCES = \
  tests/output/test_voxelize.c tests/output/formula.h $(zs_test_folder)

zs_tests += tests/output/test_roots
tests_output_test_roots_SOURCES = \
  tests/output/test_roots.c tests/output/formula.h tests/random.h
zs_tests += tests/output/test_slice_lines
tests_output_test_slice_lines_SOURCES = \
  tests/output/test_slice_lines.c tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
