/* Pins (RM0368 section 8.4). */
#include "stm32f4xx_hal_gpio.h"

#define MODE_BITS 0x3U
#define OPEN_DRAIN 0x10U
#define BSRR_RESET_SHIFT 16

static void SetField(volatile uint32_t *reg, uint32_t index, uint32_t width, uint32_t value)
{
  uint32_t shift = index * width;
  uint32_t mask = ((1U << width) - 1U) << shift;
  *reg = (*reg & ~mask) | (value << shift);
}

static void InitPin(GPIO_TypeDef *port, uint32_t pin, const GPIO_InitTypeDef *init)
{
  uint32_t mode = init->Mode & MODE_BITS;

  /* The mode is set last: the pin must not drive before its other settings are complete. */
  if (mode == GPIO_MODE_AF_PP) {
    SetField(&port->AFR[pin >> 3], pin & 7U, 4, init->Alternate);
  }
  if (mode == GPIO_MODE_AF_PP || mode == GPIO_MODE_OUTPUT_PP) {
    SetField(&port->OSPEEDR, pin, 2, init->Speed);
    SetField(&port->OTYPER, pin, 1, (init->Mode & OPEN_DRAIN) != 0U);
  }
  SetField(&port->PUPDR, pin, 2, init->Pull);
  SetField(&port->MODER, pin, 2, mode);
}

void HAL_GPIO_Init(GPIO_TypeDef *GPIOx, const GPIO_InitTypeDef *GPIO_Init)
{
  for (uint32_t pin = 0; pin < 16U; pin++) {
    if ((GPIO_Init->Pin & (1U << pin)) != 0U) {
      InitPin(GPIOx, pin, GPIO_Init);
    }
  }
}

GPIO_PinState HAL_GPIO_ReadPin(GPIO_TypeDef *GPIOx, uint16_t GPIO_Pin)
{
  return (GPIOx->IDR & GPIO_Pin) != 0U ? GPIO_PIN_SET : GPIO_PIN_RESET;
}

void HAL_GPIO_WritePin(GPIO_TypeDef *GPIOx, uint16_t GPIO_Pin, GPIO_PinState PinState)
{
  GPIOx->BSRR = PinState == GPIO_PIN_RESET ? (uint32_t)GPIO_Pin << BSRR_RESET_SHIFT : GPIO_Pin;
}

void HAL_GPIO_TogglePin(GPIO_TypeDef *GPIOx, uint16_t GPIO_Pin)
{
  uint32_t high = GPIOx->ODR & GPIO_Pin;
  GPIOx->BSRR = (high << BSRR_RESET_SHIFT) | (~high & GPIO_Pin);
}
