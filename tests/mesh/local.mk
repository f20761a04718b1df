zs_tests += tests/mesh/test_check
tests_mesh_test_check_SOURCES = \
  tests/mesh/test_check.c tests/mesh/solids.c tests/mesh/solids.h tests/random.h
zs_tests += tests/mesh/test_keep
tests_mesh_test_keep_SOURCES = \
  tests/mesh/test_keep.c tests/mesh/solids.c tests/mesh/solids.h tests/random.h
zs_tests += tests/mesh/test_files
tests_mesh_test_files_SOURCES = \
  tests/mesh/test_files.c tests/mesh/solids.c tests/mesh/solids.h tests/random.h
zs_tests += tests/mesh/test_simplify
tests_mesh_test_simplify_SOURCES = \
  tests/mesh/test_simplify.c tests/mesh/solids.c tests/mesh/solids.h
zs_tests += tests/mesh/test_peer
tests_mesh_test_peer_SOURCES = tests/mesh/test_peer.cc tests/mesh/solids.c tests/mesh/solids.h
zs_tests += tests/mesh/test_close
tests_mesh_test_close_SOURCES = tests/mesh/test_close.c tests/random.h
