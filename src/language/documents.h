/* The documents that the library writes about its language, each into a text. */
#ifndef ZS_LANGUAGE_DOCUMENTS_H
#define ZS_LANGUAGE_DOCUMENTS_H

#include "language/text.h"
#include "nodes/kind.h"

void zs_relaxng_write(zs_text *text);
void zs_xsd_write(zs_text *text);
/* The whole manual; the section on one element, whose heading has `level` #. */
void zs_manual_write(zs_text *text);
void zs_manual_write_kind(zs_text *text, const zs_kind *kind, int level);
/* A line for each kind. */
void zs_manual_write_summary(zs_text *text);

#endif
