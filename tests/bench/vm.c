/* The usual 2D benchmark of implicit evaluators: a file prospero.vm with one
 * operation a line, `_NAME OPERATION ARGUMENT ...`; the last is the result, and
 * inside is where it is negative. */
#include "scenes.h"

#include "bench.h"

#include <stdio.h>
#include <string.h>

static FILE *open_prospero(void)
{
  char path[4096];
  snprintf(path, sizeof path, "%s/prospero.vm", bench_environment("ZEROSET_BENCH_DATA", "."));
  return fopen(path, "r");
}

bool scene_prospero_exists(void)
{
  FILE *file = open_prospero();
  if (file)
    fclose(file);
  return file != NULL;
}

/* The language's function of an operation's name. */
static const char *function_of(const char *operation)
{
  return !strcmp(operation, "ln") ? "log" : operation;
}

static const char *sign_of(const char *operation)
{
  static const char *const signs[][2] = {{"add", "+"}, {"sub", "-"}, {"mul", "*"}, {"div", "/"}};
  for (size_t i = 0; i < sizeof signs / sizeof *signs; i++)
    if (!strcmp(operation, signs[i][0]))
      return signs[i][1];
  return NULL;
}

/* Names begin with _, which stands for a v here. */
static void append_expression(text *t, const char *operation, const char *a, const char *b)
{
  if (!strcmp(operation, "const"))
    text_append(t, "(%s)", a);
  else if (!strncmp(operation, "var-", 4))
    text_append(t, "%s", operation + 4);
  else if (!strcmp(operation, "neg"))
    text_append(t, "-v%s", a + 1);
  else if (!strcmp(operation, "square"))
    text_append(t, "v%s * v%s", a + 1, a + 1);
  else if (sign_of(operation))
    text_append(t, "v%s %s v%s", a + 1, sign_of(operation), b + 1);
  else if (*b)
    text_append(t, "%s(v%s, v%s)", function_of(operation), a + 1, b + 1);
  else
    text_append(t, "%s(v%s)", function_of(operation), a + 1);
}

bool scene_prospero(text *t, unsigned n)
{
  (void)n;
  FILE *file = open_prospero();
  if (!file)
    return false;
  char line[256], name[64] = "_";
  text_append(t, "<scene><domain min='-1 -1 -1' max='1 1 1'/><formula>\n");
  while (fgets(line, sizeof line, file)) {
    char operation[64], a[64] = "", b[64] = "";
    if (line[0] == '#' || sscanf(line, "%63s %63s %63s %63s", name, operation, a, b) < 2)
      continue;
    text_append(t, "let v%s = ", name + 1);
    append_expression(t, operation, a, b);
    text_append(t, ";\n");
  }
  fclose(file);
  text_append(t, "-v%s</formula></scene>\n", name + 1);
  return true;
}
