/* Interrupts of timers in all their modes, of captures and edges of PA0, of ADC and SPI by DMA, of DMA between memories.
 * Every 10 ms a line with how often each has come, and a sum over what they brought.
 */
#include "debug.h"
#include "vendor.h"

#define REG(base, offset) (*(volatile uint32_t *)((base) + (offset)))
#define TIM1_BASE 0x40010000U
#define TIM2_BASE 0x40000000U
#define TIM3_BASE 0x40000400U
#define TIM4_BASE 0x40000800U
#define TIM5_BASE 0x40000C00U
#define TIM10_BASE 0x40014400U
#define TIM11_BASE 0x40014800U
#define ADC1_BASE 0x40012000U
#define SPI1_BASE 0x40013000U
#define EXTI_BASE 0x40013C00U
#define DMA2_BASE 0x40026400U

#define CR1 0x00U
#define DIER 0x0CU
#define SR 0x10U
#define EGR 0x14U
#define CCMR1 0x18U
#define CCMR2 0x1CU
#define CCER 0x20U
#define CNT 0x24U
#define PSC 0x28U
#define ARR 0x2CU
#define RCR 0x30U
#define CCR(n) (0x30U + 4U * (n))
#define BDTR 0x44U

#define STREAM(n) (DMA2_BASE + 0x10U + 0x18U * (n))
#define LIFCR (DMA2_BASE + 8U)

enum { EDGE, CAPTURE, PULSE, CENTRE, REPEATED, MOVING, PLAIN10, PLAIN11, ADC_HALF, ADC_FULL, COPIED, EXCHANGED, KINDS };

static volatile uint32_t counts[KINDS];
static volatile uint32_t sum;
static uint16_t conversions[2][6];
static uint8_t bytes[24];
static uint32_t words[6];
static uint8_t spi_out[16], spi_in[16];

void EXTI0_IRQHandler(void);
void TIM2_IRQHandler(void);
void TIM3_IRQHandler(void);
void TIM4_IRQHandler(void);
void TIM5_IRQHandler(void);
void TIM1_UP_TIM10_IRQHandler(void);
void TIM1_TRG_COM_TIM11_IRQHandler(void);
void DMA2_Stream0_IRQHandler(void);
void DMA2_Stream1_IRQHandler(void);
void DMA2_Stream2_IRQHandler(void);

static void Count(uint32_t kind, uint32_t value)
{
  uint32_t primask = __get_PRIMASK();
  __disable_irq();
  counts[kind]++;
  sum = (sum << 5 | sum >> 27) ^ (value + kind);
  __set_PRIMASK(primask);
}

static void Enable(uint32_t number, uint32_t priority)
{
  HAL_NVIC_SetPriority((IRQn_Type)number, priority, 0);
  HAL_NVIC_EnableIRQ((IRQn_Type)number);
}

/* -- timers ----------------------------------------------------------------------------------------------- */

static uint32_t TakeFlags(uint32_t base)
{
  uint32_t flags = REG(base, SR) & REG(base, DIER);
  REG(base, SR) = ~flags;
  return flags;
}

static void Timer(uint32_t base, uint32_t prescaler, uint32_t period, uint32_t interrupts)
{
  REG(base, PSC) = prescaler;
  REG(base, ARR) = period;
  REG(base, EGR) = 1;
  REG(base, SR) = 0;
  REG(base, DIER) = interrupts;
}

void EXTI0_IRQHandler(void)
{
  REG(EXTI_BASE, 0x14U) = 1;
  Count(EDGE, GPIOA->IDR & 1U);
}

void TIM2_IRQHandler(void)
{
  uint32_t flags = REG(TIM2_BASE, SR);
  uint32_t captured = REG(TIM2_BASE, CCR(1)); /* reading it clears its flag */
  REG(TIM2_BASE, SR) = ~(flags & 0x200U);
  Count(CAPTURE, captured ^ (flags & 0x202U));
}

void TIM3_IRQHandler(void)
{
  TakeFlags(TIM3_BASE);
  Count(PULSE, REG(TIM3_BASE, CR1) & 1U);
}

void TIM4_IRQHandler(void)
{
  uint32_t flags = TakeFlags(TIM4_BASE);
  Count(CENTRE, flags | (REG(TIM4_BASE, CR1) & 0x10U) << 4);
}

void TIM5_IRQHandler(void)
{
  TakeFlags(TIM5_BASE);
  REG(TIM5_BASE, CCR(2)) = (REG(TIM5_BASE, CCR(2)) - 137U) & 0xFFFFU;
  Count(MOVING, REG(TIM5_BASE, CCR(2)));
}

void TIM1_UP_TIM10_IRQHandler(void)
{
  if ((REG(TIM1_BASE, SR) & 1U) != 0U) {
    TakeFlags(TIM1_BASE);
    REG(TIM1_BASE, CCR(1)) = (REG(TIM1_BASE, CCR(1)) + 7U) % 100U;
    Count(REPEATED, REG(TIM1_BASE, CCR(1)));
  }
  if ((REG(TIM10_BASE, SR) & 1U) != 0U) {
    TakeFlags(TIM10_BASE);
    Count(PLAIN10, 10);
  }
}

void TIM1_TRG_COM_TIM11_IRQHandler(void)
{
  Count(PLAIN11, TakeFlags(TIM11_BASE));
}

static void StartTimers(void)
{
  Timer(TIM2_BASE, 83, 0xFFFFFFFF, 2);
  REG(TIM2_BASE, CCMR1) = 1;   /* channel 1 captures PA0 */
  REG(TIM2_BASE, CCER) = 0xB;  /* at both edges */
  REG(TIM2_BASE, CR1) = 1;
  Timer(TIM3_BASE, 41, 599, 1);
  REG(TIM3_BASE, CR1) = 8; /* one pulse: the main loop starts it */
  Timer(TIM4_BASE, 83, 499, 0x1F);
  for (uint32_t n = 1; n <= 4U; n++) {
    REG(TIM4_BASE, CCR(n)) = 110U * n;
  }
  REG(TIM4_BASE, CCMR1) = 0x6868;
  REG(TIM4_BASE, CCMR2) = 0x6868;
  REG(TIM4_BASE, CCER) = 0x1111;
  REG(TIM4_BASE, CR1) = 0x60 | 0x80 | 1; /* centre-aligned, flags both ways */
  Timer(TIM5_BASE, 83, 0xFFFF, 4);
  REG(TIM5_BASE, CCR(2)) = 0xFFFF - 137;
  REG(TIM5_BASE, CR1) = 0x10 | 1; /* downwards */
  REG(TIM1_BASE, RCR) = 3;
  Timer(TIM1_BASE, 839, 99, 1);
  REG(TIM1_BASE, CCMR1) = 0x68;
  REG(TIM1_BASE, CCER) = 1;
  REG(TIM1_BASE, BDTR) = 1U << 15;
  REG(TIM1_BASE, CR1) = 0x80 | 1;
  Timer(TIM10_BASE, 83, 736, 1);
  REG(TIM10_BASE, CR1) = 1;
  Timer(TIM11_BASE, 83, 910, 1);
  REG(TIM11_BASE, CR1) = 0x84; /* UG makes no flag */
  REG(TIM11_BASE, EGR) = 1;
  REG(TIM11_BASE, CR1) |= 1;
}

/* -- DMA -------------------------------------------------------------------------------------------------- */

void DMA2_Stream0_IRQHandler(void)
{
  uint32_t flags = REG(DMA2_BASE, 0);
  REG(LIFCR, 0) = flags & 0x30U;
  if ((flags & 0x10U) != 0U) {
    Count(ADC_HALF, conversions[0][0]);
  }
  if ((flags & 0x20U) != 0U) {
    Count(ADC_FULL, (REG(STREAM(0), 0) >> 19 & 1U) + conversions[1][5]); /* which buffer is filled now */
  }
}

void DMA2_Stream1_IRQHandler(void)
{
  REG(LIFCR, 0) = 0x3DU << 6;
  for (uint32_t n = 0; n < 6U; n++) {
    Count(COPIED, words[n]);
  }
}

void DMA2_Stream2_IRQHandler(void)
{
  REG(LIFCR, 0) = 0x3DU << 16;
  REG(SPI1_BASE, 4) = 0;
  for (uint32_t n = 0; n < sizeof spi_in; n++) {
    Count(EXCHANGED, spi_in[n]);
  }
}

/* Three inputs over and over, into two buffers by turns. */
static void StartConversions(void)
{
  REG(STREAM(0), 4) = 6;
  REG(STREAM(0), 8) = ADC1_BASE + 0x4CU;
  REG(STREAM(0), 12) = (uint32_t)conversions[0];
  REG(STREAM(0), 16) = (uint32_t)conversions[1];
  REG(STREAM(0), 0) = 1U << 18 | 1U << 13 | 1U << 11 | 1U << 10 | 1U << 8 | 0x18U | 1;
  REG(ADC1_BASE, 4) = 1U << 8;
  REG(ADC1_BASE, 0x10) = 7U << 3 | 6U << 6;
  REG(ADC1_BASE, 0xC) = 5U << 18;
  REG(ADC1_BASE, 0x2C) = 2U << 20;
  REG(ADC1_BASE, 0x34) = 1 | 2U << 5 | 16U << 10;
  REG(ADC1_BASE, 0x304) = 1U << 23 | 3U << 16;
  REG(ADC1_BASE, 8) = 1U << 9 | 1U << 8 | 2 | 1;
  REG(ADC1_BASE, 8) |= 1U << 30;
}

/* Bytes become words in the stream's FIFO. */
static void CopyBytes(uint32_t seed)
{
  for (uint32_t n = 0; n < sizeof bytes; n++) {
    bytes[n] = (uint8_t)(seed * 31U + n * 7U);
  }
  REG(STREAM(1), 4) = sizeof bytes;
  REG(STREAM(1), 8) = (uint32_t)bytes;
  REG(STREAM(1), 12) = (uint32_t)words;
  REG(STREAM(1), 0x14) = 7;
  REG(STREAM(1), 0) = 2U << 13 | 1U << 10 | 1U << 9 | 2U << 6 | 0x10U | 1;
}

static void ExchangeBytes(uint32_t seed)
{
  for (uint32_t n = 0; n < sizeof spi_out; n++) {
    spi_out[n] = (uint8_t)(seed + n);
  }
  REG(STREAM(2), 4) = sizeof spi_in;
  REG(STREAM(2), 8) = SPI1_BASE + 0xCU;
  REG(STREAM(2), 12) = (uint32_t)spi_in;
  REG(STREAM(2), 0) = 3U << 25 | 1U << 10 | 0x10U | 1;
  REG(LIFCR, 0) = 0x3DU << 22;
  REG(STREAM(3), 4) = sizeof spi_out;
  REG(STREAM(3), 8) = SPI1_BASE + 0xCU;
  REG(STREAM(3), 12) = (uint32_t)spi_out;
  REG(STREAM(3), 0) = 3U << 25 | 1U << 10 | 1U << 6 | 1;
  REG(SPI1_BASE, 4) = 3;
}

static void StartSpi(void)
{
  REG(SPI1_BASE, 0) = SPI_MODE_MASTER | SPI_NSS_SOFT | SPI_BAUDRATEPRESCALER_16;
  REG(SPI1_BASE, 0) |= SPI_CR1_SPE;
}

/* -- program ---------------------------------------------------------------------------------------------- */

static void InitPins(void)
{
  const GPIO_InitTypeDef input = {.Pin = GPIO_PIN_0, .Mode = GPIO_MODE_AF_PP, .Pull = GPIO_PULLDOWN, .Alternate = 1};
  const GPIO_InitTypeDef analog = {.Pin = GPIO_PIN_1 | GPIO_PIN_2, .Mode = GPIO_MODE_ANALOG};
  HAL_GPIO_Init(GPIOA, &input);
  HAL_GPIO_Init(GPIOA, &analog);
  REG(EXTI_BASE, 0) = 1;
  REG(EXTI_BASE, 8) = 1;
  REG(EXTI_BASE, 12) = 1;
}

int main(void)
{
  static const uint8_t interrupts[] = {6, 28, 29, 30, 50, 25, 26, 56, 57, 58};
  HAL_Init();
  SystemClock_Config();
  MX_GPIO_Init();
  MX_USART1_UART_Init();
  RCC->AHB1ENR |= RCC_AHB1ENR_DMA2EN;
  RCC->APB1ENR |= 0xFU;
  RCC->APB2ENR |= 1U | BIT(8) | BIT(12) | BIT(14) | BIT(17) | BIT(18);
  InitPins();
  for (uint32_t n = 0; n < sizeof interrupts; n++) {
    Enable(interrupts[n], 2U + n % 5U);
  }
  StartTimers();
  StartConversions();
  StartSpi();
  for (uint32_t lap = 0;; lap++) {
    CopyBytes(lap);
    ExchangeBytes(lap);
    for (uint32_t pulse = 0; pulse < 10U; pulse++) {
      REG(TIM3_BASE, CR1) |= 1U;
      HAL_Delay(1);
    }
    PRINTF("edges %lu captures %lu pulses %lu centre %lu repeated %lu moving %lu ", counts[EDGE], counts[CAPTURE],
           counts[PULSE], counts[CENTRE], counts[REPEATED], counts[MOVING]);
    PRINTF("plain %lu %lu converted %lu %lu copied %lu exchanged %lu sum %08lX\n", counts[PLAIN10], counts[PLAIN11],
           counts[ADC_HALF], counts[ADC_FULL], counts[COPIED], counts[EXCHANGED], sum);
  }
}
