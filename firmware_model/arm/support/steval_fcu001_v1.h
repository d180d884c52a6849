/* The board's two LEDs: LED1 on PB5, LED2 on PB4. A low level lights them. */
#ifndef STEVAL_FCU001_V1_H
#define STEVAL_FCU001_V1_H

#include "stm32f4xx_hal.h"

typedef enum { LED1 = 0, LED2 = 1 } Led_TypeDef;

/* Makes the pin an output; the LED is lit until BSP_LED_Off is called, because the pin's latch is 0 after reset. */
void BSP_LED_Init(Led_TypeDef Led);

void BSP_LED_On(Led_TypeDef Led);
void BSP_LED_Off(Led_TypeDef Led);
void BSP_LED_Toggle(Led_TypeDef Led);

#endif
