#include "field/chain.h"
#include "field/field.h"
#include "field/scalar.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

zs_field *zs_field_ref(zs_field *field)
{
  atomic_fetch_add_explicit(&field->references, 1, memory_order_relaxed);
  return field;
}

void zs_field_unref(zs_field *field)
{
  if (!field || atomic_fetch_sub_explicit(&field->references, 1, memory_order_acq_rel) != 1)
    return;
  for (const zs_kept *kept = field->kept; kept; kept = kept->next)
    kept->release(kept->data);
  zs_arena_free(&field->arena);
  free(field);
}

const zs_program *zs_field_program(const zs_field *field)
{
  return field->program;
}

void zs_field_describe(const zs_field *field, zs_field_info *info)
{
  *info = (zs_field_info){
    .nodes = field->nodes,
    .instructions = zs_program_length(field->program),
    .registers = field->program->register_count - ZS_COORDINATES,
    .choices = zs_program_choices(field->program),
    .fits = field->fit_count,
    .bytes = field->arena.bytes,
    .correspondences = field->correspondence_count,
  };
  for (size_t i = 0; i < field->fit_count; i++)
    info->bytes += field->fits[i].bytes;
}

bool zs_field_fit(const zs_field *field, size_t index, zs_fit_info *info)
{
  if (index >= field->fit_count)
    return false;
  *info = field->fits[index];
  return true;
}

bool zs_field_correspondence(const zs_field *field, size_t index,
                             zs_correspondence *correspondence)
{
  if (index >= field->correspondence_count)
    return false;
  *correspondence = field->correspondences[index];
  return true;
}

/* Room for the longest line of a listing. */
enum { LINE = 160 };

static size_t list_instruction(const zs_program *program, uint32_t i, char line[LINE])
{
  const zs_instruction *instruction = &program->instructions[i];
  size_t at = (size_t)snprintf(line, LINE, "%" PRIu32 " r%" PRIu32 " %s", i, program->registers[i],
                               instruction->operation->name);
  for (unsigned k = 0; k < instruction->operation->arity; k++)
    at += (size_t)snprintf(line + at, LINE - at, " %" PRIu32, instruction->in[k]);
  if (instruction->operation->chain)
    at += (size_t)snprintf(line + at, LINE - at, " [%" PRIu32 " links]",
                           ((const zs_chain *)instruction->data)->count);
  if (instruction->operation->data_size == sizeof(double))
    at += (size_t)snprintf(line + at, LINE - at, " [%g]", *(const double *)instruction->data);
  at += (size_t)snprintf(line + at, LINE - at, "\n");
  return at;
}

char *zs_field_listing(const zs_field *field)
{
  const zs_program *program = field->program;
  char *text = malloc((size_t)program->count * LINE + 1);
  if (!text)
    return NULL;
  size_t at = 0;
  for (uint32_t i = ZS_COORDINATES; i < program->count; i++)
    at += list_instruction(program, i, text + at);
  text[at] = '\0';
  char *fitting = realloc(text, at + 1);
  return fitting ? fitting : text;
}
