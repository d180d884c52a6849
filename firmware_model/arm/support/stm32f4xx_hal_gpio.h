/* Pins (RM0368 section 8). */
#ifndef STM32F4XX_HAL_GPIO_H
#define STM32F4XX_HAL_GPIO_H

#include "stm32f4xx_hal_def.h"

typedef struct {
  uint32_t Pin; /* one or more GPIO_PIN_x */
  uint32_t Mode;
  uint32_t Pull;
  uint32_t Speed;
  uint32_t Alternate; /* GPIO_AFx_..., used in the AF modes only */
} GPIO_InitTypeDef;

typedef enum { GPIO_PIN_RESET = 0, GPIO_PIN_SET = 1 } GPIO_PinState;

#define GPIO_PIN_0 0x0001U
#define GPIO_PIN_1 0x0002U
#define GPIO_PIN_2 0x0004U
#define GPIO_PIN_3 0x0008U
#define GPIO_PIN_4 0x0010U
#define GPIO_PIN_5 0x0020U
#define GPIO_PIN_6 0x0040U
#define GPIO_PIN_7 0x0080U
#define GPIO_PIN_8 0x0100U
#define GPIO_PIN_9 0x0200U
#define GPIO_PIN_10 0x0400U
#define GPIO_PIN_11 0x0800U
#define GPIO_PIN_12 0x1000U
#define GPIO_PIN_13 0x2000U
#define GPIO_PIN_14 0x4000U
#define GPIO_PIN_15 0x8000U

#define GPIO_MODE_INPUT 0x00U
#define GPIO_MODE_OUTPUT_PP 0x01U
#define GPIO_MODE_AF_PP 0x02U
#define GPIO_MODE_ANALOG 0x03U
#define GPIO_MODE_OUTPUT_OD 0x11U
#define GPIO_MODE_AF_OD 0x12U

#define GPIO_NOPULL 0U
#define GPIO_PULLUP 1U
#define GPIO_PULLDOWN 2U

#define GPIO_SPEED_FREQ_LOW 0U
#define GPIO_SPEED_FREQ_MEDIUM 1U
#define GPIO_SPEED_FREQ_HIGH 2U
#define GPIO_SPEED_FREQ_VERY_HIGH 3U

#define GPIO_AF4_I2C2 4U
#define GPIO_AF5_SPI2 5U
#define GPIO_AF7_USART1 7U
#define GPIO_AF9_I2C2 9U

#define __HAL_RCC_GPIOA_CLK_ENABLE() HAL_RCC_Enable(&RCC->AHB1ENR, RCC_AHB1ENR_GPIOAEN)
#define __HAL_RCC_GPIOB_CLK_ENABLE() HAL_RCC_Enable(&RCC->AHB1ENR, RCC_AHB1ENR_GPIOBEN)
#define __HAL_RCC_GPIOC_CLK_ENABLE() HAL_RCC_Enable(&RCC->AHB1ENR, RCC_AHB1ENR_GPIOCEN)

/* The port's clock must be on. */
void HAL_GPIO_Init(GPIO_TypeDef *GPIOx, const GPIO_InitTypeDef *GPIO_Init);

GPIO_PinState HAL_GPIO_ReadPin(GPIO_TypeDef *GPIOx, uint16_t GPIO_Pin);
void HAL_GPIO_WritePin(GPIO_TypeDef *GPIOx, uint16_t GPIO_Pin, GPIO_PinState PinState);

/* Reads ODR and writes BSRR, so that an interrupt's write to another pin of the port is not
 * lost. */
void HAL_GPIO_TogglePin(GPIO_TypeDef *GPIOx, uint16_t GPIO_Pin);

#endif
