/* The serial line, polled (RM0368 section 19). */
#ifndef STM32F4XX_HAL_UART_H
#define STM32F4XX_HAL_UART_H

#include "stm32f4xx_hal_def.h"

typedef struct {
  uint32_t BaudRate;
  uint32_t WordLength;
  uint32_t StopBits;
  uint32_t Parity;
  uint32_t Mode;
  uint32_t HwFlowCtl;
  uint32_t OverSampling;
} UART_InitTypeDef;

typedef enum { HAL_UART_STATE_RESET = 0x00, HAL_UART_STATE_READY = 0x20, HAL_UART_STATE_BUSY = 0x24 } HAL_UART_StateTypeDef;

typedef struct {
  USART_TypeDef *Instance;
  UART_InitTypeDef Init;
  volatile HAL_UART_StateTypeDef gState;  /* of the transmitter */
  volatile HAL_UART_StateTypeDef RxState; /* of the receiver */
} UART_HandleTypeDef;

#define UART_WORDLENGTH_8B 0U
#define UART_STOPBITS_1 0U
#define UART_PARITY_NONE 0U
#define UART_MODE_RX USART_CR1_RE
#define UART_MODE_TX USART_CR1_TE
#define UART_MODE_TX_RX (USART_CR1_RE | USART_CR1_TE)
#define UART_HWCONTROL_NONE 0U
#define UART_OVERSAMPLING_16 0U

/* The peripheral's clock and its pins must be set up before. */
HAL_StatusTypeDef HAL_UART_Init(UART_HandleTypeDef *huart);

/* Blocks until the last bit has been sent. Returns HAL_BUSY if another call is sending (the new
 * text is then lost), and HAL_TIMEOUT after Timeout ms. */
HAL_StatusTypeDef HAL_UART_Transmit(UART_HandleTypeDef *huart, const uint8_t *pData, uint16_t Size, uint32_t Timeout);

/* Blocks until Size bytes have been received. */
HAL_StatusTypeDef HAL_UART_Receive(UART_HandleTypeDef *huart, uint8_t *pData, uint16_t Size, uint32_t Timeout);

#endif
