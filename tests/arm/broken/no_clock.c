/* I2C2 is set up by hand, and its clock forgotten. */
#include "boot.h"

static void initializeI2C2(void)
{
  RCC->APB1ENR &= ~RCC_APB1ENR_I2C2EN;
  hi2c2.Instance = I2C2;
  hi2c2.Init.ClockSpeed = 400000;
  HAL_I2C_Init(&hi2c2);
}

static void initializeAccelerometer(void)
{
  uint8_t id = 0;
  if (HAL_I2C_Mem_Read(&hi2c2, 0x6B << 1, 0x0F, I2C_MEMADD_SIZE_8BIT, &id, 1, 100) != HAL_OK) {
    Error_Handler();
  }
}

int main(void)
{
  boot();
  initializeI2C2();
  initializeAccelerometer();
  blink_for_ever();
}
