/* HAL_Delay in the timer's callback, with SysTick less urgent than the timer: the tick stands still. */
#include "boot.h"

int main(void)
{
  boot();
  HAL_NVIC_SetPriority(SysTick_IRQn, 15, 0);
  start_timer();
  blink_for_ever();
}

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  HAL_Delay(1);
}
