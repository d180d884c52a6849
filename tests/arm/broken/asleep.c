/* The tick is switched off before the core goes to sleep. */
#include "boot.h"

int main(void)
{
  boot();
  SysTick->CTRL = 0;
  while (1) {
    __WFI();
  }
}
