/* Interrupt handlers of the lab. All others, and the faults, end in the start-up file's Default_Handler. */
#include "board.h"

void SysTick_Handler(void);
void TIM1_BRK_TIM9_IRQHandler(void);

void SysTick_Handler(void) { HAL_IncTick(); }

void TIM1_BRK_TIM9_IRQHandler(void) { HAL_TIM_IRQHandler(&htim9); }
