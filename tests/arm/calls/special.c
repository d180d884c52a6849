/* Start-up code, and functions that a caller from outside may stumble over. */
#include "types.h"

#define GPIOA_ODR (*(volatile uint32_t *)0x40020014)
#define RCC_AHB1ENR (*(volatile uint32_t *)0x40023830)
#define CPACR (*(volatile uint32_t *)0xE000ED88)

Axes acc;
Mixed mixed;
volatile uint32_t flag;
uint32_t calls;
const int32_t constant = 7;

CALLED void Reset_Handler(void)
{
  CPACR |= 0xFu << 20;
  while (1) {
    __asm volatile("wfi");
  }
}

__attribute__((section(".vectors"), used)) static const uintptr_t vectors[] = {0x20010000, (uintptr_t)Reset_Handler};

CALLED void nothing(void) {}

CALLED int32_t counted(void) { return (int32_t)++calls; }

CALLED float norm1(const Axes *axes) { return (float)(axes->AXIS_X + axes->AXIS_Y + axes->AXIS_Z); }

CALLED void negate(Axes *axes)
{
  axes->AXIS_X = -axes->AXIS_X;
  axes->AXIS_Y = -axes->AXIS_Y;
  axes->AXIS_Z = -axes->AXIS_Z;
}

CALLED uint32_t length(const char *text)
{
  uint32_t n = 0;
  while (text[n]) {
    n++;
  }
  return n;
}

CALLED int32_t sum(const int16_t *numbers, uint32_t count)
{
  int32_t total = 0;
  while (count--) {
    total += *numbers++;
  }
  return total;
}

CALLED void doubled(int32_t *numbers, uint32_t count)
{
  while (count--) {
    *numbers++ *= 2;
  }
}

CALLED int32_t sum_of(const Axes *axes, uint32_t count)
{
  int32_t total = 0;
  for (; count--; axes++) {
    total += axes->AXIS_X + axes->AXIS_Y + axes->AXIS_Z;
  }
  return total;
}

CALLED uint32_t fill(void *where, uint32_t count)
{
  for (uint32_t n = 0; n < count; n++) {
    ((uint8_t *)where)[n] = (uint8_t)(n + 1);
  }
  return count;
}

CALLED uint32_t faculty(uint32_t n) { return n < 2 ? 1 : n * faculty(n - 1); }

CALLED void for_ever(void)
{
  while (1) {
    calls++;
  }
}

CALLED void until_flag(void)
{
  while (!flag) {
  }
}

CALLED uint32_t lights(uint32_t pins)
{
  RCC_AHB1ENR |= 1;
  GPIOA_ODR = pins;
  calls++;
  return GPIOA_ODR;
}

CALLED void nowhere(void) { ((void (*)(void))0)(); }

CALLED uint32_t bad_read(void) { return *(volatile uint32_t *)0x30000000; }

CALLED void undefined(void) { __asm volatile("udf #0"); }

CALLED int32_t many(int32_t count, ...) { return count; }

static inline __attribute__((always_inline)) int32_t hidden(int32_t n) { return n * calls; }

CALLED int32_t uses_hidden(int32_t n) { return hidden(n) + hidden(n + 1); }
