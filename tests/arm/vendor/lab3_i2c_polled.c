/* All sensors are read in the callback, every flag of I2C2 polled. */
#include "lab.h"

int main(void)
{
  Lab_Run();
}

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  ReadSensorRawData(&acc, &gyro, &mag, &press);
  samples++;
}
