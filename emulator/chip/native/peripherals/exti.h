/* EXTI and SYSCFG; exti.c explains them. */
#ifndef FCU_EXTI_H
#define FCU_EXTI_H

#include "peripherals/peripheral.h"

#define PIN_LINES 16

typedef struct {
  Peripheral peripheral;
  uint32_t registers[9]; /* by offset / 4 */
} Syscfg;

typedef struct {
  Peripheral peripheral;
  uint32_t imr, emr, rtsr, ftsr, swier, pr;
  uint32_t levels;         /* the last level of each line */
  int32_t port[PIN_LINES]; /* the port of a line's pin; -1: a code without a port */
} Exti;

void syscfg_create(Chip *chip);
void exti_create(Chip *chip);
/* The input level of a pin has changed. port: its index. */
void exti_pin_changed(Exti *exti, int port, int pin, bool level);

#endif
