/* The serial line, polled (RM0368 19.3.2, 19.3.3). */
#include "stm32f4xx_hal.h"

static HAL_StatusTypeDef WaitFor(USART_TypeDef *regs, uint32_t flag, uint32_t tickstart, uint32_t timeout_ms)
{
  while ((regs->SR & flag) == 0U) {
    if (HAL_Expired(tickstart, timeout_ms)) {
      return HAL_TIMEOUT;
    }
  }
  return HAL_OK;
}

HAL_StatusTypeDef HAL_UART_Init(UART_HandleTypeDef *huart)
{
  USART_TypeDef *regs = huart->Instance;
  const UART_InitTypeDef *init = &huart->Init;
  uint32_t clock = regs == USART1 ? HAL_RCC_GetPCLK2Freq() : HAL_RCC_GetPCLK1Freq();

  regs->CR1 = 0;
  regs->CR2 = init->StopBits;
  regs->CR3 = init->HwFlowCtl;
  regs->BRR = (clock + init->BaudRate / 2U) / init->BaudRate; /* rounded to the nearest sixteenth (RM0368 19.3.4) */
  regs->CR1 = init->WordLength | init->Parity | init->Mode | init->OverSampling | USART_CR1_UE;
  huart->gState = HAL_UART_STATE_READY;
  huart->RxState = HAL_UART_STATE_READY;
  return HAL_OK;
}

HAL_StatusTypeDef HAL_UART_Transmit(UART_HandleTypeDef *huart, const uint8_t *pData, uint16_t Size, uint32_t Timeout)
{
  if (huart->gState != HAL_UART_STATE_READY) {
    return HAL_BUSY;
  }
  uint32_t tickstart = HAL_GetTick();
  HAL_StatusTypeDef status = HAL_OK;

  huart->gState = HAL_UART_STATE_BUSY;
  for (; Size > 0U && status == HAL_OK; Size--) {
    status = WaitFor(huart->Instance, USART_SR_TXE, tickstart, Timeout);
    if (status == HAL_OK) {
      huart->Instance->DR = *pData++;
    }
  }
  if (status == HAL_OK) {
    status = WaitFor(huart->Instance, USART_SR_TC, tickstart, Timeout);
  }
  huart->gState = HAL_UART_STATE_READY;
  return status;
}

HAL_StatusTypeDef HAL_UART_Receive(UART_HandleTypeDef *huart, uint8_t *pData, uint16_t Size, uint32_t Timeout)
{
  if (huart->RxState != HAL_UART_STATE_READY) {
    return HAL_BUSY;
  }
  uint32_t tickstart = HAL_GetTick();
  HAL_StatusTypeDef status = HAL_OK;

  huart->RxState = HAL_UART_STATE_BUSY;
  for (; Size > 0U && status == HAL_OK; Size--) {
    status = WaitFor(huart->Instance, USART_SR_RXNE, tickstart, Timeout);
    if (status == HAL_OK) {
      *pData++ = (uint8_t)huart->Instance->DR;
    }
  }
  huart->RxState = HAL_UART_STATE_READY;
  return status;
}
