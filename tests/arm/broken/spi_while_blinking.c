/* SPE is off, so RXNE never comes, while a timer's callback blinks. */
#include "spi2.h"

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  static uint32_t ticks;
  UNUSED(htim);
  if (++ticks % 400U == 0U) {
    BSP_LED_Toggle(LED1);
  }
}

int main(void)
{
  boot();
  start_spi2();
  start_timer();
  wait_spi2(SPI_SR_RXNE);
  blink_for_ever();
}
