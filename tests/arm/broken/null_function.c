/* A callback is called that nobody has registered. */
#include "boot.h"

static void (*volatile onSample)(int32_t);

static void publish(int32_t value) { onSample(value); }

int main(void)
{
  boot();
  publish(44);
  blink_for_ever();
}
