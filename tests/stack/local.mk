zs_tests += \
  tests/stack/test_blocks \
  tests/stack/test_join \
  tests/stack/test_memory \
  tests/stack/test_motion
tests_stack_test_blocks_SOURCES = tests/stack/test_blocks.c tests/random.h
tests_stack_test_join_SOURCES = tests/stack/test_join.c tests/random.h
tests_stack_test_motion_SOURCES = tests/stack/test_motion.c
tests_stack_test_memory_SOURCES = tests/stack/test_memory.c tests/failing_allocation.h
tests_stack_test_memory_LDFLAGS = $(AM_LDFLAGS) $(failing_allocation)
