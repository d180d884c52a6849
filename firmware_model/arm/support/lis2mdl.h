/* LIS2MDL magnetometer. */
#ifndef LIS2MDL_H
#define LIS2MDL_H

#include "axes.h"
#include "sensor_bus.h"

/* Identify the part and set it up, idle; COMPONENT_ERROR if it is not there. */
DrvStatusTypeDef LIS2MDL_Init(void);

/* Start continuous measurement. */
DrvStatusTypeDef LIS2MDL_Enable(void);

/* Temperature compensation, 100 Hz, offset cancellation. */
void LIS2MDL_FlightSetup(void);

/* mgauss in the board's axes; untouched if the read fails. */
DrvStatusTypeDef LIS2MDL_GetAxes(AxesRaw_TypeDef *mag);

#endif
