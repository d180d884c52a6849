/* The timer's callback stores a reading through a pointer that nobody has set. */
#include "boot.h"

typedef struct {
  int32_t count;
  AxesRaw_TypeDef latest;
} Sample;

static Sample *sample;

static void storeReading(Sample *into)
{
  into->latest.AXIS_X = 44;
}

int main(void)
{
  boot();
  start_timer();
  blink_for_ever();
}

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  storeReading(sample);
}
