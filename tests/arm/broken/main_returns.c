/* There is no loop in main. */
#include "boot.h"

int main(void)
{
  boot();
  BSP_LED_Off(LED1);
}
