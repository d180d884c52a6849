/* Interrupts are switched off and not on again before HAL_Delay. */
#include "boot.h"

int main(void)
{
  boot();
  __disable_irq();
  HAL_Delay(10);
  __enable_irq();
  blink_for_ever();
}
