/* The sensors' readings. */
#include "sensor_data.h"

#include "lis2mdl.h"
#include "lps22hb.h"
#include "lsm6dsl.h"

void ReadSensorRawData(AxesRaw_TypeDef *acc, AxesRaw_TypeDef *gyro, AxesRaw_TypeDef *mag, float *pre)
{
  LSM6DSL_X_GetAxes(acc);
  LSM6DSL_G_GetAxes(gyro);
  LIS2MDL_GetAxes(mag);
  LPS22HB_Get_Press(pre);
}
