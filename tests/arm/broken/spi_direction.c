/* Bytes are sent in the receive direction (BIDIOE = 0): TXE does not come back. */
#include "spi2.h"

int main(void)
{
  boot();
  start_spi2();
  SPI2->CR1 |= SPI_CR1_SPE;
  for (int n = 0; n < 2; n++) {
    wait_spi2(SPI_SR_TXE);
    send_spi2(0x8F);
  }
  wait_spi2(SPI_SR_TXE);
  blink_for_ever();
}
