/* SysTick: counts HCLK, or HCLK / 8, down from RVR (ARMv7-M ARM B3.3; RM0368 section 10.1.4). */
#ifndef FCU_SYSTICK_H
#define FCU_SYSTICK_H

#include "peripherals/peripheral.h"
#include "generated/registers_systick.h"

typedef struct {
  Chip *chip;
  int32_t event;
  uint32_t control, reload;
  int64_t value; /* value at origin_ps */
  int64_t origin_ps;
  int64_t hz;
  int64_t wraps, first, period;
  uint8_t is_stopped; /* HCLK is 0 */
} SysTick;

/* The registers are in the system control space. */
void systick_create(Chip *chip); /* SysTick uses the events of the SCB */
void systick_reset(SysTick *tick);
uint32_t systick_read(SysTick *tick, uint32_t offset, int64_t *until_ps);
uint32_t systick_peek(const SysTick *tick, uint32_t offset);
void systick_write(SysTick *tick, uint32_t offset, uint32_t value, uint32_t mask);
void systick_retime(SysTick *tick);

#endif
