/* A deep recursion comes back, but its stack has gone over the variables. */
#include "boot.h"

static uint8_t history[50 * 1024];

static uint32_t depth(uint32_t left)
{
  volatile uint8_t scratch[1024];
  scratch[0] = (uint8_t)left;
  HAL_Delay(2);
  return left == 0U ? scratch[0] : depth(left - 1U) + 1U;
}

int main(void)
{
  boot();
  history[0] = 1;
  depth(14);
  blink_for_ever();
}
