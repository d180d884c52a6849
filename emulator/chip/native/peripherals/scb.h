/* System control space, 0xE000E000 (ARMv7-M ARM B3.2): one peripheral for SCB, NVIC and SysTick. */
#ifndef FCU_SCB_H
#define FCU_SCB_H

#include "peripherals/peripheral.h"

typedef struct {
  Peripheral peripheral;
  uint32_t actlr, vtor, aircr, scr, ccr, shpr[3], shcsr, cfsr, hfsr, dfsr, mmfar, bfar, cpacr, demcr;
  uint32_t fpccr, fpcar, fpdscr;
} Scb;

void scb_create(Chip *chip);
void scb_reset(Scb *scb);
/* Return SCR.SLEEPDEEP (B3.2.7). */
bool scb_sleeps_deeply(const Scb *scb);
/* Return false if the fault becomes a HardFault (B1.5.14). */
bool scb_fault_enabled(const Scb *scb, int exception);

#endif
