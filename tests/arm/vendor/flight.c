/* What a flight controller does 800 times a second: six messages on SPI2, attitude and control in float, the duty of
 * eight PWM channels of two timers, and a radio on SPI1 that is asked until a time-out because it does not answer.
 * Once a second a line.
 */
#include <math.h>

#include "conversion.h"
#include "lab3.h"
#include "vendor_spi.h"

#define TICK_S 0.00125f
#define DEGREES_PER_RADIAN 57.29578f
#define PWM_PERIOD 1999U
#define RADIO_TIMEOUT_US 340U
#define RADIO_HEADER 5U
#define RADIO_READY 0x02U

static const SensorDevice lsm6dsl = {0xD6, GPIOA, GPIO_PIN_8};
static const SensorDevice lis2mdl = {0x3C, GPIOB, GPIO_PIN_12};
static const SensorDevice lps22hb = {0xBA, GPIOC, GPIO_PIN_13};

AxesRaw_TypeDef acc;
AxesRaw_TypeDef gyro;
AxesRaw_TypeDef mag;
float press;
float roll, pitch; /* degrees */
uint32_t duties[8];
volatile uint32_t ticks, fresh, radio_silent, radio_headers;

/* -- sensors ---------------------------------------------------------------------------------------------- */

static void ReadSensors(void)
{
  uint8_t status[2], bytes[4][6];
  Sensor_IO_Read(&lsm6dsl, 0x1E, &status[0], 1);
  Sensor_IO_Read(&lsm6dsl, 0x28, bytes[0], 6);
  Sensor_IO_Read(&lsm6dsl, 0x22, bytes[1], 6);
  Sensor_IO_Read(&lis2mdl, 0x67, &status[1], 1);
  Sensor_IO_Read(&lis2mdl, 0x68, bytes[2], 6);
  Sensor_IO_Read(&lps22hb, 0x28, bytes[3], 3);
  AxesFromBytes(bytes[0], ACC_MG_PER_LSB, &acc);
  AxesFromBytes(bytes[1], GYRO_MDPS_PER_LSB, &gyro);
  AxesFromBytes(bytes[2], MAG_MGAUSS_PER_LSB, &mag);
  press = PressureFromBytes(bytes[3]);
  fresh += (status[0] & 1U) + (status[1] >> 3 & 1U);
}

/* -- attitude and control --------------------------------------------------------------------------------- */

/* A complementary filter: the gyroscope over short times, the direction of gravity over long ones. */
static void UpdateAttitude(void)
{
  float ay = (float)acc.AXIS_Y;
  float az = (float)acc.AXIS_Z;
  float level_roll = atan2f(ay, az) * DEGREES_PER_RADIAN;
  float level_pitch = atan2f(-(float)acc.AXIS_X, sqrtf(ay * ay + az * az)) * DEGREES_PER_RADIAN;
  roll = 0.99f * (roll + 0.001f * (float)gyro.AXIS_X * TICK_S) + 0.01f * level_roll;
  pitch = 0.99f * (pitch + 0.001f * (float)gyro.AXIS_Y * TICK_S) + 0.01f * level_pitch;
}

static float Control(float error, float rate, float *sum)
{
  *sum += error * TICK_S;
  if (*sum > 50.0f) {
    *sum = 50.0f;
  } else if (*sum < -50.0f) {
    *sum = -50.0f;
  }
  return 6.0f * error + 2.5f * *sum - 0.4f * rate;
}

static uint32_t Duty(float wanted)
{
  if (wanted < 0.0f) {
    return 0;
  }
  return wanted > (float)PWM_PERIOD ? PWM_PERIOD : (uint32_t)wanted;
}

static void DriveMotors(void)
{
  static float roll_sum, pitch_sum;
  float right = Control(-roll, 0.001f * (float)gyro.AXIS_X, &roll_sum);
  float front = Control(-pitch, 0.001f * (float)gyro.AXIS_Y, &pitch_sum);
  for (uint32_t motor = 0; motor < 4U; motor++) {
    duties[motor] = Duty(800.0f + ((motor & 1U) ? right : -right) + ((motor & 2U) ? front : -front));
    duties[motor + 4U] = Duty(1000.0f + 100.0f * (float)motor + ((motor & 1U) ? front : right));
    TIM_CCR(TIM2, motor + 1U) = duties[motor];
    TIM_CCR(TIM4, motor + 1U) = duties[motor + 4U];
  }
}

static void InitPwm(TIM_TypeDef *timer)
{
  timer->PSC = 83;
  timer->ARR = PWM_PERIOD;
  timer->CCMR1 = 0x6868; /* PWM mode 1, preloaded, on all four channels */
  timer->CCMR2 = 0x6868;
  timer->CCER = 0x1111;
  timer->EGR = TIM_EGR_UG;
  timer->CR1 |= BIT(7) | TIM_CR1_CEN;
}

/* -- radio ------------------------------------------------------------------------------------------------ */

static void InitRadio(void)
{
  const GPIO_InitTypeDef bus = {
      .Pin = GPIO_PIN_5 | GPIO_PIN_6 | GPIO_PIN_7,
      .Mode = GPIO_MODE_AF_PP,
      .Speed = GPIO_SPEED_FREQ_HIGH,
      .Alternate = 5,
  };
  const GPIO_InitTypeDef outputs = {.Pin = GPIO_PIN_0 | GPIO_PIN_2, .Mode = GPIO_MODE_OUTPUT_PP};
  const GPIO_InitTypeDef interrupt = {.Pin = GPIO_PIN_4, .Mode = GPIO_MODE_INPUT};
  HAL_GPIO_WritePin(GPIOB, GPIO_PIN_0, GPIO_PIN_SET);
  HAL_GPIO_Init(GPIOA, &bus);
  HAL_GPIO_Init(GPIOB, &outputs);
  HAL_GPIO_Init(GPIOA, &interrupt);
  HAL_RCC_Enable(&RCC->APB2ENR, RCC_APB2ENR_SPI1EN);
  Spi_InitFullDuplex(SPI1);
  HAL_GPIO_WritePin(GPIOB, GPIO_PIN_2, GPIO_PIN_SET); /* out of reset */
  HAL_RCC_Enable(&RCC->APB1ENR, RCC_APB1ENR_TIM5EN);
  TIM5->PSC = 83; /* counts microseconds */
  TIM5->ARR = 0xFFFFFFFF;
  TIM5->EGR = TIM_EGR_UG;
  TIM5->CR1 |= TIM_CR1_CEN;
}

static int RadioIsReady(void)
{
  static const uint8_t request[RADIO_HEADER] = {0x0B};
  uint8_t header[RADIO_HEADER];
  HAL_GPIO_WritePin(GPIOB, GPIO_PIN_0, GPIO_PIN_RESET);
  for (uint32_t n = 0; n < RADIO_HEADER; n++) {
    header[n] = Spi_Exchange(SPI1, request[n]);
  }
  HAL_GPIO_WritePin(GPIOB, GPIO_PIN_0, GPIO_PIN_SET);
  radio_headers++;
  return header[0] == RADIO_READY;
}

static void AskRadio(void)
{
  uint32_t began = TIM5->CNT;
  while (TIM5->CNT - began < RADIO_TIMEOUT_US) {
    if (HAL_GPIO_ReadPin(GPIOA, GPIO_PIN_4) == GPIO_PIN_SET || RadioIsReady()) {
      return;
    }
  }
  radio_silent++;
}

/* -- program ---------------------------------------------------------------------------------------------- */

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  ReadSensors();
  UpdateAttitude();
  DriveMotors();
  AskRadio();
  ticks++;
}

static void PrintState(void)
{
  PRINTF("roll %.2f pitch %.2f press %.2f mag %ld\n", (double)roll, (double)pitch, (double)press, mag.AXIS_X);
  PRINTF("motors %lu %lu %lu %lu\n", duties[0], duties[1], duties[2], duties[3]);
  PRINTF("ticks %lu fresh %lu silent %lu headers %lu\n", ticks, fresh, radio_silent, radio_headers);
}

int main(void)
{
  HAL_Init();
  SystemClock_Config();
  MX_GPIO_Init();
  MX_USART1_UART_Init();
  MX_SensorBus_Init();
  BSP_LED_Init(LED1);
  initializeAllSensors();
  enableAllSensors();
  setUpForFlight();
  Sensor_IO_Write(&lps22hb, 0x11, 0x18); /* IF_ADD_INC: the pressure in one message */
  LPS22HB_WaitForData();
  HAL_RCC_Enable(&RCC->APB1ENR, RCC_APB1ENR_TIM2EN);
  HAL_RCC_Enable(&RCC->APB1ENR, RCC_APB1ENR_TIM4EN);
  InitPwm(TIM2);
  InitPwm(TIM4);
  InitRadio();
  MX_TIM9_Init();
  HAL_TIM_Base_Start_IT(&htim9);
  while (1) {
    HAL_Delay(1000);
    BSP_LED_Toggle(LED1);
    PrintState();
  }
}
