/* Every block of the chip has its clock and something to do; one loop waits for something in more than a hundred
 * different registers, lap after lap. Flags of timers, DMA, ADC, serial lines and SysTick take their time, settings
 * are there at once.
 */
#include "steval_fcu001_v1.h"
#include "vendor.h"

#define REGISTER(address) ((volatile uint32_t *)(address))
#define TIM1_BASE 0x40010000U
#define TIM2_BASE 0x40000000U
#define TIM3_BASE 0x40000400U
#define TIM4_BASE 0x40000800U
#define TIM5_BASE 0x40000C00U
#define TIM9_BASE 0x40014000U
#define TIM10_BASE 0x40014400U
#define TIM11_BASE 0x40014800U
#define RTC_BASE 0x40002800U
#define WWDG_BASE 0x40002C00U
#define IWDG_BASE 0x40003000U
#define SPI2_BASE 0x40003800U
#define SPI3_BASE 0x40003C00U
#define USART2_BASE 0x40004400U
#define I2C1_BASE 0x40005400U
#define I2C2_BASE 0x40005800U
#define I2C3_BASE 0x40005C00U
#define PWR_BASE 0x40007000U
#define USART1_BASE 0x40011000U
#define USART6_BASE 0x40011400U
#define ADC1_BASE 0x40012000U
#define SPI1_BASE 0x40013000U
#define SYSCFG_BASE 0x40013800U
#define EXTI_BASE 0x40013C00U
#define GPIO_BASE(port) (0x40020000U + 0x400U * (port))
#define CRC_BASE 0x40023000U
#define RCC_BASE 0x40023800U
#define FLASH_REGS 0x40023C00U
#define DMA1_BASE 0x40026000U
#define DMA2_BASE 0x40026400U
#define DBGMCU_BASE 0xE0042000U

#define UIF 1U
#define CC1IF 2U
#define M2M_WORDS 32U

typedef struct {
  uint32_t address, mask, value;
} Wait;

#define ANY(address) {address, 0, 0}
#define TIMER(base) {(base) + 0x10U, UIF, UIF}, {base, 1, 1}, {(base) + 0x2CU, 0, 0}, {(base) + 0x28U, 0, 0}
#define PORT(base) ANY(base), ANY((base) + 0x10U), ANY((base) + 0x14U), {(base) + 0x1CU, 0x1FFFF, 0}
#define SERIAL(base) {base, 0x40, 0x40}, {(base) + 0x0CU, 1U << 13, 1U << 13}, ANY((base) + 8U), ANY((base) + 0x14U)
#define TWO_WIRE(base) {(base) + 0x14U, 0xFFFF, 0}, {(base) + 0x18U, 2, 0}, {base, 1, 1}, ANY((base) + 4U)
#define THREE_WIRE(base) {(base) + 8U, 2, 2}, {base, 4, 4}, ANY((base) + 4U)

static const Wait waits[] = {
    TIMER(TIM1_BASE), TIMER(TIM2_BASE), TIMER(TIM3_BASE), TIMER(TIM5_BASE), TIMER(TIM9_BASE), TIMER(TIM10_BASE),
    TIMER(TIM11_BASE),
    {TIM4_BASE, 1, 1}, {TIM4_BASE + 0x0CU, 1, 1},
    {RCC_BASE, RCC_CR_HSERDY | RCC_CR_PLLRDY, RCC_CR_HSERDY | RCC_CR_PLLRDY}, ANY(RCC_BASE + 4U),
    {RCC_BASE + 8U, 0xC, 8}, ANY(RCC_BASE + 0xCU), {RCC_BASE + 0x10U, 0xFFFFFFFF, 0},
    {RCC_BASE + 0x20U, 0xFFFFFFFF, 0}, {RCC_BASE + 0x24U, 0xFFFFFFFF, 0}, ANY(RCC_BASE + 0x30U),
    ANY(RCC_BASE + 0x40U), ANY(RCC_BASE + 0x44U), ANY(RCC_BASE + 0x70U), {RCC_BASE + 0x74U, 2, 2},
    {FLASH_REGS, 7, 2}, {FLASH_REGS + 0xCU, 1U << 16, 0}, {FLASH_REGS + 0x10U, 1U << 31, 1U << 31},
    ANY(PWR_BASE), ANY(PWR_BASE + 4U),
    PORT(GPIO_BASE(0)), PORT(GPIO_BASE(1)), PORT(GPIO_BASE(2)), PORT(GPIO_BASE(3)), PORT(GPIO_BASE(4)),
    PORT(GPIO_BASE(7)),
    SERIAL(USART1_BASE), SERIAL(USART2_BASE), SERIAL(USART6_BASE),
    TWO_WIRE(I2C1_BASE), TWO_WIRE(I2C2_BASE), TWO_WIRE(I2C3_BASE),
    THREE_WIRE(SPI1_BASE), THREE_WIRE(SPI2_BASE), THREE_WIRE(SPI3_BASE),
    {DMA2_BASE, 0x20, 0x20}, {DMA2_BASE + 0x10U, 1, 0}, {DMA2_BASE + 0x14U, 0xFFFF, 0}, ANY(DMA2_BASE + 4U),
    {DMA1_BASE, 0xFFFFFFFF, 0}, {DMA1_BASE + 4U, 0xFFFFFFFF, 0}, ANY(DMA1_BASE + 0x10U),
    {ADC1_BASE, 2, 2}, {ADC1_BASE + 8U, 1, 1}, ANY(ADC1_BASE + 4U),
    {EXTI_BASE, 2, 2}, {EXTI_BASE + 0x14U, 2, 2}, ANY(SYSCFG_BASE + 8U), ANY(SYSCFG_BASE + 0x20U),
    ANY(CRC_BASE), {CRC_BASE + 4U, 0xFF, 0x5A}, {RTC_BASE + 0xCU, 1, 1}, ANY(RTC_BASE + 0x10U),
    {IWDG_BASE + 0xCU, 3, 0}, ANY(IWDG_BASE + 8U), ANY(WWDG_BASE + 4U), ANY(DBGMCU_BASE),
    {0xE000E010U, 1U << 16, 1U << 16}, ANY(0xE000E100U), {0xE000E200U, 0, 0}, ANY(0xE000ED08U), ANY(0xE000ED14U),
};
#define WAITS (sizeof waits / sizeof *waits)
_Static_assert(WAITS > 100, "more registers than a small table of the emulator could hold");

static volatile uint32_t interrupts;
static uint32_t source[M2M_WORDS], copy[M2M_WORDS];

void TIM4_IRQHandler(void);
void TIM4_IRQHandler(void)
{
  *REGISTER(TIM4_BASE + 0x10U) = ~UIF;
  interrupts++;
}

/* -- everything on ---------------------------------------------------------------------------------------- */

static void StartTimer(uint32_t base, uint32_t period_us)
{
  *REGISTER(base + 0x28U) = 83;
  *REGISTER(base + 0x2CU) = period_us - 1U;
  *REGISTER(base + 0x34U) = period_us / 2U;
  *REGISTER(base + 0x14U) = UIF;
  *REGISTER(base + 0x10U) = 0;
  *REGISTER(base) |= TIM_CR1_CEN;
}

static void StartSerialLine(uint32_t base, uint32_t divider)
{
  *REGISTER(base + 8U) = divider;
  *REGISTER(base + 0xCU) = 1U << 13 | 1U << 3;
}

static void StartTwoWire(uint32_t base)
{
  *REGISTER(base + 4U) = 42;
  *REGISTER(base + 0x1CU) = 1U << 15 | 35U;
  *REGISTER(base + 0x20U) = 13;
  *REGISTER(base) = 1;
}

static void StartEverything(void)
{
  RCC->AHB1ENR |= 0x0060109FU;
  RCC->APB1ENR |= 0x10E2C80FU;
  RCC->APB2ENR |= 0x00077931U & ~BIT(13) & ~BIT(11);
  *REGISTER(RCC_BASE + 0x74U) |= 1; /* LSI */
  StartTimer(TIM1_BASE, 150);
  StartTimer(TIM2_BASE, 200);
  StartTimer(TIM3_BASE, 250);
  StartTimer(TIM4_BASE, 330);
  StartTimer(TIM5_BASE, 410);
  StartTimer(TIM9_BASE, 470);
  StartTimer(TIM10_BASE, 530);
  StartTimer(TIM11_BASE, 590);
  *REGISTER(TIM4_BASE + 0xCU) = UIF;
  HAL_NVIC_SetPriority(TIM4_IRQn, 4, 0);
  HAL_NVIC_EnableIRQ(TIM4_IRQn);
  StartSerialLine(USART2_BASE, 365);
  StartSerialLine(USART6_BASE, 729);
  StartTwoWire(I2C1_BASE);
  StartTwoWire(I2C2_BASE);
  StartTwoWire(I2C3_BASE);
  *REGISTER(SPI1_BASE) = SPI_MODE_MASTER | SPI_NSS_SOFT | SPI_CR1_SPE;
  *REGISTER(SPI2_BASE) = SPI_MODE_MASTER | SPI_NSS_SOFT;
  *REGISTER(SPI3_BASE) = SPI_MODE_MASTER | SPI_NSS_SOFT;
  *REGISTER(EXTI_BASE) = 2; /* line 1 interrupts nobody: its input of the NVIC is off */
  *REGISTER(CRC_BASE + 4U) = 0x5A;
  *REGISTER(ADC1_BASE + 8U) = 1;
}

/* -- a lap ------------------------------------------------------------------------------------------------ */

static void StartLap(uint32_t lap)
{
  static const uint32_t timers[] = {TIM1_BASE, TIM2_BASE, TIM3_BASE, TIM5_BASE, TIM9_BASE, TIM10_BASE, TIM11_BASE};
  for (uint32_t n = 0; n < sizeof timers / sizeof *timers; n++) {
    *REGISTER(timers[n] + 0x10U) = 0;
  }
  for (uint32_t n = 0; n < M2M_WORDS; n++) {
    source[n] = lap * M2M_WORDS + n;
  }
  *REGISTER(DMA2_BASE + 8U) = 0x3D; /* stream 0: memory to memory, words */
  *REGISTER(DMA2_BASE + 0x14U) = M2M_WORDS;
  *REGISTER(DMA2_BASE + 0x18U) = (uint32_t)source;
  *REGISTER(DMA2_BASE + 0x1CU) = (uint32_t)copy;
  *REGISTER(DMA2_BASE + 0x10U) = 2U << 6 | 1U << 9 | 1U << 10 | 2U << 11 | 2U << 13 | 1;
  *REGISTER(ADC1_BASE) = 0;
  *REGISTER(ADC1_BASE + 8U) = 1U << 30 | 1;
  *REGISTER(USART2_BASE + 4U) = 'a' + lap % 26U;
  *REGISTER(USART6_BASE + 4U) = 'A' + lap % 26U;
  *REGISTER(SPI1_BASE + 0xCU) = lap;
  *REGISTER(EXTI_BASE + 0x14U) = 2;
  *REGISTER(EXTI_BASE + 0x10U) = 2;
}

/* What the lap has computed: by DMA, by the CRC block. */
static uint32_t EndLap(void)
{
  *REGISTER(CRC_BASE + 8U) = 1;
  for (uint32_t n = 0; n < M2M_WORDS; n++) {
    *REGISTER(CRC_BASE) = copy[n];
  }
  (void)*REGISTER(SPI1_BASE + 0xCU);
  (void)*REGISTER(ADC1_BASE + 0x4CU);
  return *REGISTER(CRC_BASE);
}

int main(void)
{
  HAL_Init();
  SystemClock_Config();
  MX_GPIO_Init();
  MX_USART1_UART_Init();
  BSP_LED_Init(LED1);
  StartEverything();
  for (uint32_t lap = 0;; lap++) {
    StartLap(lap);
    for (uint32_t n = 0; n < WAITS; n++) {
      while ((*REGISTER(waits[n].address) & waits[n].mask) != waits[n].value) {
      }
    }
    uint32_t crc = EndLap();
    if (lap % 32U == 31U) {
      char text[] = "laps 0000 crc 00000000\n";
      for (uint32_t digit = 0; digit < 8U; digit++) {
        text[21U - digit] = "0123456789ABCDEF"[crc >> 4U * digit & 15U];
      }
      for (uint32_t digit = 0, rest = lap + 1U; digit < 4U; digit++, rest /= 10U) {
        text[8U - digit] = (char)('0' + rest % 10U);
      }
      HAL_UART_Transmit(&huart1, (const uint8_t *)text, sizeof text - 1U, 100);
      BSP_LED_Toggle(LED1);
    }
  }
}
