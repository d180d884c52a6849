/* LAB3: motion sensors, all exercises solved.
 *
 * Decision: the angles are computed in the 800 Hz callback, not in the main loop, because the
 * LEDs must follow the tilt at once, and MagCalibration and eCompass need every sample.
 */
#include <math.h>
#include <stdbool.h>

#include "lab3.h"
#include "motion.h"

#define LED_THRESHOLD_DEG 80

/* Written by the 800 Hz callback, read by the main loop. X right, Y forward, Z up. */
AxesRaw_TypeDef acc;  /* mg */
AxesRaw_TypeDef gyro; /* mdps */
AxesRaw_TypeDef mag;  /* mgauss, calibrated */
float press;          /* hPa */
float alt;            /* m above the floor */

/* Read once, before the timer starts. */
float press_zero_level; /* hPa at the floor of the room, 0 m */
float temperature;      /* degC */

static void PrintSensors(void)
{
  PRINTF("*****\n\n\n");
  PRINTF("ACC[x,y,z] %d mg %d mg %d mg \n\r", acc.AXIS_X, acc.AXIS_Y, acc.AXIS_Z);
  PRINTF("GYR[x,y,z] %d mdps %d mdps %d mdps \n\r", gyro.AXIS_X, gyro.AXIS_Y, gyro.AXIS_Z);
  PRINTF("MAG[x,y,z] %d mg %d mg %d mg \n\r", mag.AXIS_X, mag.AXIS_Y, mag.AXIS_Z);
  PRINTF("Pre: %f hPa \n\r", press);
  PRINTF("*****\n\n\n");
}

static void PrintPlot(void)
{
  alt = getAltitude(press, temperature);
  PRINTF("*****\n\r\n\r");
  PRINTF("Pitch: %f deg Roll: %f deg Yaw: %f deg \n\r", pitch, roll, azimuth);
  PRINTF("Altitude: %f m \n\r", alt);
  PRINTF("*****\n\r\n\r");
}

/* Switches a LED on or off; the pin is written only on a change. */
static void Show(Led_TypeDef led, float angle_deg)
{
  static bool lit[2];
  bool steep = fabsf(angle_deg) > LED_THRESHOLD_DEG;
  if (steep == lit[led]) {
    return;
  }
  lit[led] = steep;
  if (steep) {
    BSP_LED_On(led);
  } else {
    BSP_LED_Off(led);
  }
}

int main(void)
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
  LPS22HB_Get_Press(&press);
  press_zero_level = press;
  LPS22HB_Get_Temp(&temperature);

  MX_TIM9_Init();
  HAL_TIM_Base_Start_IT(&htim9);

  while (1) {
    PrintSensors();
    PrintPlot();
    HAL_Delay(1000);
  }
}

/* 800 Hz */
void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  ReadSensorRawData(&acc, &gyro, &mag, &press);
  MagCalibration();
  eCompass();
  Show(LED1, pitch);
  Show(LED2, roll);
}
