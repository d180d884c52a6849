/* Nothing is wrong: all work is done in the callback, and main has nothing to do. */
#include "boot.h"

AxesRaw_TypeDef acc;

int main(void)
{
  boot();
  initializeAllSensors();
  start_timer();
  while (1) {
  }
}

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  LSM6DSL_X_GetAxes(&acc);
}
