/* The program has done what it should, and main ends in an endless loop. */
#include "boot.h"

int main(void)
{
  boot();
  BSP_LED_Off(LED1);
  while (1) {
  }
}
