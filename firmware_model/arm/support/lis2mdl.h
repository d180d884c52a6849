/* LIS2MDL magnetometer. */
#ifndef LIS2MDL_H
#define LIS2MDL_H

#include "axes.h"
#include "sensor_bus.h"

/* Identifies the sensor and sets it up; the sensor stays idle. Returns COMPONENT_ERROR if it is absent. */
DrvStatusTypeDef LIS2MDL_Init(void);

/* Start continuous measurement. */
DrvStatusTypeDef LIS2MDL_Enable(void);

/* Starts measurements with temperature compensation and offset cancellation at 100 Hz. */
void LIS2MDL_FlightSetup(void);

/* Reads the field in mgauss, in the board's axes. If the read fails, the value does not change. */
DrvStatusTypeDef LIS2MDL_GetAxes(AxesRaw_TypeDef *mag);

#endif
