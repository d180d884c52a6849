/* DWT: the cycle counter CYCCNT (ARMv7-M ARM C1.8). */
#ifndef FCU_DWT_H
#define FCU_DWT_H

#include "peripherals/peripheral.h"

#define DWT_STORED 24 /* registers from CTRL on */

typedef struct {
  Peripheral peripheral;
  uint32_t registers[DWT_STORED];
  int32_t trace_enabled;
  int64_t since_ps, hz;
} Dwt;

void dwt_create(Chip *chip);
void dwt_reset(Dwt *dwt);
void dwt_enable(Dwt *dwt, bool on);

#endif
