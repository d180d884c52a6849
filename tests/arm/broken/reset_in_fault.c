/* A fault's handler resets the chip, which so goes on as if nothing had happened. */
#include "boot.h"

#define AIRCR (*(volatile uint32_t *)0xE000ED0CU)

static void storeReading(volatile int32_t *into) { *into = 44; }

void HardFault_Handler(void)
{
  AIRCR = 0x05FA0004U;
  while (1) {
  }
}

int main(void)
{
  boot();
  HAL_Delay(30);
  storeReading((volatile int32_t *)0x60000000U);
  blink_for_ever();
}
