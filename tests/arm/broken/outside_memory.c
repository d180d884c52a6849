/* The callback writes behind the end of RAM, while main prints: frames of earlier interrupts lie above its own. */
#include "boot.h"

static volatile uint32_t *next = (volatile uint32_t *)0x20010000;

int main(void)
{
  boot();
  start_timer();
  for (;;) {
    PRINTF("main is here, and says so at some length, for the callback to come while this is being printed\n");
  }
}

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  static int calls;
  UNUSED(htim);
  if (++calls == 3) {
    *next = 0;
  }
}
