/* The sensors on SPI2, as on the real board: SCK PB13, data PB15, mode 3, 42 MHz / 16 = 2.625 MHz, one chip select
 * each: PA8 LSM6DSL, PB12 LIS2MDL, PC13 LPS22HB.
 */
#include "sensor_bus.h"

#define TIMEOUT_MS 100U
#define READ_FLAG 0x80U

SPI_HandleTypeDef hspi2;

static void InitChipSelect(GPIO_TypeDef *port, uint16_t number)
{
  GPIO_InitTypeDef pin = {.Pin = number, .Mode = GPIO_MODE_OUTPUT_PP, .Speed = GPIO_SPEED_FREQ_HIGH};
  HAL_GPIO_WritePin(port, number, GPIO_PIN_SET); /* set before the pin drives, so that no sensor
                                                    is selected by accident */
  HAL_GPIO_Init(port, &pin);
}

void MX_SensorBus_Init(void)
{
  GPIO_InitTypeDef pins = {
      .Pin = GPIO_PIN_13 | GPIO_PIN_15,
      .Mode = GPIO_MODE_AF_PP,
      .Speed = GPIO_SPEED_FREQ_HIGH,
      .Alternate = GPIO_AF5_SPI2,
  };
  InitChipSelect(GPIOA, GPIO_PIN_8);
  InitChipSelect(GPIOB, GPIO_PIN_12);
  InitChipSelect(GPIOC, GPIO_PIN_13);
  HAL_GPIO_Init(GPIOB, &pins);

  __HAL_RCC_SPI2_CLK_ENABLE();
  hspi2.Instance = SPI2;
  hspi2.Init.Mode = SPI_MODE_MASTER;
  hspi2.Init.Direction = SPI_DIRECTION_1LINE;
  hspi2.Init.DataSize = SPI_DATASIZE_8BIT;
  hspi2.Init.CLKPolarity = SPI_POLARITY_HIGH;
  hspi2.Init.CLKPhase = SPI_PHASE_2EDGE;
  hspi2.Init.NSS = SPI_NSS_SOFT;
  hspi2.Init.BaudRatePrescaler = SPI_BAUDRATEPRESCALER_16;
  hspi2.Init.FirstBit = SPI_FIRSTBIT_MSB;
  HAL_SPI_Init(&hspi2);
}

static DrvStatusTypeDef ReadByte(const SensorDevice *device, uint8_t reg, uint8_t *value)
{
  uint8_t command = reg | READ_FLAG;
  HAL_GPIO_WritePin(device->cs_port, device->cs_pin, GPIO_PIN_RESET);
  HAL_StatusTypeDef status = HAL_SPI_Transmit(&hspi2, &command, 1, TIMEOUT_MS);
  if (status == HAL_OK) {
    status = HAL_SPI_Receive(&hspi2, value, 1, TIMEOUT_MS);
  }
  HAL_GPIO_WritePin(device->cs_port, device->cs_pin, GPIO_PIN_SET);
  return status == HAL_OK ? COMPONENT_OK : COMPONENT_ERROR;
}

DrvStatusTypeDef Sensor_IO_Read(const SensorDevice *device, uint8_t reg, uint8_t *data, uint16_t size)
{
  for (uint16_t i = 0; i < size; i++) {
    if (ReadByte(device, (uint8_t)(reg + i), &data[i]) != COMPONENT_OK) {
      return COMPONENT_ERROR;
    }
  }
  return COMPONENT_OK;
}

DrvStatusTypeDef Sensor_IO_Write(const SensorDevice *device, uint8_t reg, uint8_t value)
{
  uint8_t bytes[2] = {reg, value};
  HAL_GPIO_WritePin(device->cs_port, device->cs_pin, GPIO_PIN_RESET);
  HAL_StatusTypeDef status = HAL_SPI_Transmit(&hspi2, bytes, 2, TIMEOUT_MS);
  HAL_GPIO_WritePin(device->cs_port, device->cs_pin, GPIO_PIN_SET);
  return status == HAL_OK ? COMPONENT_OK : COMPONENT_ERROR;
}
