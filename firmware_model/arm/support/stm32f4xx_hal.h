/* The HAL as the lab uses it: ST's names, arguments and behaviour (V1.6.0), written anew and much smaller.
 *
 * Decision: only what a lab program calls is here: polled transfers, one timer interrupt, pins, clocks. The road
 * not taken, ST's own HAL, is 60 000 lines under a licence of its own. Code written against this layer compiles
 * against ST's unchanged.
 */
#ifndef STM32F4XX_HAL_H
#define STM32F4XX_HAL_H

#include "stm32f4xx_hal_cortex.h"
#include "stm32f4xx_hal_def.h"
#include "stm32f4xx_hal_gpio.h"
#include "stm32f4xx_hal_i2c.h"
#include "stm32f4xx_hal_rcc.h"
#include "stm32f4xx_hal_spi.h"
#include "stm32f4xx_hal_tim.h"
#include "stm32f4xx_hal_uart.h"

/* Caches on, four bits of pre-emption priority, SysTick at 1 kHz. Call it first. */
HAL_StatusTypeDef HAL_Init(void);

/* Starts the 1 kHz SysTick from SystemCoreClock with this priority; HAL_RCC_ClockConfig calls it again. */
HAL_StatusTypeDef HAL_InitTick(uint32_t TickPriority);

/* Called from SysTick_Handler. */
void HAL_IncTick(void);

/* Waits until Delay ticks have been counted: between Delay - 1 and Delay milliseconds, as V1.6.0 does. */
void HAL_Delay(uint32_t Delay);

#endif
