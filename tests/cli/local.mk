zs_tests += \
  tests/cli/test_program \
  tests/cli/test_text
tests_cli_test_program_SOURCES = tests/cli/test_program.c
tests_cli_test_text_SOURCES = \
  src/cli/text.c \
  tests/cli/test_text.c
