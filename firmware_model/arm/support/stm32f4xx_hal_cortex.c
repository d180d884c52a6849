/* Interrupt controller and SysTick (ARMv7-M ARM B3.3, B3.4). */
#include "stm32f4xx_hal_cortex.h"

#define PRIORITY_SHIFT 4 /* the STM32F401 implements only the upper four bits of a priority byte */
#define SYSTICK_MAX 0x1000000U

void HAL_NVIC_SetPriorityGrouping(uint32_t PriorityGroup)
{
  SCB->AIRCR = SCB_AIRCR_VECTKEY | (PriorityGroup << SCB_AIRCR_PRIGROUP_Pos);
}

void HAL_NVIC_SetPriority(IRQn_Type IRQn, uint32_t PreemptPriority, uint32_t SubPriority)
{
  uint8_t priority = (uint8_t)((PreemptPriority | SubPriority) << PRIORITY_SHIFT);
  if (IRQn < 0) {
    SCB->SHP[(uint32_t)IRQn + 12U] = priority; /* SysTick is IRQ -1, exception 15: byte 11 of SHPR */
  } else {
    NVIC->IP[IRQn] = priority;
  }
}

void HAL_NVIC_EnableIRQ(IRQn_Type IRQn) { NVIC->ISER[(uint32_t)IRQn >> 5] = 1U << ((uint32_t)IRQn & 31U); }

void HAL_NVIC_DisableIRQ(IRQn_Type IRQn)
{
  NVIC->ICER[(uint32_t)IRQn >> 5] = 1U << ((uint32_t)IRQn & 31U);
  __DSB();
  __ISB();
}

void HAL_NVIC_SystemReset(void)
{
  __DSB();
  SCB->AIRCR = SCB_AIRCR_VECTKEY | (NVIC_PRIORITYGROUP_4 << SCB_AIRCR_PRIGROUP_Pos) | SCB_AIRCR_SYSRESETREQ;
  __DSB();
  for (;;) {
  }
}

uint32_t HAL_SYSTICK_Config(uint32_t TicksNumb)
{
  if (TicksNumb - 1U >= SYSTICK_MAX) {
    return 1;
  }
  SysTick->LOAD = TicksNumb - 1U;
  SysTick->VAL = 0;
  SysTick->CTRL = SysTick_CTRL_CLKSOURCE | SysTick_CTRL_TICKINT | SysTick_CTRL_ENABLE;
  return 0;
}
