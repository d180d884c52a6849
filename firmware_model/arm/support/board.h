/* The STEVAL-FCU001V1's clocks, serial line and 800 Hz timer. */
#ifndef BOARD_H
#define BOARD_H

#include "stm32f4xx_hal.h"

extern UART_HandleTypeDef huart1;
extern TIM_HandleTypeDef htim9;

/* Sets the core to 84 MHz from the 16 MHz crystal, APB1 to 42 MHz and APB2 to 84 MHz. Without
 * the crystal the program stops in Error_Handler. */
void SystemClock_Config(void);

/* Clocks of the ports A, B and C. */
void MX_GPIO_Init(void);

/* USART1 on PA9 and PA10: 115200 baud, 8N1. */
void MX_USART1_UART_Init(void);

/* TIM9: 84 MHz / 84 / 1250 = 800 Hz; priority 3. */
void MX_TIM9_Init(void);

void Error_Handler(void);

#endif
