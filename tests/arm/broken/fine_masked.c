/* Nothing is wrong: interrupts are masked for a microsecond, around each look at what their handler counts. */
#include "boot.h"

static volatile uint32_t ticks;

static void mask_below(uint32_t basepri) { __asm volatile("msr basepri, %0" ::"r"(basepri) : "memory"); }

static uint32_t with_primask(void)
{
  __disable_irq();
  uint32_t seen = ticks;
  __enable_irq();
  return seen;
}

static uint32_t with_basepri(void)
{
  mask_below(0x10);
  uint32_t seen = ticks;
  mask_below(0);
  return seen;
}

int main(void)
{
  boot();
  start_timer();
  while (1) {
    uint32_t start = with_primask();
    while (with_primask() - start < 400) {
    }
    while (with_basepri() - start < 800) {
    }
    BSP_LED_Toggle(LED1);
  }
}

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  ticks++;
}
