# This room adds to the lists that Makefile.am describes.
zs_tests += \
  tests/rbf/test_cells \
  tests/rbf/test_constraints \
  tests/rbf/test_contour \
  tests/rbf/test_fast \
  tests/rbf/test_fit \
  tests/rbf/test_flow \
  tests/rbf/test_greedy \
  tests/rbf/test_iterative \
  tests/rbf/test_normals \
  tests/rbf/test_rigid \
  tests/rbf/test_solvers \
  tests/rbf/test_sum \
  tests/rbf/test_witnesses
tests_rbf_test_cells_SOURCES = tests/rbf/test_cells.c tests/random.h
tests_rbf_test_constraints_SOURCES = tests/rbf/test_constraints.c tests/random.h
tests_rbf_test_contour_SOURCES = tests/rbf/test_contour.c
tests_rbf_test_fast_SOURCES = tests/rbf/test_fast.c tests/random.h
tests_rbf_test_fit_SOURCES = tests/rbf/test_fit.c tests/rbf/clouds.h tests/random.h
tests_rbf_test_greedy_SOURCES = tests/rbf/test_greedy.c tests/random.h
tests_rbf_test_iterative_SOURCES = tests/rbf/test_iterative.c tests/rbf/clouds.h tests/random.h
tests_rbf_test_normals_SOURCES = tests/rbf/test_normals.c tests/random.h
tests_rbf_test_rigid_SOURCES = tests/rbf/test_rigid.c tests/random.h
tests_rbf_test_solvers_SOURCES = tests/rbf/test_solvers.c tests/random.h
tests_rbf_test_sum_SOURCES = tests/rbf/test_sum.c tests/random.h
tests_rbf_test_flow_SOURCES = tests/rbf/test_flow.c tests/random.h
tests_rbf_test_witnesses_SOURCES = tests/rbf/test_witnesses.c tests/random.h
