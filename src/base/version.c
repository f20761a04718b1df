#include "zeroset.h"

const char *zs_version(void)
{
  return PACKAGE_VERSION;
}
