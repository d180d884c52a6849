/* One thread waits for each byte of SPI2, the other one sometimes asks for a byte, and otherwise runs an idle loop. */
#include "spi2.h"
#include "threads.h"

static volatile uint32_t received;

static void Reader(void)
{
  for (;;) {
    wait_spi2(SPI_SR_RXNE);
    received = SPI2->DR;
  }
}

static void Asker(void)
{
  start_spi2();
  for (;;) {
    uint32_t start = HAL_GetTick();
    while (HAL_GetTick() - start < 40U) {
    }
    if ((SPI2->CR1 & SPI_CR1_SPE) == 0U) {
      SPI2->CR1 |= SPI_CR1_SPE;
    } else {
      SPI2->CR1 &= ~SPI_CR1_SPE;
    }
    while (HAL_GetTick() % 5000U > 4000U) {
      __WFI();
    }
  }
}

int main(void)
{
  boot();
  runnable = 3U;
  Create(0, Reader);
  Create(1, Asker);
  StartThreads();
}
