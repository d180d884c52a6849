/* Output registers of the sensors -> units. Pure arithmetic, so that it can be tested on any computer. */
#ifndef CONVERSION_H
#define CONVERSION_H

#include "axes.h"

#define ACC_MG_PER_LSB 0.122f /* +-4 g */
#define GYRO_MDPS_PER_LSB 70.0f /* 2000 dps */
#define MAG_MGAUSS_PER_LSB 1.5f

/* Six output bytes -> the board's axes, each value truncated toward zero: out.X = -raw.Y, out.Y = raw.X. */
void AxesFromBytes(const uint8_t bytes[6], float per_lsb, AxesRaw_TypeDef *axes);

/* Three output bytes of the LPS22HB -> hPa, in steps of 0.01. */
float PressureFromBytes(const uint8_t bytes[3]);

/* Two output bytes of the LPS22HB -> degC, in steps of 0.1. */
float TemperatureFromBytes(const uint8_t bytes[2]);

#endif
