/* Scenes from text in a folder of the test's own, and what was said of them. */
#ifndef ZS_TEST_SCENE_TEXT_H
#define ZS_TEST_SCENE_TEXT_H

#include "../files/set_up.h"

#include "zeroset.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

typedef struct seen {
  char message[512], hint[512], file[256];
  unsigned line;
  zs_status status;
} seen;

static inline void keep(void *context, const zs_diagnostic *d)
{
  seen *s = context;
  if (*s->message)
    return;
  snprintf(s->message, sizeof s->message, "%s", d->message);
  snprintf(s->hint, sizeof s->hint, "%s", d->hint ? d->hint : "");
  snprintf(s->file, sizeof s->file, "%s", d->file ? d->file : "");
  s->line = d->line;
  s->status = d->code;
}

static inline zs_scene *parse(const char *body, zs_diag *diag)
{
  static char text[100000];
  char name[sizeof folder.path];
  snprintf(text, sizeof text, "<scene>\n%s\n</scene>\n", body);
  strcpy(name, scratch_path(&folder, "scene.xml"));
  return zs_scene_parse(text, strlen(text), name, NULL, diag);
}

static inline zs_field *compile(const char *body)
{
  seen s = {.message = ""};
  zs_diag diag = {.report = keep, .context = &s};
  zs_scene *scene = parse(body, &diag);
  zs_field *field = scene ? zs_scene_compile(scene, NULL, NULL, &diag) : NULL;
  if (!field)
    fail_msg("line %u: %s", s.line, s.message);
  zs_scene_free(scene);
  return field;
}

static inline zs_eval *evaluator(zs_field *field)
{
  zs_eval *eval = zs_eval_new(field, NULL);
  assert_non_null(eval);
  return eval;
}

/* What is said first of a scene that is not to be read, or compiled. */
static inline seen refusal(const char *body)
{
  seen s = {.message = ""};
  zs_diag diag = {.report = keep, .context = &s};
  zs_scene *scene = parse(body, &diag);
  zs_field *field = scene ? zs_scene_compile(scene, NULL, NULL, &diag) : NULL;
  if (field || diag.errors == 0)
    fail_msg("%u errors, and %s field: %s", diag.errors, field ? "a" : "no", body);
  zs_scene_free(scene);
  return s;
}

static inline void refuses(const char *body, const char *message)
{
  const seen s = refusal(body);
  if (!strstr(s.message, message))
    fail_msg("%s: '%s' does not say '%s'", body, s.message, message);
  if (strstr(s.file, "scene.xml"))
    assert_true(s.line >= 2); /* where the body begins */
}

/* f of a scene at one point. */
static inline double value_in(const char *body, double x, double y, double z)
{
  zs_field *field = compile(body);
  zs_eval *eval = evaluator(field);
  const double f = zs_eval_point(eval, (const double[3]){x, y, z});
  zs_eval_free(eval);
  zs_field_unref(field);
  return f;
}

/* A new file in the folder. */
static inline FILE *create(const char *name)
{
  FILE *file = fopen(scratch_path(&folder, name), "w");
  assert_non_null(file);
  return file;
}

static inline void write_text(const char *name, const char *text)
{
  FILE *file = create(name);
  fputs(text, file);
  assert_int_equal(fclose(file), 0);
}

#endif
