#include "cli/commands.h"
#include "cli/report.h"

#include <stdlib.h>

/* Print a text of the library's and free it. */
static int print_text(char *text)
{
  if (!text) {
    cli_error("out of memory");
    return CLI_UNABLE;
  }
  fputs(text, stdout);
  free(text);
  return CLI_DONE;
}

static int print_node(const char *name)
{
  cli_reporter reporter;
  cli_reporter_init(&reporter, false);
  zs_diag diag = {.report = cli_report, .context = &reporter};
  char *text = zs_document_node(name, &diag);
  cli_reporter_clear(&reporter);
  return text ? print_text(text) : cli_exit_status(diag.status);
}

int cli_nodes(const cli_options *options)
{
  if (options->node)
    return print_node(options->node);
  return print_text(zs_document_text(options->manual ? ZS_DOCUMENT_NODES : ZS_DOCUMENT_SUMMARY));
}

int cli_schema(const cli_options *options)
{
  static const zs_document schemas[] = {ZS_DOCUMENT_RELAX_NG, ZS_DOCUMENT_XSD};
  return print_text(zs_document_text(schemas[options->format]));
}
