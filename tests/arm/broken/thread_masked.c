/* With interrupts off, a thread waits for another thread. */
#include "threads.h"

static volatile uint32_t dataReady;

static void Producer(void)
{
  for (;;) {
    dataReady = 1;
  }
}

static void Consumer(void)
{
  __disable_irq();
  while (dataReady == 0U) {
  }
  __enable_irq();
  blink_for_ever();
}

int main(void)
{
  boot();
  runnable = 3U;
  Create(0, Consumer);
  Create(1, Producer);
  StartThreads();
}
