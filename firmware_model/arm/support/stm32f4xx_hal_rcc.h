/* Clocks (RM0368 section 6). */
#ifndef STM32F4XX_HAL_RCC_H
#define STM32F4XX_HAL_RCC_H

#include "stm32f4xx_hal_def.h"

#define HSE_VALUE 16000000U /* the board's crystal */
#define HSI_VALUE 16000000U

/* Frequency of the core and the AHB in Hz, updated by HAL_RCC_ClockConfig. */
extern uint32_t SystemCoreClock;

typedef struct {
  uint32_t PLLState;
  uint32_t PLLSource;
  uint32_t PLLM; /* 2..63: the divided input, 1 to 2 MHz */
  uint32_t PLLN; /* 192..432: the VCO, 192 to 432 MHz */
  uint32_t PLLP; /* 2, 4, 6 or 8: SYSCLK */
  uint32_t PLLQ; /* 2..15: 48 MHz for USB */
} RCC_PLLInitTypeDef;

typedef struct {
  uint32_t OscillatorType;
  uint32_t HSEState;
  uint32_t HSIState;
  RCC_PLLInitTypeDef PLL;
} RCC_OscInitTypeDef;

typedef struct {
  uint32_t ClockType;
  uint32_t SYSCLKSource;
  uint32_t AHBCLKDivider;
  uint32_t APB1CLKDivider;
  uint32_t APB2CLKDivider;
} RCC_ClkInitTypeDef;

#define RCC_OSCILLATORTYPE_HSE 1U
#define RCC_OSCILLATORTYPE_HSI 2U
#define RCC_HSE_OFF 0U
#define RCC_HSE_ON RCC_CR_HSEON
#define RCC_HSE_BYPASS (RCC_CR_HSEBYP | RCC_CR_HSEON)
#define RCC_HSI_OFF 0U
#define RCC_HSI_ON RCC_CR_HSION
#define RCC_PLL_NONE 0U
#define RCC_PLL_OFF 1U
#define RCC_PLL_ON 2U
#define RCC_PLLSOURCE_HSI 0U
#define RCC_PLLSOURCE_HSE RCC_PLLCFGR_PLLSRC_HSE
#define RCC_PLLP_DIV2 2U
#define RCC_PLLP_DIV4 4U
#define RCC_PLLP_DIV6 6U
#define RCC_PLLP_DIV8 8U

#define RCC_CLOCKTYPE_SYSCLK 1U
#define RCC_CLOCKTYPE_HCLK 2U
#define RCC_CLOCKTYPE_PCLK1 4U
#define RCC_CLOCKTYPE_PCLK2 8U
#define RCC_SYSCLKSOURCE_HSI 0U
#define RCC_SYSCLKSOURCE_HSE 1U
#define RCC_SYSCLKSOURCE_PLLCLK 2U
#define RCC_SYSCLK_DIV1 0U
#define RCC_SYSCLK_DIV2 8U
#define RCC_SYSCLK_DIV4 9U
#define RCC_HCLK_DIV1 0U
#define RCC_HCLK_DIV2 4U
#define RCC_HCLK_DIV4 5U

#define FLASH_LATENCY_0 0U
#define FLASH_LATENCY_1 1U
#define FLASH_LATENCY_2 2U

/* Each returns HAL_TIMEOUT if a ready flag is not set in time, for example without a crystal. */
HAL_StatusTypeDef HAL_RCC_OscConfig(const RCC_OscInitTypeDef *RCC_OscInitStruct);
HAL_StatusTypeDef HAL_RCC_ClockConfig(const RCC_ClkInitTypeDef *RCC_ClkInitStruct, uint32_t FLatency);

uint32_t HAL_RCC_GetSysClockFreq(void);
uint32_t HAL_RCC_GetHCLKFreq(void);
uint32_t HAL_RCC_GetPCLK1Freq(void);
uint32_t HAL_RCC_GetPCLK2Freq(void);

/* Switches a peripheral's clock on and waits until the clock runs. The read takes
 * the two cycles that the clock needs to start (RM0368 6.2.12). */
static inline void HAL_RCC_Enable(volatile uint32_t *enable_register, uint32_t bit)
{
  *enable_register |= bit;
  (void)*enable_register;
}

#define __HAL_RCC_PWR_CLK_ENABLE() HAL_RCC_Enable(&RCC->APB1ENR, RCC_APB1ENR_PWREN)
#define __HAL_RCC_SPI2_CLK_ENABLE() HAL_RCC_Enable(&RCC->APB1ENR, RCC_APB1ENR_SPI2EN)
#define __HAL_RCC_I2C2_CLK_ENABLE() HAL_RCC_Enable(&RCC->APB1ENR, RCC_APB1ENR_I2C2EN)
#define __HAL_RCC_USART1_CLK_ENABLE() HAL_RCC_Enable(&RCC->APB2ENR, RCC_APB2ENR_USART1EN)
#define __HAL_RCC_SYSCFG_CLK_ENABLE() HAL_RCC_Enable(&RCC->APB2ENR, RCC_APB2ENR_SYSCFGEN)
#define __HAL_RCC_TIM9_CLK_ENABLE() HAL_RCC_Enable(&RCC->APB2ENR, RCC_APB2ENR_TIM9EN)

#endif
