# This room adds to the lists that Makefile.am describes.
zs_test_scripts += \
  tests/program/test_scenes.sh \
  tests/program/test_threads.sh \
  tests/program/test_brute.sh \
  tests/program/test_library.sh \
  tests/program/test_tutorial.sh

zs_tests += tests/program/test_measures tests/program/test_bunny
tests_program_test_measures_SOURCES = tests/program/test_measures.c
tests_program_test_bunny_SOURCES = tests/program/test_bunny.c

# The example is built as a user of the installed library would.
check_PROGRAMS += doc/examples/embed
doc_examples_embed_SOURCES = doc/examples/embed.c
doc_examples_embed_LDADD = libzeroset.la

EXTRA_DIST += tests/program/cases.sh
