/* The callback takes 2.1 ms; the timer calls it every 1.25 ms. */
#include "boot.h"

int main(void)
{
  boot();
  start_timer();
  blink_for_ever();
}

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  for (volatile uint32_t n = 0; n < 19500; n++) {
  }
}
