/* The sensors on I2C2: SCL PB10, SDA PB3, 400 kHz. */
#include "sensor_bus.h"

#define TIMEOUT_MS 100U

I2C_HandleTypeDef hi2c2;

void MX_SensorBus_Init(void)
{
  GPIO_InitTypeDef pin = {
      .Pin = GPIO_PIN_10,
      .Mode = GPIO_MODE_AF_OD,
      .Pull = GPIO_PULLUP,
      .Speed = GPIO_SPEED_FREQ_HIGH,
      .Alternate = GPIO_AF4_I2C2,
  };
  HAL_GPIO_Init(GPIOB, &pin);
  pin.Pin = GPIO_PIN_3;
  pin.Alternate = GPIO_AF9_I2C2;
  HAL_GPIO_Init(GPIOB, &pin);

  __HAL_RCC_I2C2_CLK_ENABLE();
  hi2c2.Instance = I2C2;
  hi2c2.Init.ClockSpeed = 400000;
  hi2c2.Init.DutyCycle = I2C_DUTYCYCLE_2;
  hi2c2.Init.AddressingMode = I2C_ADDRESSINGMODE_7BIT;
  HAL_I2C_Init(&hi2c2);
}

DrvStatusTypeDef Sensor_IO_Read(const SensorDevice *device, uint8_t reg, uint8_t *data, uint16_t size)
{
  HAL_StatusTypeDef status =
      HAL_I2C_Mem_Read(&hi2c2, device->i2c_address, reg, I2C_MEMADD_SIZE_8BIT, data, size, TIMEOUT_MS);
  return status == HAL_OK ? COMPONENT_OK : COMPONENT_ERROR;
}

DrvStatusTypeDef Sensor_IO_Write(const SensorDevice *device, uint8_t reg, uint8_t value)
{
  HAL_StatusTypeDef status =
      HAL_I2C_Mem_Write(&hi2c2, device->i2c_address, reg, I2C_MEMADD_SIZE_8BIT, &value, 1, TIMEOUT_MS);
  return status == HAL_OK ? COMPONENT_OK : COMPONENT_ERROR;
}
