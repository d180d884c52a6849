/* The part of the HAL that the lab uses, with ST's names, arguments and behaviour (V1.6.0). The code is new and much
 * smaller.
 *
 * Decision: this layer has only the functions that a lab program calls: polled transfers, one timer interrupt, pins,
 * clocks. ST's HAL was rejected: it has 60 000 lines and another licence. A program for this layer also compiles with
 * ST's HAL, without changes.
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

/* Enables the caches, four bits of pre-emption priority, and SysTick at 1 kHz. Call it first. */
HAL_StatusTypeDef HAL_Init(void);

/* Starts the 1 kHz SysTick from SystemCoreClock with this priority; HAL_RCC_ClockConfig calls it again. */
HAL_StatusTypeDef HAL_InitTick(uint32_t TickPriority);

/* Called from SysTick_Handler. */
void HAL_IncTick(void);

/* Waits until Delay ticks have been counted: between Delay - 1 and Delay milliseconds, as V1.6.0 does. */
void HAL_Delay(uint32_t Delay);

#endif
