EXTRA_DIST += tests/scene/broken

zs_tests += tests/scene/test_broken
tests_scene_test_broken_SOURCES = tests/scene/test_broken.c tests/scene/print.h
