/* The HAL is given the 7-bit address, and whether anybody answered is not looked at. */
#include "boot.h"

uint8_t id;

int main(void)
{
  boot();
  while (1) {
    HAL_I2C_Mem_Read(&hi2c2, 0x6B, 0x0F, I2C_MEMADD_SIZE_8BIT, &id, 1, 100);
    HAL_Delay(10);
    BSP_LED_Toggle(LED1);
  }
}
