/* Where in a box the solid is, roughly. */
#ifndef ZS_OUTLINE_H
#define ZS_OUTLINE_H

#include "field/program.h"

enum { ZS_OUTLINE_CELLS = 32 /* along each side of the box */ };

typedef struct zs_box {
  double lo[3], hi[3];
} zs_box;

/* Boxes that hold all of the solid that lies in a box: rows of cells along x.
 * When bounds prove that to be nothing, the box itself. */
typedef struct zs_outline {
  zs_box boxes[ZS_OUTLINE_CELLS * ZS_OUTLINE_CELLS];
  size_t count;
} zs_outline;

/* False after reporting.  The same for any number of threads. */
bool zs_outline_find(zs_outline *outline, zs_field *field, const zs_box *box,
                     const zs_control *control, zs_diag *diag);

#endif
