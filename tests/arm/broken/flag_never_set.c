/* main waits for a flag that nobody sets. */
#include "boot.h"

volatile uint8_t dataReady;

static void waitForData(void)
{
  while (!dataReady) {
  }
}

int main(void)
{
  boot();
  waitForData();
  blink_for_ever();
}
