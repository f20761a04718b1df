/* Where things stand in the header of a NIfTI-1 file: https://nifti.nimh.nih.gov/nifti-1 */
#ifndef ZS_NIFTI_H
#define ZS_NIFTI_H

#include "files/volume_read.h"

enum {
  ZS_NIFTI_HEADER = 348,      /* bytes */
  ZS_NIFTI_SIZEOF_HDR = 0,    /* int */
  ZS_NIFTI_DIM = 40,          /* short[8]: how many axes, their sizes */
  ZS_NIFTI_DATATYPE = 70,     /* short */
  ZS_NIFTI_BITPIX = 72,       /* short */
  ZS_NIFTI_PIXDIM = 76,       /* float[8]: handedness, the sides of a voxel */
  ZS_NIFTI_VOX_OFFSET = 108,  /* float: where the data begins */
  ZS_NIFTI_SCL_SLOPE = 112,   /* float */
  ZS_NIFTI_SCL_INTER = 116,   /* float */
  ZS_NIFTI_DESCRIP = 148,     /* char[80] */
  ZS_NIFTI_QFORM_CODE = 252,  /* short */
  ZS_NIFTI_SFORM_CODE = 254,  /* short */
  ZS_NIFTI_QUATERN = 256,     /* float[3] */
  ZS_NIFTI_QOFFSET = 268,     /* float[3] */
  ZS_NIFTI_SROW = 280,        /* float[3][4]: from indices to places */
  ZS_NIFTI_MAGIC = 344,       /* char[4] */
  ZS_NIFTI_DATA = 352         /* where data usually begins: no extensions */
};

static const struct {
  int code;
  zs_voxel_type type;
} zs_nifti_types[] = {{2, ZS_VOXEL_U8},    {4, ZS_VOXEL_I16},   {8, ZS_VOXEL_I32},
                      {16, ZS_VOXEL_F32},  {64, ZS_VOXEL_F64},  {256, ZS_VOXEL_I8},
                      {512, ZS_VOXEL_U16}, {768, ZS_VOXEL_U32}, {1024, ZS_VOXEL_I64},
                      {1280, ZS_VOXEL_U64}};

#endif
