/* Receives two bytes, the last one as in RM0368 20.3.8; then a timer's callback asks for each byte. */
#include "spi2.h"

static volatile uint32_t bytes, ticks;

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  if (++ticks % 800U == 0U) {
    SPI2->CR1 = SPI2_RECEIVES | SPI_CR1_SPE;
    SPI2->CR1 = SPI2_RECEIVES;
  }
}

int main(void)
{
  boot();
  start_spi2();
  SPI2->CR1 |= SPI_CR1_SPE;
  wait_spi2(SPI_SR_RXNE);
  for (volatile int n = 0; n < 8; n++) { /* one period of SCK or longer, less than a byte */
  }
  SPI2->CR1 &= ~SPI_CR1_SPE;
  bytes += SPI2->DR & 1U;
  wait_spi2(SPI_SR_RXNE);
  bytes += SPI2->DR & 1U;
  start_timer();
  for (;;) {
    wait_spi2(SPI_SR_RXNE);
    bytes += SPI2->DR & 1U;
    BSP_LED_Toggle(LED1);
  }
}
