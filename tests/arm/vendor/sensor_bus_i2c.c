/* The sensors on I2C2, read in the program's own way. */
#include "lab.h"
#include "sensor_bus.h"

#define TIMEOUT_MS 100U
#define I2C2_PRIORITY 1U /* above the callback's, which waits for it */

static Dma receiver = {.controller = DMA1, .number = 2, .settings = 7U << DMA_CR_CHSEL_Pos | DMA_CR_MINC};
I2c i2c2 = {.regs = I2C2, .receiver = &receiver};

static void InitPin(uint16_t number, uint32_t alternate)
{
  const GPIO_InitTypeDef pin = {
      .Pin = number,
      .Mode = GPIO_MODE_AF_OD,
      .Pull = GPIO_PULLUP,
      .Speed = GPIO_SPEED_FREQ_HIGH,
      .Alternate = alternate,
  };
  HAL_GPIO_Init(GPIOB, &pin);
}

static void EnableInterrupt(IRQn_Type number)
{
  HAL_NVIC_SetPriority(number, I2C2_PRIORITY, 0);
  HAL_NVIC_EnableIRQ(number);
}

void MX_SensorBus_Init(void)
{
  I2C_HandleTypeDef settings = {
      .Instance = I2C2,
      .Init = {.ClockSpeed = 400000, .DutyCycle = I2C_DUTYCYCLE_2, .AddressingMode = I2C_ADDRESSINGMODE_7BIT},
  };
  InitPin(GPIO_PIN_10, GPIO_AF4_I2C2);
  InitPin(GPIO_PIN_3, GPIO_AF9_I2C2);
  HAL_RCC_Enable(&RCC->AHB1ENR, RCC_AHB1ENR_DMA1EN);
  __HAL_RCC_I2C2_CLK_ENABLE();
  HAL_I2C_Init(&settings);
  Dma_Init(&receiver);
  EnableInterrupt(I2C2_EV_IRQn);
  EnableInterrupt(I2C2_ER_IRQn);
  EnableInterrupt(DMA1_Stream2_IRQn);
}

void I2C2_EV_IRQHandler(void) { I2c_EV_IRQHandler(&i2c2); }
void I2C2_ER_IRQHandler(void) { I2c_ER_IRQHandler(&i2c2); }
void DMA1_Stream2_IRQHandler(void) { Dma_IRQHandler(&receiver); }

__weak HAL_StatusTypeDef Bus_Read(uint16_t device, uint8_t reg, uint8_t *data, uint16_t size)
{
  return I2c_Mem_Read(&i2c2, device, reg, data, size, TIMEOUT_MS);
}

DrvStatusTypeDef Sensor_IO_Read(const SensorDevice *device, uint8_t reg, uint8_t *data, uint16_t size)
{
  return Bus_Read(device->i2c_address, reg, data, size) == HAL_OK ? COMPONENT_OK : COMPONENT_ERROR;
}

DrvStatusTypeDef Sensor_IO_Write(const SensorDevice *device, uint8_t reg, uint8_t value)
{
  HAL_StatusTypeDef status = I2c_Mem_Write(&i2c2, device->i2c_address, reg, &value, 1, TIMEOUT_MS);
  return status == HAL_OK ? COMPONENT_OK : COMPONENT_ERROR;
}
