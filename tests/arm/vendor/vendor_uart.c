/* The serial line by interrupts (RM0368 19.4) and by DMA (19.3.13). */
#include "vendor_uart.h"

#define ERRORS (USART_SR_PE | USART_SR_FE | USART_SR_NE | USART_SR_ORE)

__weak void Uart_TxCpltCallback(Uart *uart) { UNUSED(uart); }
__weak void Uart_RxHalfCpltCallback(Uart *uart) { UNUSED(uart); }
__weak void Uart_RxCpltCallback(Uart *uart) { UNUSED(uart); }
__weak void Uart_IdleCallback(Uart *uart) { UNUSED(uart); }
__weak void Uart_ErrorCallback(Uart *uart) { UNUSED(uart); }

HAL_StatusTypeDef Uart_Transmit_IT(Uart *uart, const uint8_t *data, uint16_t size)
{
  if (uart->sending) {
    return HAL_BUSY;
  }
  uart->sending = 1;
  uart->to_send = data;
  uart->left_to_send = size;
  uart->regs->CR1 |= USART_CR1_TXEIE;
  return HAL_OK;
}

HAL_StatusTypeDef Uart_Receive_IT(Uart *uart, uint8_t *data, uint16_t size)
{
  if (uart->receiving) {
    return HAL_BUSY;
  }
  uart->receiving = 1;
  uart->error = 0;
  uart->received = data;
  uart->left_to_receive = size;
  uart->regs->CR1 |= USART_CR1_PEIE;
  uart->regs->CR3 |= USART_CR3_EIE;
  uart->regs->CR1 |= USART_CR1_RXNEIE;
  return HAL_OK;
}

/* -- DMA -------------------------------------------------------------------------------------------------- */

/* The last byte is in the data register: the interrupt of TC says when it has left. */
static void OnAllHandedOver(Dma *dma)
{
  Uart *uart = dma->parent;
  uart->regs->CR3 &= ~USART_CR3_DMAT;
  uart->regs->CR1 |= USART_CR1_TCIE;
}

static void OnHalfReceived(Dma *dma) { Uart_RxHalfCpltCallback(dma->parent); }
static void OnReceived(Dma *dma) { Uart_RxCpltCallback(dma->parent); }

HAL_StatusTypeDef Uart_Transmit_DMA(Uart *uart, const uint8_t *data, uint16_t size)
{
  if (uart->sending) {
    return HAL_BUSY;
  }
  uart->sending = 1;
  uart->sender->parent = uart;
  uart->sender->complete = OnAllHandedOver;
  Dma_Start_IT(uart->sender, &uart->regs->DR, (void *)data, size);
  uart->regs->SR = ~USART_SR_TC;
  uart->regs->CR3 |= USART_CR3_DMAT;
  return HAL_OK;
}

HAL_StatusTypeDef Uart_Receive_DMA(Uart *uart, uint8_t *data, uint16_t size)
{
  if (uart->receiving) {
    return HAL_BUSY;
  }
  uart->receiving = 1;
  uart->error = 0;
  uart->receiver->parent = uart;
  uart->receiver->complete = OnReceived;
  uart->receiver->half_complete = OnHalfReceived;
  Dma_Start_IT(uart->receiver, &uart->regs->DR, data, size);
  (void)uart->regs->SR;
  (void)uart->regs->DR;
  uart->regs->CR1 |= USART_CR1_PEIE | USART_CR1_IDLEIE;
  uart->regs->CR3 |= USART_CR3_EIE;
  uart->regs->CR3 |= USART_CR3_DMAR;
  return HAL_OK;
}

/* -- interrupts ------------------------------------------------------------------------------------------- */

static void OnByte(Uart *uart)
{
  *uart->received++ = (uint8_t)uart->regs->DR;
  if (--uart->left_to_receive == 0U) {
    uart->regs->CR1 &= ~USART_CR1_RXNEIE;
    uart->regs->CR1 &= ~USART_CR1_PEIE;
    uart->regs->CR3 &= ~USART_CR3_EIE;
    uart->receiving = 0;
    Uart_RxCpltCallback(uart);
  }
}

static void OnEmpty(Uart *uart)
{
  uart->regs->DR = *uart->to_send++;
  if (--uart->left_to_send == 0U) {
    uart->regs->CR1 &= ~USART_CR1_TXEIE;
    uart->regs->CR1 |= USART_CR1_TCIE;
  }
}

static void OnErrors(Uart *uart, uint32_t errors)
{
  uart->error |= errors;
  (void)uart->regs->DR; /* with the read of SR before it, clears them */
  Uart_ErrorCallback(uart);
}

void Uart_IRQHandler(Uart *uart)
{
  uint32_t status = uart->regs->SR;
  uint32_t enabled = uart->regs->CR1;
  uint32_t with_errors = uart->regs->CR3 & USART_CR3_EIE;
  if ((status & USART_SR_RXNE) != 0U && (enabled & USART_CR1_RXNEIE) != 0U) {
    OnByte(uart);
  }
  if ((status & ERRORS) != 0U && with_errors != 0U) {
    OnErrors(uart, status & ERRORS);
  }
  if ((status & USART_SR_IDLE) != 0U && (enabled & USART_CR1_IDLEIE) != 0U) {
    (void)uart->regs->SR;
    (void)uart->regs->DR;
    Uart_IdleCallback(uart);
  }
  if ((status & USART_SR_TXE) != 0U && (enabled & USART_CR1_TXEIE) != 0U) {
    OnEmpty(uart);
    return;
  }
  if ((status & USART_SR_TC) != 0U && (enabled & USART_CR1_TCIE) != 0U) {
    uart->regs->CR1 &= ~USART_CR1_TCIE;
    uart->sending = 0;
    Uart_TxCpltCallback(uart);
  }
}
