/* The only thread that can run is an idle loop: the work is done in a timer's callback, long after the last switch. */
#include "threads.h"

static void Idle(void)
{
  for (;;) {
  }
}

int main(void)
{
  boot();
  Create(0, Idle);
  StartThreads();
}
