zs_tests += \
  tests/nodes/test_curved_polygon \
  tests/nodes/test_data \
  tests/nodes/test_deform \
  tests/nodes/test_distance_morph \
  tests/nodes/test_fits \
  tests/nodes/test_formulas \
  tests/nodes/test_interpolate \
  tests/nodes/test_kinds \
  tests/nodes/test_lattice_warp \
  tests/nodes/test_laws \
  tests/nodes/test_local_morph \
  tests/nodes/test_maps \
  tests/nodes/test_minkowski_morph \
  tests/nodes/test_morph \
  tests/nodes/test_parts \
  tests/nodes/test_path \
  tests/nodes/test_point_maps \
  tests/nodes/test_primitives \
  tests/nodes/test_repeat \
  tests/nodes/test_skeletal \
  tests/nodes/test_solids \
  tests/nodes/test_space_time \
  tests/nodes/test_stack \
  tests/nodes/test_trees \
  tests/nodes/test_variational
tests_nodes_test_formulas_SOURCES = tests/nodes/test_formulas.c tests/nodes/build.h
tests_nodes_test_kinds_SOURCES = \
  tests/nodes/test_kinds.c tests/nodes/build.h tests/nodes/random_nodes.h
tests_nodes_test_interpolate_SOURCES = \
  tests/nodes/test_interpolate.c tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_laws_SOURCES = \
  tests/nodes/test_laws.c tests/nodes/laws.h tests/nodes/build.h
tests_nodes_test_primitives_SOURCES = tests/nodes/test_primitives.c tests/nodes/build.h
tests_nodes_test_local_morph_SOURCES = \
  tests/nodes/test_local_morph.c tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_space_time_SOURCES = \
  tests/nodes/test_space_time.c tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_stack_SOURCES = \
  tests/nodes/test_stack.c tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_trees_SOURCES = \
  tests/nodes/test_trees.c tests/nodes/build.h tests/nodes/random_nodes.h
tests_nodes_test_variational_SOURCES = \
  tests/nodes/test_variational.c tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_morph_SOURCES = \
  tests/nodes/test_morph.c tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_parts_SOURCES = \
  tests/nodes/test_parts.c tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_fits_SOURCES = \
  tests/nodes/test_fits.c tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_data_SOURCES = \
  tests/nodes/test_data.c tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_path_SOURCES = \
  tests/nodes/test_path.c tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_curved_polygon_SOURCES = \
  tests/nodes/test_curved_polygon.c tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_deform_SOURCES = \
  tests/nodes/test_deform.c tests/nodes/laws.h tests/nodes/build.h
tests_nodes_test_solids_SOURCES = \
  tests/nodes/test_solids.c tests/nodes/laws.h tests/nodes/build.h
tests_nodes_test_maps_SOURCES = tests/nodes/test_maps.c tests/nodes/laws.h tests/nodes/build.h
tests_nodes_test_skeletal_SOURCES = \
  tests/nodes/test_skeletal.c tests/nodes/laws.h tests/nodes/build.h
tests_nodes_test_minkowski_morph_SOURCES = \
  tests/nodes/test_minkowski_morph.c tests/nodes/laws.h tests/nodes/build.h \
  tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_distance_morph_SOURCES = \
  tests/nodes/test_distance_morph.c tests/nodes/laws.h tests/nodes/build.h \
  tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_point_maps_SOURCES = \
  tests/nodes/test_point_maps.c tests/nodes/laws.h tests/nodes/build.h tests/nodes/scene_text.h \
  $(zs_test_folder) tests/random.h
tests_nodes_test_repeat_SOURCES = \
  tests/nodes/test_repeat.c tests/nodes/build.h tests/nodes/random_nodes.h \
  tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
tests_nodes_test_lattice_warp_SOURCES = \
  tests/nodes/test_lattice_warp.c tests/nodes/laws.h tests/nodes/build.h \
  tests/nodes/scene_text.h $(zs_test_folder) tests/random.h
