zs_tests += tests/base/test_arena
tests_base_test_arena_SOURCES = tests/base/test_arena.c tests/random.h

zs_tests += tests/base/test_array
tests_base_test_array_SOURCES = tests/base/test_array.c

zs_tests += tests/base/test_names
tests_base_test_names_SOURCES = tests/base/test_names.c

zs_tests += tests/base/test_diagnostic
tests_base_test_diagnostic_SOURCES = tests/base/test_diagnostic.c tests/random.h

zs_tests += tests/base/test_expression
tests_base_test_expression_SOURCES = tests/base/test_expression.c tests/comma_locale.h \
  tests/random.h

zs_tests += tests/base/test_output
tests_base_test_output_SOURCES = tests/base/test_output.c

zs_tests += tests/base/test_xml
tests_base_test_xml_SOURCES = tests/base/test_xml.c tests/scene/print.h tests/random.h
