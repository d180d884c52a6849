/* SPI byte by byte (RM0368 20.3.3, 20.3.4, 20.3.8). */
#include "vendor_spi.h"

#define MASTER (SPI_MODE_MASTER | SPI_NSS_SOFT)

void Spi_InitThreeWires(SPI_TypeDef *regs)
{
  regs->CR1 = MASTER | SPI_DIRECTION_1LINE | SPI_POLARITY_HIGH | SPI_PHASE_2EDGE | SPI_BAUDRATEPRESCALER_16;
  regs->CR2 = 0;
}

void Spi_InitFullDuplex(SPI_TypeDef *regs)
{
  regs->CR1 = MASTER | SPI_BAUDRATEPRESCALER_16;
  regs->CR2 = 0;
  regs->CR1 |= SPI_CR1_SPE;
}

void Spi_Send(SPI_TypeDef *regs, uint8_t value)
{
  regs->CR1 |= SPI_CR1_BIDIOE;
  regs->CR1 |= SPI_CR1_SPE;
  while ((regs->SR & SPI_SR_TXE) != SPI_SR_TXE) {
  }
  *(volatile uint8_t *)&regs->DR = value;
  while ((regs->SR & SPI_SR_TXE) != SPI_SR_TXE) {
  }
  while ((regs->SR & SPI_SR_BSY) == SPI_SR_BSY) {
  }
  regs->CR1 &= ~SPI_CR1_SPE;
}

#define FOUR_DSB "dsb\n\tdsb\n\tdsb\n\tdsb\n\t"
#define SIXTEEN_DSB FOUR_DSB FOUR_DSB FOUR_DSB FOUR_DSB

/* A listening master clocks as long as SPE is set: it is cleared in the second bit, so one byte comes. */
static uint8_t ReceiveByte(SPI_TypeDef *regs)
{
  __disable_irq();
  regs->CR1 |= SPI_CR1_SPE;
  __asm volatile(SIXTEEN_DSB SIXTEEN_DSB SIXTEEN_DSB ::: "memory");
  regs->CR1 &= ~SPI_CR1_SPE;
  __enable_irq();
  while ((regs->SR & SPI_SR_RXNE) != SPI_SR_RXNE) {
  }
  uint8_t value = *(volatile uint8_t *)&regs->DR;
  while ((regs->SR & SPI_SR_BSY) == SPI_SR_BSY) {
  }
  return value;
}

void Spi_ReceiveBytes(SPI_TypeDef *regs, uint8_t *data, uint32_t size)
{
  regs->CR1 &= ~SPI_CR1_BIDIOE;
  for (; size > 0U; size--) {
    *data++ = ReceiveByte(regs);
  }
  regs->CR1 |= SPI_CR1_BIDIOE;
}

uint8_t Spi_Exchange(SPI_TypeDef *regs, uint8_t value)
{
  while ((regs->SR & SPI_SR_TXE) != SPI_SR_TXE) {
  }
  *(volatile uint8_t *)&regs->DR = value;
  while ((regs->SR & SPI_SR_RXNE) != SPI_SR_RXNE) {
  }
  uint8_t received = *(volatile uint8_t *)&regs->DR;
  while ((regs->SR & SPI_SR_BSY) == SPI_SR_BSY) {
  }
  return received;
}
