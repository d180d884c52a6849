/* Nothing is wrong: start-up resets peripherals that have no clock yet, and the bus has a clock only while it works. */
#include "boot.h"

#define DMA1_S0CR (*(volatile uint32_t *)0x40026010U)

static void resetDma(void) { DMA1_S0CR &= ~1U; }

static uint8_t whoAmI(void)
{
  uint8_t id = 0;
  I2C2->CR2 = 42U;
  RCC->APB1ENR |= RCC_APB1ENR_I2C2EN;
  HAL_I2C_Mem_Read(&hi2c2, 0x6B << 1, 0x0F, I2C_MEMADD_SIZE_8BIT, &id, 1, 100);
  RCC->APB1ENR &= ~RCC_APB1ENR_I2C2EN;
  return id;
}

int main(void)
{
  resetDma();
  boot();
  while (1) {
    if (whoAmI() != 0x6A) {
      Error_Handler();
    }
    BSP_LED_Toggle(LED1);
    HAL_Delay(3);
  }
}
