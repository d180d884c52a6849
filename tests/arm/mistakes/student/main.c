/* LAB3 as a student writes it on the template: all exercises, everything in main.c. */
#include <math.h>

#include "lab3.h"

#define PI 3.14159265358979

/* Written by the 800 Hz callback, read by the main loop. X right, Y forward, Z up. */
AxesRaw_TypeDef acc;  /* mg */
AxesRaw_TypeDef gyro; /* mdps */
AxesRaw_TypeDef mag;  /* mgauss */
float press;          /* hPa */

/* Read once, before the timer starts. */
float press_zero_level; /* hPa at the floor of the room, 0 m */
float temperature;      /* degC */

float pitch, roll, azimuth; /* degrees */
volatile uint32_t samples;  /* callbacks so far */

AxesRaw_TypeDef mag_min = {10000, 10000, 10000}, mag_max = {-10000, -10000, -10000};

void MagCalibration(void)
{
  if (mag.AXIS_X < mag_min.AXIS_X) mag_min.AXIS_X = mag.AXIS_X;
  if (mag.AXIS_Y < mag_min.AXIS_Y) mag_min.AXIS_Y = mag.AXIS_Y;
  if (mag.AXIS_Z < mag_min.AXIS_Z) mag_min.AXIS_Z = mag.AXIS_Z;
  if (mag.AXIS_X > mag_max.AXIS_X) mag_max.AXIS_X = mag.AXIS_X;
  if (mag.AXIS_Y > mag_max.AXIS_Y) mag_max.AXIS_Y = mag.AXIS_Y;
  if (mag.AXIS_Z > mag_max.AXIS_Z) mag_max.AXIS_Z = mag.AXIS_Z;
  mag.AXIS_X -= (mag_max.AXIS_X + mag_min.AXIS_X) / 2;
  mag.AXIS_Y -= (mag_max.AXIS_Y + mag_min.AXIS_Y) / 2;
  mag.AXIS_Z -= (mag_max.AXIS_Z + mag_min.AXIS_Z) / 2;
}

void eCompass(void)
{
  float gx = acc.AXIS_X, gy = acc.AXIS_Y, gz = acc.AXIS_Z;
  float bx = mag.AXIS_X, by = mag.AXIS_Y, bz = mag.AXIS_Z;

  pitch = atan2f(-gx, sqrtf(gy * gy + gz * gz));
  roll = atan2f(gy, sqrtf(gx * gx + gz * gz));
  float by2 = bz * sinf(roll) - by * cosf(roll);
  float bz2 = by * sinf(roll) + bz * cosf(roll);
  float bx3 = bx * cosf(pitch) + bz2 * sinf(pitch);
  azimuth = atan2f(by2, bx3);

  pitch = pitch * 180 / PI;
  roll = roll * 180 / PI;
  azimuth = azimuth * 180 / PI;
}

float getAltitude(float p, float celsius)
{
  return (pow(press_zero_level / p, 1 / 5.257) - 1) * (celsius + 273.15) / 0.0065;
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
  while (samples < 8) { /* filters settle */
  }

  while (1) {
    PRINTF("*****\n\n\n");
    PRINTF("ACC[x,y,z] %d mg %d mg %d mg \n\r", acc.AXIS_X, acc.AXIS_Y, acc.AXIS_Z);
    PRINTF("GYR[x,y,z] %d mdps %d mdps %d mdps \n\r", gyro.AXIS_X, gyro.AXIS_Y, gyro.AXIS_Z);
    PRINTF("MAG[x,y,z] %d mg %d mg %d mg \n\r", mag.AXIS_X, mag.AXIS_Y, mag.AXIS_Z);
    PRINTF("Pre: %f hPa \n\r", press);
    PRINTF("*****\n\n\n");

    float alt = getAltitude(press, temperature);
    PRINTF("*****\n\r\n\r");
    PRINTF("Pitch: %f deg Roll: %f deg Yaw: %f deg \n\r", pitch, roll, azimuth);
    PRINTF("Altitude: %f m \n\r", alt);
    PRINTF("*****\n\r\n\r");

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
  if (fabsf(pitch) > 80) {
    BSP_LED_On(LED1);
  } else {
    BSP_LED_Off(LED1);
  }
  if (fabsf(roll) > 80) {
    BSP_LED_On(LED2);
  } else {
    BSP_LED_Off(LED2);
  }
  samples++;
}
