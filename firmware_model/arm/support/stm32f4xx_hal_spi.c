/* SPI on three wires (RM0368 20.3.4, "1 clock and 1 bidirectional data wire").
 *
 * While SPE is set, a receiving master with one data wire generates clocks for byte after byte. If
 * the software clears SPE during a byte, this byte is the last one and is received whole (RM0368
 * 20.3.8, "Disabling the SPI": wait one SPI clock cycle, then clear SPE). Decision: this code
 * sets and clears SPE for each byte. Setting SPE for a whole block was rejected, because an interrupt could
 * then cause an overrun.
 *
 * The wait is 64 DSB, at least 64 cycles of 84 MHz. A bit takes 32 cycles at prescaler 16 on
 * APB1 (HCLK / 2), so SPE is cleared after the second of eight bits. At prescalers 8 and 32 SPE is
 * still cleared inside the byte.
 *
 * CR1 is always written as a whole. Besides the settings, this code sets only SPE and BIDIOE.
 */
#include "stm32f4xx_hal.h"

static HAL_StatusTypeDef WaitFor(SPI_TypeDef *regs, uint32_t flag, uint32_t value, uint32_t tickstart,
                                 uint32_t timeout_ms)
{
  while ((regs->SR & flag) != value) {
    if (HAL_Expired(tickstart, timeout_ms)) {
      return HAL_TIMEOUT;
    }
  }
  return HAL_OK;
}

/* CR1 while the bus is idle, with the direction "receive". */
static uint32_t Settings(const SPI_HandleTypeDef *hspi)
{
  const SPI_InitTypeDef *init = &hspi->Init;
  return init->Mode | init->Direction | init->DataSize | init->CLKPolarity | init->CLKPhase | init->NSS |
         init->BaudRatePrescaler | init->FirstBit;
}

HAL_StatusTypeDef HAL_SPI_Init(SPI_HandleTypeDef *hspi)
{
  if (hspi->Init.Direction != SPI_DIRECTION_1LINE) {
    return HAL_ERROR;
  }
  hspi->Instance->CR1 = Settings(hspi);
  hspi->Instance->CR2 = 0;
  hspi->State = HAL_SPI_STATE_READY;
  return HAL_OK;
}

static HAL_StatusTypeDef SendByte(SPI_TypeDef *regs, uint8_t byte, uint32_t tickstart, uint32_t timeout_ms)
{
  HAL_StatusTypeDef status = WaitFor(regs, SPI_SR_TXE, SPI_SR_TXE, tickstart, timeout_ms);
  if (status == HAL_OK) {
    *(volatile uint8_t *)&regs->DR = byte;
  }
  return status;
}

HAL_StatusTypeDef HAL_SPI_Transmit(SPI_HandleTypeDef *hspi, const uint8_t *pData, uint16_t Size, uint32_t Timeout)
{
  if (hspi->State != HAL_SPI_STATE_READY) {
    return HAL_BUSY;
  }
  SPI_TypeDef *regs = hspi->Instance;
  uint32_t sending = Settings(hspi) | SPI_CR1_BIDIOE;
  uint32_t tickstart = HAL_GetTick();
  HAL_StatusTypeDef status = HAL_OK;

  hspi->State = HAL_SPI_STATE_BUSY;
  regs->CR1 = sending; /* the direction is set before SPE, because a receiving master clocks as
                          soon as it is enabled */
  regs->CR1 = sending | SPI_CR1_SPE;
  for (; Size > 0U && status == HAL_OK; Size--) {
    status = SendByte(regs, *pData++, tickstart, Timeout);
  }
  if (status == HAL_OK) {
    status = WaitFor(regs, SPI_SR_TXE, SPI_SR_TXE, tickstart, Timeout);
  }
  if (status == HAL_OK) {
    status = WaitFor(regs, SPI_SR_BSY, 0, tickstart, Timeout);
  }
  hspi->State = HAL_SPI_STATE_READY;
  return status;
}

/* The lines do not use .rept, because the compiler counts lines to find out how far a branch over
 * these instructions must reach. */
#define EIGHT_DSB "dsb\n\tdsb\n\tdsb\n\tdsb\n\tdsb\n\tdsb\n\tdsb\n\tdsb\n\t"

/* SPE is set for 64 DSB: long enough for the byte to begin, too short for another one. */
static void ClockOneByte(SPI_TypeDef *regs, uint32_t idle)
{
  uint32_t primask = __get_PRIMASK();
  __disable_irq();
  regs->CR1 = idle | SPI_CR1_SPE;
  __asm volatile(EIGHT_DSB EIGHT_DSB EIGHT_DSB EIGHT_DSB EIGHT_DSB EIGHT_DSB EIGHT_DSB EIGHT_DSB ::: "memory");
  regs->CR1 = idle;
  __set_PRIMASK(primask);
}

HAL_StatusTypeDef HAL_SPI_Receive(SPI_HandleTypeDef *hspi, uint8_t *pData, uint16_t Size, uint32_t Timeout)
{
  if (hspi->State != HAL_SPI_STATE_READY) {
    return HAL_BUSY;
  }
  SPI_TypeDef *regs = hspi->Instance;
  uint32_t listening = Settings(hspi);
  uint32_t tickstart = HAL_GetTick();
  HAL_StatusTypeDef status = HAL_OK;

  hspi->State = HAL_SPI_STATE_BUSY;
  regs->CR1 = listening | SPI_CR1_BIDIOE; /* SPE is cleared before the direction changes, as in
                                             HAL_SPI_Transmit */
  regs->CR1 = listening;
  for (; Size > 0U && status == HAL_OK; Size--) {
    ClockOneByte(regs, listening);
    status = WaitFor(regs, SPI_SR_RXNE, SPI_SR_RXNE, tickstart, Timeout);
    if (status == HAL_OK) {
      *pData++ = *(volatile uint8_t *)&regs->DR;
      status = WaitFor(regs, SPI_SR_BSY, 0, tickstart, Timeout);
    }
  }
  hspi->State = HAL_SPI_STATE_READY;
  return status;
}
