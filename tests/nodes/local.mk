zs_tests += tests/nodes/test_kinds
tests_nodes_test_kinds_SOURCES = tests/nodes/test_kinds.c tests/nodes/build.h
