/* Settings before main(): floating-point unit, vector table, clocks as after reset. */
#include "stm32f4xx_hal_rcc.h"

uint32_t SystemCoreClock = HSI_VALUE;

void SystemInit(void);

void SystemInit(void)
{
  SCB->CPACR |= SCB_CPACR_CP10_CP11_FULL;
  __DSB();
  __ISB();
  /* A debugger may start the program on a chip whose PLL already runs. */
  RCC->CR |= RCC_CR_HSION;
  RCC->CFGR = 0;
  RCC->CR &= ~(RCC_CR_HSEON | RCC_CR_CSSON | RCC_CR_PLLON);
  RCC->PLLCFGR = RCC_PLLCFGR_RESET;
  RCC->CR &= ~RCC_CR_HSEBYP;
  RCC->CIR = 0;
  SCB->VTOR = FLASH_BASE;
}
