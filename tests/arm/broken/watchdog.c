/* The watchdog is started and fed while the LED blinks, but not during a longer wait. */
#include "boot.h"

typedef struct {
  volatile uint32_t KR;
  volatile uint32_t PR;
  volatile uint32_t RLR;
  volatile uint32_t SR;
} IWDG_Registers;

#define IWDG_REGISTERS ((IWDG_Registers *)0x40003000U)

int main(void)
{
  boot();
  IWDG_REGISTERS->KR = 0xCCCC;
  IWDG_REGISTERS->KR = 0x5555;
  IWDG_REGISTERS->RLR = 400; /* 50 ms of the 32 kHz clock, divided by 4 */
  while (1) {
    for (uint32_t n = 0; n < 10; n++) {
      IWDG_REGISTERS->KR = 0xAAAA;
      HAL_Delay(5);
      BSP_LED_Toggle(LED1);
    }
    HAL_Delay(100);
  }
}
