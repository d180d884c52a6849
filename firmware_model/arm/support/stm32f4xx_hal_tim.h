/* A timer as a periodic interrupt (RM0368 section 14). */
#ifndef STM32F4XX_HAL_TIM_H
#define STM32F4XX_HAL_TIM_H

#include "stm32f4xx_hal_def.h"

typedef struct {
  uint32_t Prescaler; /* the counter's clock is the timer's clock divided by Prescaler + 1 */
  uint32_t CounterMode;
  uint32_t Period; /* the counter overflows once in Period + 1 counts */
  uint32_t ClockDivision;
} TIM_Base_InitTypeDef;

typedef struct {
  TIM_TypeDef *Instance;
  TIM_Base_InitTypeDef Init;
} TIM_HandleTypeDef;

#define TIM_COUNTERMODE_UP 0U
#define TIM_CLOCKDIVISION_DIV1 0U

/* Loads the prescaler by an update event. As on the chip, UIF then stays set, and the first interrupt comes at once. */
HAL_StatusTypeDef HAL_TIM_Base_Init(TIM_HandleTypeDef *htim);

HAL_StatusTypeDef HAL_TIM_Base_Start_IT(TIM_HandleTypeDef *htim);
HAL_StatusTypeDef HAL_TIM_Base_Stop_IT(TIM_HandleTypeDef *htim);

/* Called from the timer's interrupt handler; calls the callback on an update. */
void HAL_TIM_IRQHandler(TIM_HandleTypeDef *htim);

/* Write this function in your program. The default one, which does nothing, is weak. */
void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim);

#endif
