/* LSM6DSL accelerometer and gyroscope. */
#ifndef LSM6DSL_H
#define LSM6DSL_H

#include "axes.h"
#include "sensor_bus.h"

/* Identify the part and set one half up, powered down; COMPONENT_ERROR if it is not there. */
DrvStatusTypeDef LSM6DSL_X_Init(void);
DrvStatusTypeDef LSM6DSL_G_Init(void);

/* Start at the driver's default of 104 Hz. */
DrvStatusTypeDef LSM6DSL_X_Enable(void);
DrvStatusTypeDef LSM6DSL_G_Enable(void);

/* Accelerometer 6.66 kHz, +-4 g, low pass at ODR/400; gyroscope 416 Hz, 2000 dps. */
void LSM6DSL_FlightSetup(void);

/* mg and mdps in the board's axes; untouched if the read fails. */
DrvStatusTypeDef LSM6DSL_X_GetAxes(AxesRaw_TypeDef *acc);
DrvStatusTypeDef LSM6DSL_G_GetAxes(AxesRaw_TypeDef *gyro);

#endif
