/* USART1 in the vendor's styles: by interrupts and by DMA. */
#ifndef VENDOR_UART_H
#define VENDOR_UART_H

#include "vendor.h"
#include "vendor_dma.h"

typedef struct {
  USART_TypeDef *regs;
  Dma *sender;
  Dma *receiver;
  volatile uint32_t sending;
  volatile uint32_t receiving;
  volatile uint32_t error; /* PE, FE, NE, ORE as in SR */
  const uint8_t *to_send;
  uint16_t left_to_send;
  uint8_t *received;
  uint16_t left_to_receive;
} Uart;

/* Each gives HAL_BUSY while the same direction is under way. */
HAL_StatusTypeDef Uart_Transmit_IT(Uart *uart, const uint8_t *data, uint16_t size);
HAL_StatusTypeDef Uart_Receive_IT(Uart *uart, uint8_t *data, uint16_t size);
HAL_StatusTypeDef Uart_Transmit_DMA(Uart *uart, const uint8_t *data, uint16_t size);

/* For ever, round and round in data if the stream is circular; a pause in what arrives calls Uart_IdleCallback. */
HAL_StatusTypeDef Uart_Receive_DMA(Uart *uart, uint8_t *data, uint16_t size);

/* Called from USART1's interrupt handler. */
void Uart_IRQHandler(Uart *uart);

/* Yours to write; these, which do nothing, are weak. */
void Uart_TxCpltCallback(Uart *uart);
void Uart_RxHalfCpltCallback(Uart *uart);
void Uart_RxCpltCallback(Uart *uart);
void Uart_IdleCallback(Uart *uart);
void Uart_ErrorCallback(Uart *uart);

#endif
