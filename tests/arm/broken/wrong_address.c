/* The LSM6DSL is addressed as if its SA0 pin were low. */
#include "boot.h"

#define LSM6DSL_ADDRESS (0x6A << 1)

static void initializeAccelerometer(void)
{
  uint8_t id = 0;
  if (HAL_I2C_Mem_Read(&hi2c2, LSM6DSL_ADDRESS, 0x0F, I2C_MEMADD_SIZE_8BIT, &id, 1, 100) != HAL_OK) {
    Error_Handler();
  }
}

int main(void)
{
  boot();
  initializeAccelerometer();
  blink_for_ever();
}
