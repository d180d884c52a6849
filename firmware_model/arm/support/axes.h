/* A vector of the board: X right, Y forward, Z up out of the component side. */
#ifndef AXES_H
#define AXES_H

#include <stdint.h>

typedef struct {
  int32_t AXIS_X;
  int32_t AXIS_Y;
  int32_t AXIS_Z;
} AxesRaw_TypeDef;

#endif
