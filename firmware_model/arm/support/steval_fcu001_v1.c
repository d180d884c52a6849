/* The board's two LEDs. */
#include "steval_fcu001_v1.h"

static const uint16_t pins[] = {[LED1] = GPIO_PIN_5, [LED2] = GPIO_PIN_4};

void BSP_LED_Init(Led_TypeDef Led)
{
  const GPIO_InitTypeDef pin = {.Pin = pins[Led], .Mode = GPIO_MODE_OUTPUT_PP, .Pull = GPIO_NOPULL};
  HAL_GPIO_Init(GPIOB, &pin);
}

void BSP_LED_On(Led_TypeDef Led) { HAL_GPIO_WritePin(GPIOB, pins[Led], GPIO_PIN_RESET); }

void BSP_LED_Off(Led_TypeDef Led) { HAL_GPIO_WritePin(GPIOB, pins[Led], GPIO_PIN_SET); }

void BSP_LED_Toggle(Led_TypeDef Led) { HAL_GPIO_TogglePin(GPIOB, pins[Led]); }
