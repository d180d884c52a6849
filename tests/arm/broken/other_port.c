/* The text goes to the terminal of another board. */
#include "boot.h"

#define USART2_REGISTERS ((USART_TypeDef *)0x40004400U)
#define USART2EN (1U << 17)

static void openUsart2(void)
{
  RCC->APB1ENR |= USART2EN;
  GPIOA->AFR[0] |= 7U << 8;
  GPIOA->MODER |= 2U << 4;
  USART2_REGISTERS->BRR = 365U;
  USART2_REGISTERS->CR1 = USART_CR1_UE | USART_CR1_TE;
}

static void print(const char *text)
{
  while (*text) {
    while ((USART2_REGISTERS->SR & USART_SR_TXE) == 0U) {
    }
    USART2_REGISTERS->DR = (uint8_t)*text++;
  }
}

int main(void)
{
  boot();
  openUsart2();
  print("Hello, 21.5 \xC2\xB0" "C\r\n");
  blink_for_ever();
}
