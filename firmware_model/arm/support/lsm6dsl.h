/* LSM6DSL accelerometer and gyroscope. */
#ifndef LSM6DSL_H
#define LSM6DSL_H

#include "axes.h"
#include "sensor_bus.h"

/* Identify the sensor and set up accelerometer or gyroscope, which stays powered down. Both
 * functions return COMPONENT_ERROR if the sensor is absent. */
DrvStatusTypeDef LSM6DSL_X_Init(void);
DrvStatusTypeDef LSM6DSL_G_Init(void);

/* Start at the driver's default of 104 Hz. */
DrvStatusTypeDef LSM6DSL_X_Enable(void);
DrvStatusTypeDef LSM6DSL_G_Enable(void);

/* Start the accelerometer at 6.66 kHz, +-4 g, with a low-pass at ODR/400; the gyroscope at 416
 * Hz, 2000 dps. */
void LSM6DSL_FlightSetup(void);

/* Read mg and mdps, in the board's axes. If a read fails, the values do not change. */
DrvStatusTypeDef LSM6DSL_X_GetAxes(AxesRaw_TypeDef *acc);
DrvStatusTypeDef LSM6DSL_G_GetAxes(AxesRaw_TypeDef *gyro);

#endif
