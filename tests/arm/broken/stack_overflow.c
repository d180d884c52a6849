/* A recursion that looks for its end in the wrong direction. */
#include "boot.h"

static uint32_t sumFrom(uint32_t first)
{
  volatile uint32_t scratch[16] = {first};
  return first == 101U ? 0U : scratch[0] + sumFrom(first - 1U);
}

int main(void)
{
  boot();
  volatile uint32_t sum = sumFrom(100);
  (void)sum;
  blink_for_ever();
}
