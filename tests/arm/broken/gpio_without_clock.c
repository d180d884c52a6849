/* A pin of port H is switched, and the port has no clock; the rest works. */
#include "boot.h"

#define GPIOH_REGISTERS ((GPIO_TypeDef *)0x40021C00U)

int main(void)
{
  boot();
  while (1) {
    GPIOH_REGISTERS->ODR ^= 1U;
    HAL_Delay(100);
  }
}
