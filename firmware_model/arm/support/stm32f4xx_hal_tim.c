/* A timer as a periodic interrupt (RM0368 14.4). */
#include "stm32f4xx_hal_tim.h"

HAL_StatusTypeDef HAL_TIM_Base_Init(TIM_HandleTypeDef *htim)
{
  TIM_TypeDef *regs = htim->Instance;
  regs->CR1 = htim->Init.CounterMode | htim->Init.ClockDivision;
  regs->ARR = htim->Init.Period;
  regs->PSC = htim->Init.Prescaler;
  regs->EGR = TIM_EGR_UG;
  return HAL_OK;
}

HAL_StatusTypeDef HAL_TIM_Base_Start_IT(TIM_HandleTypeDef *htim)
{
  htim->Instance->DIER |= TIM_DIER_UIE;
  htim->Instance->CR1 |= TIM_CR1_CEN;
  return HAL_OK;
}

HAL_StatusTypeDef HAL_TIM_Base_Stop_IT(TIM_HandleTypeDef *htim)
{
  htim->Instance->DIER &= ~TIM_DIER_UIE;
  htim->Instance->CR1 &= ~TIM_CR1_CEN;
  return HAL_OK;
}

void HAL_TIM_IRQHandler(TIM_HandleTypeDef *htim)
{
  TIM_TypeDef *regs = htim->Instance;
  if ((regs->SR & TIM_SR_UIF) != 0U && (regs->DIER & TIM_DIER_UIE) != 0U) {
    regs->SR = ~TIM_SR_UIF; /* cleared by writing 0 */
    HAL_TIM_PeriodElapsedCallback(htim);
  }
}

__weak void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim) { UNUSED(htim); }
