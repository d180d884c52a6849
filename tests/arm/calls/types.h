#ifndef TYPES_H
#define TYPES_H

#include <stdbool.h>
#include <stdint.h>

#define CALLED __attribute__((used, noinline, noclone))

typedef struct { int32_t AXIS_X, AXIS_Y, AXIS_Z; } Axes;
typedef struct { uint8_t first, second, third; } Bytes;
typedef struct { float x, y; } Pair;
typedef struct { double x, y, z; } Triple;
typedef struct { uint8_t kind; double value; } Mixed;
typedef struct { Pair first, second; } Four;
typedef struct { float numbers[5]; } Five;
typedef struct { int16_t low, high; } Halves;

#endif
