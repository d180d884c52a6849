/* The trap for divisions by zero is on. */
#include "boot.h"

#define SCB_CCR_DIV_0_TRP (1U << 4)

static volatile int32_t samples;

static int32_t average(int32_t sum) { return sum / samples; }

int main(void)
{
  boot();
  SCB->CCR |= SCB_CCR_DIV_0_TRP;
  volatile int32_t result = average(1000);
  (void)result;
  blink_for_ever();
}
