/* Nothing is wrong: it waits for a long time. */
#include "boot.h"

int main(void)
{
  boot();
  while (1) {
    HAL_Delay(100000);
    BSP_LED_Toggle(LED1);
  }
}
