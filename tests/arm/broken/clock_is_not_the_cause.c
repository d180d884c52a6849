/* A byte is waited for that no sensor sends; that port H has no clock has nothing to do with it. */
#include "boot.h"

#define GPIOH_REGISTERS ((GPIO_TypeDef *)0x40021C00U)

static void waitForByte(void)
{
  while ((USART1->SR & USART_SR_RXNE) == 0U) {
  }
}

int main(void)
{
  boot();
  GPIOH_REGISTERS->ODR = 1U;
  waitForByte();
  blink_for_ever();
}
