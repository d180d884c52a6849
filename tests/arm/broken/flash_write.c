/* A constant lies in flash, whatever a cast says. */
#include "boot.h"

static const int32_t offset[3] = {1, 2, 3};

static void calibrate(int32_t *values) { values[1] = 7; }

int main(void)
{
  boot();
  calibrate((int32_t *)offset);
  blink_for_ever();
}
