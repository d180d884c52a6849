/* Everything typed comes back, each burst reversed: circular DMA receives it, a pause ends it, DMA sends it. Every
 * 100 ms a line with the counts.
 */
#include <stdio.h>

#include "steval_fcu001_v1.h"
#include "vendor_uart.h"

#define USART1_PRIORITY 5U
#define RING 64U
#define LINE 96U

void USART1_IRQHandler(void);
void DMA2_Stream2_IRQHandler(void);
void DMA2_Stream7_IRQHandler(void);

static Dma receiver = {
    .controller = DMA2,
    .number = 2,
    .settings = 4U << DMA_CR_CHSEL_Pos | DMA_CR_MINC | DMA_CR_CIRC,
};
static Dma sender = {
    .controller = DMA2,
    .number = 7,
    .settings = 4U << DMA_CR_CHSEL_Pos | DMA_CR_MINC | DMA_CR_DIR_M2P,
};
static Uart uart = {.regs = USART1, .sender = &sender, .receiver = &receiver};
static uint8_t ring[RING];
static volatile uint32_t halves, rounds, pauses, errors, sent;

void USART1_IRQHandler(void) { Uart_IRQHandler(&uart); }
void DMA2_Stream2_IRQHandler(void) { Dma_IRQHandler(&receiver); }
void DMA2_Stream7_IRQHandler(void) { Dma_IRQHandler(&sender); }

void Uart_RxHalfCpltCallback(Uart *one)
{
  UNUSED(one);
  halves++;
}

void Uart_RxCpltCallback(Uart *one)
{
  UNUSED(one);
  rounds++;
}

void Uart_IdleCallback(Uart *one)
{
  UNUSED(one);
  pauses++;
}

void Uart_ErrorCallback(Uart *one)
{
  UNUSED(one);
  errors++;
}

void Uart_TxCpltCallback(Uart *one)
{
  UNUSED(one);
  sent++;
}

static void Send(const uint8_t *data, uint32_t size)
{
  while (Uart_Transmit_DMA(&uart, data, (uint16_t)size) != HAL_OK) {
  }
  while (uart.sending) {
  }
}

/* What has arrived since the last pause, the latest byte first; of more than a ring only what came last. */
static void SendBurst(void)
{
  static uint8_t text[RING];
  static uint32_t taken;
  uint32_t count = 0;
  uint32_t here = RING - Dma_Remaining(&receiver);
  while (here != taken && count < RING) {
    here = (here + RING - 1U) % RING;
    text[count++] = ring[here];
  }
  taken = RING - Dma_Remaining(&receiver);
  if (count > 0U) {
    Send(text, count);
  }
}

static void EnableInterrupt(IRQn_Type number)
{
  HAL_NVIC_SetPriority(number, USART1_PRIORITY, 0);
  HAL_NVIC_EnableIRQ(number);
}

int main(void)
{
  static char line[LINE];
  uint32_t seen = 0;
  HAL_Init();
  SystemClock_Config();
  MX_GPIO_Init();
  MX_USART1_UART_Init();
  BSP_LED_Init(LED1);
  HAL_RCC_Enable(&RCC->AHB1ENR, RCC_AHB1ENR_DMA2EN);
  Dma_Init(&receiver);
  Dma_Init(&sender);
  EnableInterrupt(USART1_IRQn);
  EnableInterrupt(DMA2_Stream2_IRQn);
  EnableInterrupt(DMA2_Stream7_IRQn);
  Uart_Receive_DMA(&uart, ring, RING);
  for (uint32_t tenths = 0;; tenths++) {
    uint32_t tickstart = HAL_GetTick();
    while (HAL_GetTick() - tickstart < 100U) {
      if (pauses != seen) {
        seen = pauses;
        SendBurst();
      }
    }
    BSP_LED_Toggle(LED1);
    int length = snprintf(line, sizeof line, "%lu: %lu halves, %lu rounds, %lu pauses, %lu sent, %lu errors\n",
                          (unsigned long)tenths, (unsigned long)halves, (unsigned long)rounds,
                          (unsigned long)pauses, (unsigned long)sent, (unsigned long)errors);
    Send((const uint8_t *)line, (uint32_t)length);
  }
}
