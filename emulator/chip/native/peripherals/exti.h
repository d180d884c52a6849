/* EXTI and SYSCFG. */
#ifndef FCU_EXTI_H
#define FCU_EXTI_H

#include "peripherals/peripheral.h"

#define PIN_LINES 16

typedef struct {
  Peripheral peripheral;
  uint32_t registers[9];
} Syscfg;

typedef struct {
  Peripheral peripheral;
  uint32_t imr, emr, rtsr, ftsr, swier, pr;
  uint32_t levels;         /* latest level of each line */
  uint8_t event;           /* an event came since the latest exti_wakes() */
  int32_t port[PIN_LINES]; /* port of the line's pin; -1: none */
} Exti;

void syscfg_create(Chip *chip);
void exti_create(Chip *chip);
/* Return whether an interrupt is pending or an event has come, which ends Stop (RM0368 5.3.5). */
bool exti_wakes(Exti *exti);
void exti_pin_changed(Exti *exti, int port, int pin, bool level);

#endif
