/* What every broken program here begins with; the mistake is in its own file. */
#ifndef BOOT_H
#define BOOT_H

#include "lab3.h"

static inline void boot(void)
{
  HAL_Init();
  SystemClock_Config();
  MX_GPIO_Init();
  MX_USART1_UART_Init();
  MX_SensorBus_Init();
  BSP_LED_Init(LED1);
  BSP_LED_Init(LED2);
}

static inline void start_timer(void)
{
  MX_TIM9_Init();
  HAL_TIM_Base_Start_IT(&htim9);
}

static inline void blink_for_ever(void)
{
  while (1) {
    HAL_Delay(100);
    BSP_LED_Toggle(LED1);
  }
}

#endif
