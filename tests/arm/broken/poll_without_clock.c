/* A flag of a block without clock is waited for, without a time-out. */
#include "boot.h"

static void sendStart(void)
{
  RCC->APB1ENR &= ~RCC_APB1ENR_I2C2EN;
  I2C2->CR1 |= I2C_CR1_PE;
  I2C2->CR1 |= I2C_CR1_START;
  while ((I2C2->SR1 & I2C_SR1_SB) == 0U) {
  }
}

int main(void)
{
  boot();
  sendStart();
  blink_for_ever();
}
