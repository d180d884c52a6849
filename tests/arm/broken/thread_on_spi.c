/* The only thread that can run waits for a byte that it did not ask for. */
#include "spi2.h"
#include "threads.h"

static void Reader(void)
{
  start_spi2();
  SPI2->CR1 |= SPI_CR1_BIDIOE;
  SPI2->CR1 |= SPI_CR1_SPE;
  wait_spi2(SPI_SR_RXNE);
  blink_for_ever();
}

int main(void)
{
  boot();
  Create(0, Reader);
  StartThreads();
}
