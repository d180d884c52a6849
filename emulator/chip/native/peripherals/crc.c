/* CRC-32 without reflection or final inversion (RM0368 section 4). In this model a word takes no time; on
 * the chip it takes four cycles. */
#include "peripherals/crc.h"

#include "chip.h"
#include "generated/registers_crc.h"

#define POLYNOMIAL 0x04C11DB7u

static uint32_t after_word(uint32_t remainder, uint32_t word) {
  remainder ^= word;
  for (int bit = 0; bit < 32; bit++) {
    remainder = remainder << 1 ^ (remainder >> 31 ? POLYNOMIAL : 0);
  }
  return remainder;
}

static uint32_t crc_peek(const Peripheral *peripheral, uint32_t offset) {
  const Crc *crc = (const Crc *)peripheral;
  return offset == DR ? crc->remainder : offset == IDR ? crc->storage : 0;
}

static void crc_write(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  Crc *crc = (Crc *)peripheral;
  if (offset == DR) {
    crc->remainder = after_word(crc->remainder, value & mask);
  } else if (offset == IDR) {
    write_bits(&crc->storage, value, mask, IDR_STORED);
  } else if (offset == CR && value & mask & CR_RESET) {
    crc->remainder = DR_RESET;
  }
}

static void crc_reset(Peripheral *peripheral) {
  Crc *crc = (Crc *)peripheral;
  crc->remainder = DR_RESET;
  crc->storage = 0;
}

static const PeripheralType TYPE = {
  .read = peripheral_read_as_peek, .peek = crc_peek, .write = crc_write, .reset = crc_reset
};

void crc_create(Chip *chip) {
  peripheral_create(chip, &chip->crc.peripheral, &TYPE, CRC_BASE, CRC_SIZE, CRC_OFFSETS);
  crc_reset(&chip->crc.peripheral);
}
