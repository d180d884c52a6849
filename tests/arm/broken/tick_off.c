/* The tick is suspended and not resumed before HAL_Delay. */
#include "boot.h"

int main(void)
{
  boot();
  SysTick->CTRL &= ~SysTick_CTRL_TICKINT;
  HAL_Delay(10);
  blink_for_ever();
}
