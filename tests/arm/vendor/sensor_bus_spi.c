/* The sensors on SPI2 as on the real board, every register or burst one message. */
#include "sensor_bus.h"
#include "vendor_spi.h"

#define READ_FLAG 0x80U

static void InitChipSelect(GPIO_TypeDef *port, uint16_t number)
{
  const GPIO_InitTypeDef pin = {.Pin = number, .Mode = GPIO_MODE_OUTPUT_PP, .Speed = GPIO_SPEED_FREQ_HIGH};
  HAL_GPIO_WritePin(port, number, GPIO_PIN_SET);
  HAL_GPIO_Init(port, &pin);
}

void MX_SensorBus_Init(void)
{
  const GPIO_InitTypeDef pins = {
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
  Spi_InitThreeWires(SPI2);
}

DrvStatusTypeDef Sensor_IO_Read(const SensorDevice *device, uint8_t reg, uint8_t *data, uint16_t size)
{
  HAL_GPIO_WritePin(device->cs_port, device->cs_pin, GPIO_PIN_RESET);
  Spi_Send(SPI2, reg | READ_FLAG);
  Spi_ReceiveBytes(SPI2, data, size);
  HAL_GPIO_WritePin(device->cs_port, device->cs_pin, GPIO_PIN_SET);
  return COMPONENT_OK;
}

DrvStatusTypeDef Sensor_IO_Write(const SensorDevice *device, uint8_t reg, uint8_t value)
{
  HAL_GPIO_WritePin(device->cs_port, device->cs_pin, GPIO_PIN_RESET);
  Spi_Send(SPI2, reg);
  Spi_Send(SPI2, value);
  HAL_GPIO_WritePin(device->cs_port, device->cs_pin, GPIO_PIN_SET);
  return COMPONENT_OK;
}
