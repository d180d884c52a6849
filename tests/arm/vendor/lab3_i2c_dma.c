/* All sensors are read in the callback; each read's bytes come by DMA, its end is waited for. */
#include "lab.h"

int main(void)
{
  Lab_Run();
}

HAL_StatusTypeDef Bus_Read(uint16_t device, uint8_t reg, uint8_t *data, uint16_t size)
{
  HAL_StatusTypeDef status = I2c_Mem_Read_DMA(&i2c2, device, reg, data, size);
  while (status == HAL_OK && i2c2.state != I2C_READY) {
  }
  if (status != HAL_OK || i2c2.error != 0U) {
    errors++;
    return HAL_ERROR;
  }
  return HAL_OK;
}

void I2c_ErrorCallback(I2c *i2c)
{
  UNUSED(i2c);
  errors++;
}

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  ReadSensorRawData(&acc, &gyro, &mag, &press);
  samples++;
}
