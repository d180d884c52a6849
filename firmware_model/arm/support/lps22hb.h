/* LPS22HB barometer. */
#ifndef LPS22HB_H
#define LPS22HB_H

#include "sensor_bus.h"

/* Reset, wait 1 s, identify and set up, powered down; COMPONENT_ERROR if it is not there. */
DrvStatusTypeDef LPS22HB_Init(void);

/* Start 25 Hz and read the setting back, as ST does; called for pressure, then for temperature. */
DrvStatusTypeDef LPS22HB_Enable(void);

/* Wait for the first pressure and temperature; COMPONENT_ERROR after 100 ms or on a bus error. */
DrvStatusTypeDef LPS22HB_WaitForData(void);

/* hPa and degC; untouched if the read fails. */
DrvStatusTypeDef LPS22HB_Get_Press(float *press);
DrvStatusTypeDef LPS22HB_Get_Temp(float *temperature);

#endif
