/* Start-up of the HAL and its millisecond tick. */
#include "stm32f4xx_hal.h"

static volatile uint32_t uwTick;

HAL_StatusTypeDef HAL_Init(void)
{
  FLASH->ACR |= FLASH_ACR_ICEN | FLASH_ACR_DCEN | FLASH_ACR_PRFTEN;
  HAL_NVIC_SetPriorityGrouping(NVIC_PRIORITYGROUP_4);
  return HAL_InitTick(TICK_INT_PRIORITY);
}

HAL_StatusTypeDef HAL_InitTick(uint32_t TickPriority)
{
  HAL_SYSTICK_Config(SystemCoreClock / 1000U);
  HAL_NVIC_SetPriority(SysTick_IRQn, TickPriority, 0);
  return HAL_OK;
}

void HAL_IncTick(void) { uwTick++; }

uint32_t HAL_GetTick(void) { return uwTick; }

void HAL_Delay(uint32_t Delay)
{
  uint32_t tickstart = HAL_GetTick();
  while (HAL_GetTick() - tickstart < Delay) {
  }
}
