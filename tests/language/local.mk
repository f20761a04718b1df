zs_tests += \
  tests/language/test_documents \
  tests/language/test_schemas
tests_language_test_documents_SOURCES = tests/language/test_documents.c
tests_language_test_schemas_SOURCES = tests/language/test_schemas.c
