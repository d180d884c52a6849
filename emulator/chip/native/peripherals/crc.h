/* CRC unit: the Ethernet polynomial over words (RM0368 section 4). */
#ifndef FCU_CRC_H
#define FCU_CRC_H

#include "peripherals/peripheral.h"

typedef struct {
  Peripheral peripheral;
  uint32_t remainder, storage;
} Crc;

void crc_create(Chip *chip);

#endif
