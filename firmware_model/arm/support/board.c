/* The STEVAL-FCU001V1's clocks, serial line and 800 Hz timer. */
#include "board.h"

#define TIM9_PRIORITY 3U
#define TIM9_PRESCALER 83U
#define TIM9_PERIOD 1249U

UART_HandleTypeDef huart1;
TIM_HandleTypeDef htim9;

void SystemClock_Config(void)
{
  const RCC_OscInitTypeDef oscillator = {
      .OscillatorType = RCC_OSCILLATORTYPE_HSE,
      .HSEState = RCC_HSE_ON,
      .PLL = {.PLLState = RCC_PLL_ON,
              .PLLSource = RCC_PLLSOURCE_HSE,
              .PLLM = 16, /* 1 MHz */
              .PLLN = 336,
              .PLLP = RCC_PLLP_DIV4, /* 84 MHz */
              .PLLQ = 7},            /* 48 MHz */
  };
  const RCC_ClkInitTypeDef clocks = {
      .ClockType = RCC_CLOCKTYPE_SYSCLK | RCC_CLOCKTYPE_HCLK | RCC_CLOCKTYPE_PCLK1 | RCC_CLOCKTYPE_PCLK2,
      .SYSCLKSource = RCC_SYSCLKSOURCE_PLLCLK,
      .AHBCLKDivider = RCC_SYSCLK_DIV1,
      .APB1CLKDivider = RCC_HCLK_DIV2,
      .APB2CLKDivider = RCC_HCLK_DIV1,
  };

  __HAL_RCC_PWR_CLK_ENABLE();
  PWR->CR = (PWR->CR & ~PWR_CR_VOS) | PWR_CR_VOS_SCALE2; /* enough for 84 MHz (RM0368 5.4.1) */
  if (HAL_RCC_OscConfig(&oscillator) != HAL_OK || HAL_RCC_ClockConfig(&clocks, FLASH_LATENCY_2) != HAL_OK) {
    Error_Handler();
  }
}

void MX_GPIO_Init(void)
{
  __HAL_RCC_GPIOA_CLK_ENABLE();
  __HAL_RCC_GPIOB_CLK_ENABLE();
  __HAL_RCC_GPIOC_CLK_ENABLE();
}

void MX_USART1_UART_Init(void)
{
  const GPIO_InitTypeDef pins = {
      .Pin = GPIO_PIN_9 | GPIO_PIN_10,
      .Mode = GPIO_MODE_AF_PP,
      .Pull = GPIO_PULLUP,
      .Speed = GPIO_SPEED_FREQ_HIGH,
      .Alternate = GPIO_AF7_USART1,
  };
  HAL_GPIO_Init(GPIOA, &pins);

  __HAL_RCC_USART1_CLK_ENABLE();
  huart1.Instance = USART1;
  huart1.Init.BaudRate = 115200;
  huart1.Init.WordLength = UART_WORDLENGTH_8B;
  huart1.Init.StopBits = UART_STOPBITS_1;
  huart1.Init.Parity = UART_PARITY_NONE;
  huart1.Init.Mode = UART_MODE_TX_RX;
  huart1.Init.HwFlowCtl = UART_HWCONTROL_NONE;
  huart1.Init.OverSampling = UART_OVERSAMPLING_16;
  HAL_UART_Init(&huart1);
}

void MX_TIM9_Init(void)
{
  __HAL_RCC_TIM9_CLK_ENABLE();
  HAL_NVIC_SetPriority(TIM1_BRK_TIM9_IRQn, TIM9_PRIORITY, 0);
  HAL_NVIC_EnableIRQ(TIM1_BRK_TIM9_IRQn);
  htim9.Instance = TIM9;
  htim9.Init.Prescaler = TIM9_PRESCALER;
  htim9.Init.CounterMode = TIM_COUNTERMODE_UP;
  htim9.Init.Period = TIM9_PERIOD;
  htim9.Init.ClockDivision = TIM_CLOCKDIVISION_DIV1;
  HAL_TIM_Base_Init(&htim9);
}

void Error_Handler(void)
{
  for (;;) {
  }
}
