/* Conversion of the sensors' output registers to physical units. The functions are pure arithmetic,
 * so that they can be tested on any computer. */
#ifndef CONVERSION_H
#define CONVERSION_H

#include "axes.h"

#define ACC_MG_PER_LSB 0.122f /* +-4 g */
#define GYRO_MDPS_PER_LSB 70.0f /* 2000 dps */
#define MAG_MGAUSS_PER_LSB 1.5f

/* Converts six output bytes to the board's axes, each value truncated toward zero: out.X =
 * -raw.Y, out.Y = raw.X. */
void AxesFromBytes(const uint8_t bytes[6], float per_lsb, AxesRaw_TypeDef *axes);

/* Converts three output bytes of the LPS22HB to hPa, in steps of 0.01. */
float PressureFromBytes(const uint8_t bytes[3]);

/* Converts two output bytes of the LPS22HB to degC, in steps of 0.1. */
float TemperatureFromBytes(const uint8_t bytes[2]);

#endif
