/* SPI2 on one data line at 42 MHz / 16, without a driver. */
#ifndef SPI2_H
#define SPI2_H

#include "boot.h"

#define SPI2_RECEIVES 0x831FU /* BIDIMODE, SSM, SSI, prescaler 16, MSTR, mode 3 */

static inline void start_spi2(void)
{
  GPIO_InitTypeDef pins = {
      .Pin = GPIO_PIN_13 | GPIO_PIN_15,
      .Mode = GPIO_MODE_AF_PP,
      .Speed = GPIO_SPEED_FREQ_HIGH,
      .Alternate = GPIO_AF5_SPI2,
  };
  HAL_GPIO_Init(GPIOB, &pins);
  __HAL_RCC_SPI2_CLK_ENABLE();
  SPI2->CR1 = SPI2_RECEIVES;
}

static inline void wait_spi2(uint32_t flag)
{
  while ((SPI2->SR & flag) == 0U) {
  }
}

static inline void send_spi2(uint8_t byte)
{
  *(volatile uint8_t *)&SPI2->DR = byte;
}

#endif
