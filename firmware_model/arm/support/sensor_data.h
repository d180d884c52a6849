/* The sensors' readings. */
#ifndef SENSOR_DATA_H
#define SENSOR_DATA_H

#include "axes.h"

/* Reads all sensors: acc in mg, gyro in mdps, mag in mgauss, pre in hPa; X right, Y forward, Z
 * up. A value that cannot be read does not change. */
void ReadSensorRawData(AxesRaw_TypeDef *acc, AxesRaw_TypeDef *gyro, AxesRaw_TypeDef *mag, float *pre);

#endif
