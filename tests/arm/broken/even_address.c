/* A function is called by its address without the Thumb bit. */
#include "boot.h"

static void turnOn(void) { BSP_LED_On(LED2); }

static void callByAddress(uint32_t address)
{
  void (*function)(void) = (void (*)(void))address;
  function();
}

int main(void)
{
  boot();
  callByAddress((uint32_t)turnOn & ~1U);
  blink_for_ever();
}
