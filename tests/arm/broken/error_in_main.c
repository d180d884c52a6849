/* The callback works on; main has ended in Error_Handler. */
#include "boot.h"

AxesRaw_TypeDef acc;

int main(void)
{
  boot();
  initializeAllSensors();
  start_timer();
  HAL_Delay(5); /* some ticks */
  Error_Handler();
}

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  LSM6DSL_X_GetAxes(&acc);
}
