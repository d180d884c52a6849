/* LPS22HB barometer. */
#ifndef LPS22HB_H
#define LPS22HB_H

#include "sensor_bus.h"

/* Resets the sensor, waits 1 s, identifies it and sets it up; it stays powered down. Returns
 * COMPONENT_ERROR if it is absent. */
DrvStatusTypeDef LPS22HB_Init(void);

/* Starts the sensor at 25 Hz and reads the setting back, as ST's driver does. Called once for
 * pressure and once for temperature. */
DrvStatusTypeDef LPS22HB_Enable(void);

/* Waits for the first pressure and temperature. Returns COMPONENT_ERROR after 100 ms, or after a
 * bus error. */
DrvStatusTypeDef LPS22HB_WaitForData(void);

/* Read hPa and degC. If a read fails, the value does not change. */
DrvStatusTypeDef LPS22HB_Get_Press(float *press);
DrvStatusTypeDef LPS22HB_Get_Temp(float *temperature);

#endif
