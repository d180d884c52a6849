/* The program resets the chip as soon as it runs: it never comes to its work. */
#include "boot.h"

#define AIRCR (*(volatile uint32_t *)0xE000ED0CU)

static void leaveBootloader(void) { AIRCR = 0x05FA0004U; }

int main(void)
{
  boot();
  leaveBootloader();
  blink_for_ever();
}
