/* HardFault_Handler returns, to the instruction that faulted. */
#include "boot.h"

void HardFault_Handler(void);
void HardFault_Handler(void) { BSP_LED_Off(LED2); }

int main(void)
{
  boot();
  *(volatile uint32_t *)0x60000000U = 1;
  blink_for_ever();
}
