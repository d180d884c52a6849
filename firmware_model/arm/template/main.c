/* LAB3: motion sensors. The template, exercise 1: it samples the sensors 800 times a second and prints them once a
 * second. The places for your own code are marked YOUR CODE HERE.
 */
#include <math.h>

#include "lab3.h"

/* Written by the 800 Hz callback, read by the main loop. X right, Y forward, Z up. */
AxesRaw_TypeDef acc;  /* mg */
AxesRaw_TypeDef gyro; /* mdps */
AxesRaw_TypeDef mag;  /* mgauss as measured, including the hard iron */
float press;          /* hPa */

/* Values for the altitude, read once before the timer starts. */
float press_zero_level; /* hPa at the floor of the room, 0 m */
float temperature;      /* degC */

/* YOUR CODE HERE: your variables and functions (pitch, roll, azimuth; getAltitude, eCompass, MagCalibration) */

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

  /* From here on HAL_TIM_PeriodElapsedCallback runs at 800 Hz. */
  MX_TIM9_Init();
  HAL_TIM_Base_Start_IT(&htim9);

  while (1) {
    /* print the measured sensors at 1 Hz; the sample rate is 800 Hz */
    PRINTF("*****\n\n\n");
    PRINTF("ACC[x,y,z] %d mg %d mg %d mg \n\r", acc.AXIS_X, acc.AXIS_Y, acc.AXIS_Z);
    PRINTF("GYR[x,y,z] %d mdps %d mdps %d mdps \n\r", gyro.AXIS_X, gyro.AXIS_Y, gyro.AXIS_Z);
    PRINTF("MAG[x,y,z] %d mg %d mg %d mg \n\r", mag.AXIS_X, mag.AXIS_Y, mag.AXIS_Z);
    PRINTF("Pre: %f hPa \n\r", press);
    PRINTF("*****\n\n\n");

    /* YOUR CODE HERE: altitude, pitch, roll and yaw in the format of the slides */

    HAL_Delay(1000);
    BSP_LED_Toggle(LED1);
    BSP_LED_Toggle(LED2);
  }
}

/* Called from TIM9's interrupt every 1.25 ms; it must return within this time. */
void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  ReadSensorRawData(&acc, &gyro, &mag, &press);

  /* YOUR CODE HERE: computations that need every sample */
}
