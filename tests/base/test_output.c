/* Output files appear whole or not at all. */
#include "base/output.h"

#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[] = "test-output-XXXXXX";

static int enter(void **state)
{
  (void)state;
  return mkdtemp(folder) && chdir(folder) == 0 ? 0 : -1;
}

static int leave(void **state)
{
  (void)state;
  return chdir("..") == 0 && rmdir(folder) == 0 ? 0 : -1;
}

static size_t count_files(void)
{
  DIR *here = opendir(".");
  size_t count = 0;
  for (struct dirent *entry; (entry = readdir(here)) != NULL;)
    count += entry->d_name[0] != '.';
  closedir(here);
  return count;
}

static void assert_content(const char *path, const char *expected)
{
  char text[64] = {0};
  FILE *stream = fopen(path, "rb");
  assert_non_null(stream);
  size_t length = fread(text, 1, sizeof text - 1, stream);
  fclose(stream);
  assert_int_equal(length, strlen(expected));
  assert_string_equal(text, expected);
}

static void write_file(const char *path, const char *text)
{
  zs_output output;
  assert_true(zs_output_open(&output, path, NULL));
  assert_true(fputs(text, output.stream) >= 0);
  assert_true(zs_output_commit(&output, NULL));
}

static void test_commit(void **state)
{
  (void)state;
  zs_output output;
  mode_t mask = umask(022);
  assert_true(zs_output_open(&output, "a.txt", NULL));
  fputs("new", output.stream);
  assert_int_not_equal(access("a.txt", F_OK), 0); /* not before it is complete */
  assert_true(zs_output_commit(&output, NULL));
  assert_content("a.txt", "new");
  struct stat status;
  assert_int_equal(stat("a.txt", &status), 0);
  assert_int_equal(status.st_mode & 0777, 0644);
  assert_int_equal(count_files(), 1);
  umask(mask);
  unlink("a.txt");
}

static void test_discard_leaves_the_old_file(void **state)
{
  (void)state;
  zs_output output;
  write_file("a.txt", "old");
  assert_true(zs_output_open(&output, "a.txt", NULL));
  fputs("new", output.stream);
  fflush(output.stream);
  assert_content("a.txt", "old");
  zs_output_discard(&output);
  assert_content("a.txt", "old");
  assert_int_equal(count_files(), 1);
  unlink("a.txt");
}

static void test_replacing_keeps_permissions_and_links(void **state)
{
  (void)state;
  struct stat status;
  write_file("a.txt", "old");
  assert_int_equal(chmod("a.txt", 0640), 0);
  assert_int_equal(symlink("a.txt", "link"), 0);
  write_file("link", "new");
  assert_content("a.txt", "new");
  assert_int_equal(lstat("link", &status), 0);
  assert_true(S_ISLNK(status.st_mode));
  assert_int_equal(stat("a.txt", &status), 0);
  assert_int_equal(status.st_mode & 0777, 0640);
  unlink("link");
  unlink("a.txt");
}

static void test_two_writers(void **state)
{
  (void)state;
  zs_output first, second;
  assert_true(zs_output_open(&first, "a.txt", NULL));
  assert_true(zs_output_open(&second, "a.txt", NULL));
  fputs("first", first.stream);
  fputs("second", second.stream);
  assert_true(zs_output_commit(&second, NULL));
  assert_content("a.txt", "second");
  assert_true(zs_output_commit(&first, NULL));
  assert_content("a.txt", "first");
  assert_int_equal(count_files(), 1);
  unlink("a.txt");
}

static char message[512];

static void keep(void *context, const zs_diagnostic *d)
{
  (void)context;
  snprintf(message, sizeof message, "%d %s: %s", d->code, d->file, d->message);
}

static void test_errors(void **state)
{
  (void)state;
  zs_output output;
  zs_diag diag = {.report = keep};
  assert_false(zs_output_open(&output, "no/such/folder.txt", &diag));
  assert_string_equal(message,
                      "3 no/such/folder.txt: cannot be created: No such file or directory");
  assert_null(output.stream);
  assert_int_equal(mkdir("sub", 0700), 0);
  assert_false(zs_output_open(&output, "sub", &diag));
  assert_non_null(strstr(message, "cannot be written: Is a directory"));
  assert_int_equal(diag.errors, 2);
  rmdir("sub");
  assert_int_equal(count_files(), 0);
}

/* A full disk is noticed at the latest when the file is committed. */
static void test_full_disk(void **state)
{
  (void)state;
  zs_output output;
  zs_diag diag = {.report = keep};
  if (access("/dev/full", W_OK) != 0)
    skip();
  assert_true(zs_output_open(&output, "/dev/full", &diag));
  fputs("anything", output.stream);
  assert_false(zs_output_commit(&output, &diag));
  assert_string_equal(message, "3 /dev/full: cannot be written: No space left on device");
  assert_int_equal(diag.status, ZS_ERROR_IO);
}

/* A device is written, not replaced by a file. */
static void test_devices(void **state)
{
  (void)state;
  struct stat before, after;
  assert_int_equal(stat("/dev/null", &before), 0);
  write_file("/dev/null", "anything");
  assert_int_equal(stat("/dev/null", &after), 0);
  assert_true(S_ISCHR(after.st_mode));
  assert_int_equal(before.st_ino, after.st_ino);
  zs_output output;
  assert_true(zs_output_open(&output, "/dev/null", NULL));
  zs_output_discard(&output);
  assert_int_equal(access("/dev/null", F_OK), 0);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_commit),
    cmocka_unit_test(test_discard_leaves_the_old_file),
    cmocka_unit_test(test_replacing_keeps_permissions_and_links),
    cmocka_unit_test(test_two_writers),
    cmocka_unit_test(test_errors),
    cmocka_unit_test(test_full_disk),
    cmocka_unit_test(test_devices),
  };
  return cmocka_run_group_tests(tests, enter, leave);
}
