/* What the two commands that make a picture share. */
#ifndef CLI_PICTURE_H
#define CLI_PICTURE_H

#include "cli/session.h"

/* Write the picture, tell and report.  `inside` is reported when not NULL. */
bool cli_picture_finish(cli_session *session, const zs_image *image, const uint64_t *inside,
                        const char *output);

/* What is left to do when it is written: to report it. */
bool cli_picture_told(cli_session *session, uint32_t width, uint32_t height,
                      const uint64_t *inside, const char *output);

#endif
