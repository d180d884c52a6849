/* The interrupt of TIM3 is switched on; its handler's name is misspelt. */
#include "boot.h"

#define TIM3_IRQ ((IRQn_Type)29)
#define TIM3_REGISTERS ((TIM_TypeDef *)0x40000400U)
#define RCC_APB1ENR_TIM3EN (1U << 1)

void TIM3_IRQHandle(void);
void TIM3_IRQHandle(void) { TIM3_REGISTERS->SR = 0; }

int main(void)
{
  boot();
  RCC->APB1ENR |= RCC_APB1ENR_TIM3EN;
  TIM3_REGISTERS->ARR = 999;
  TIM3_REGISTERS->DIER = TIM_DIER_UIE;
  TIM3_REGISTERS->CR1 = TIM_CR1_CEN;
  HAL_NVIC_EnableIRQ(TIM3_IRQ);
  blink_for_ever();
}
