/* Definitions that all parts of the HAL share: status codes, HAL_MAX_DELAY, ENABLE and DISABLE. */
#ifndef STM32F4XX_HAL_DEF_H
#define STM32F4XX_HAL_DEF_H

#include "stm32f401xc.h"

typedef enum { HAL_OK = 0, HAL_ERROR = 1, HAL_BUSY = 2, HAL_TIMEOUT = 3 } HAL_StatusTypeDef;

#define HAL_MAX_DELAY 0xFFFFFFFFU
#define ENABLE 1U
#define DISABLE 0U
#define __weak __attribute__((weak))
#define UNUSED(argument) ((void)(argument))

/* Ticks of 1 ms since HAL_Init; counted by the SysTick interrupt. */
uint32_t HAL_GetTick(void);

/* Returns 1 if more than timeout_ms have passed since tickstart. With HAL_MAX_DELAY the result
 * is always 0, with a time-out of 0 always 1. */
static inline int HAL_Expired(uint32_t tickstart, uint32_t timeout_ms)
{
  if (timeout_ms == HAL_MAX_DELAY) {
    return 0;
  }
  return timeout_ms == 0U || HAL_GetTick() - tickstart > timeout_ms;
}

#endif
