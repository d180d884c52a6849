/* Interrupt controller and SysTick. */
#ifndef STM32F4XX_HAL_CORTEX_H
#define STM32F4XX_HAL_CORTEX_H

#include "stm32f4xx_hal_def.h"

#define NVIC_PRIORITYGROUP_4 3U /* four bits of pre-emption priority, none of sub-priority */
#define TICK_INT_PRIORITY 0U    /* above other interrupts, because their time-outs need the tick */

void HAL_NVIC_SetPriorityGrouping(uint32_t PriorityGroup);

/* Priority 0 (highest) to 15. With group 4, which the lab uses, the sub-priority has no bits. */
void HAL_NVIC_SetPriority(IRQn_Type IRQn, uint32_t PreemptPriority, uint32_t SubPriority);

void HAL_NVIC_EnableIRQ(IRQn_Type IRQn);
void HAL_NVIC_DisableIRQ(IRQn_Type IRQn);
void HAL_NVIC_SystemReset(void);

/* Interrupt every TicksNumb cycles of HCLK; returns 0, or 1 if the reload value has more than 24 bits. */
uint32_t HAL_SYSTICK_Config(uint32_t TicksNumb);

#endif
