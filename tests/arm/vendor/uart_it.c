/* Everything typed comes back in capitals, received and sent by interrupts; every 100 ms a line with the counts. */
#include <stdio.h>

#include "steval_fcu001_v1.h"
#include "vendor_uart.h"

#define USART1_PRIORITY 5U
#define RING 256U
#define LINE 64U

void USART1_IRQHandler(void);

static Uart uart = {.regs = USART1};
static uint8_t ring[RING];
static volatile uint32_t filled, emptied; /* counted without end */
static uint8_t arrived;
static volatile uint32_t sent_lines, errors;

void USART1_IRQHandler(void) { Uart_IRQHandler(&uart); }

void Uart_RxCpltCallback(Uart *one)
{
  ring[filled++ % RING] = arrived >= 'a' && arrived <= 'z' ? (uint8_t)(arrived - 'a' + 'A') : arrived;
  Uart_Receive_IT(one, &arrived, 1);
}

void Uart_TxCpltCallback(Uart *one)
{
  UNUSED(one);
  sent_lines++;
}

void Uart_ErrorCallback(Uart *one)
{
  UNUSED(one);
  errors++;
}

static void Send(const uint8_t *data, uint32_t size)
{
  while (Uart_Transmit_IT(&uart, data, (uint16_t)size) != HAL_OK) {
  }
  while (uart.sending) {
  }
}

static void SendWhatHasArrived(void)
{
  static uint8_t text[RING];
  uint32_t count = 0;
  while (emptied != filled) {
    text[count++] = ring[emptied++ % RING];
  }
  if (count > 0U) {
    Send(text, count);
  }
}

int main(void)
{
  static char line[LINE];
  HAL_Init();
  SystemClock_Config();
  MX_GPIO_Init();
  MX_USART1_UART_Init();
  BSP_LED_Init(LED1);
  HAL_NVIC_SetPriority(USART1_IRQn, USART1_PRIORITY, 0);
  HAL_NVIC_EnableIRQ(USART1_IRQn);
  Uart_Receive_IT(&uart, &arrived, 1);
  for (uint32_t tenths = 0;; tenths++) {
    uint32_t tickstart = HAL_GetTick();
    while (HAL_GetTick() - tickstart < 100U) {
      SendWhatHasArrived();
    }
    BSP_LED_Toggle(LED1);
    int length = snprintf(line, sizeof line, "%lu: %lu bytes, %lu sent, %lu errors\n", (unsigned long)tenths,
                          (unsigned long)filled, (unsigned long)sent_lines, (unsigned long)errors);
    Send((const uint8_t *)line, (uint32_t)length);
  }
}
