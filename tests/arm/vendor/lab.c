/* LAB3's boot and print blocks. */
#include "lab.h"

AxesRaw_TypeDef acc;
AxesRaw_TypeDef gyro;
AxesRaw_TypeDef mag;
float press;
volatile uint32_t samples;
volatile uint32_t errors;

static void Print(const char *name, const AxesRaw_TypeDef *axes, const char *unit)
{
  PRINTF("%s[x,y,z] %d %s %d %s %d %s \n\r", name, axes->AXIS_X, unit, axes->AXIS_Y, unit, axes->AXIS_Z, unit);
}

static void PrintBlock(void)
{
  PRINTF("*****\n\n\n");
  Print("ACC", &acc, "mg");
  Print("GYR", &gyro, "mdps");
  Print("MAG", &mag, "mg");
  PRINTF("Pre: %f hPa \n\r", press);
  PRINTF("Samples: %lu Errors: %lu \n\r", (unsigned long)samples, (unsigned long)errors);
}

void Lab_Run(void)
{
  HAL_Init();
  SystemClock_Config();
  MX_GPIO_Init();
  MX_USART1_UART_Init();
  MX_SensorBus_Init();
  PRINTF("STEVAL-FCU001V1 FH rev.1.0 - Sep 2017\n\n");
  BSP_LED_Init(LED1);
  BSP_LED_Off(LED1);
  BSP_LED_Init(LED2);
  BSP_LED_Off(LED2);
  initializeAllSensors();
  enableAllSensors();
  setUpForFlight();
  PRINTF("LAB3 Init...\n");
  LPS22HB_WaitForData();
  MX_TIM9_Init();
  HAL_TIM_Base_Start_IT(&htim9);
  while (1) {
    PrintBlock();
    HAL_Delay(1000);
    BSP_LED_Toggle(LED1);
  }
}
