/* Accesses to registers, at their exact time. */
#include "bus.h"

#include <string.h>

#include "fcu.h"

#define OTG 0x50000000u
#define OTG_SIZE 0x40000u
#define PRIVATE 0xE0000000u
#define PRIVATE_SIZE 0x100000u
#define RAM_BITS 0x22000000u
#define PERIPHERAL_BITS 0x42000000u

static bool is_registers(uint32_t address) {
  return address - PERIPHERALS < PERIPHERALS_SIZE || address - PRIVATE < PRIVATE_SIZE || address - OTG < OTG_SIZE;
}

/* The place of a bit of the peripherals' alias: a word for every bit (PM0214 2.2.5). */
static bool is_peripheral_bit(uint32_t address, uint32_t *word, unsigned *bit) {
  uint32_t offset = address - PERIPHERAL_BITS, byte = offset >> 5;
  *word = PERIPHERALS + (byte & ~3u);
  *bit = (byte & 3) * 8 + (offset >> 2 & 7);
  return offset < 32 * PERIPHERALS_SIZE;
}

static bool is_ram_bit(uint32_t address, uint32_t *byte, unsigned *bit) {
  uint32_t offset = address - RAM_BITS;
  *byte = offset >> 5;
  *bit = offset >> 2 & 7;
  return offset < 32 * RAM_SIZE;
}

/* -- one access, now ------------------------------------------------------------------------------------- */

static uint32_t load(Chip *chip, Block *block, uint32_t address, unsigned size, int64_t *until_ps) {
  if (block) {
    return block_read(block, address - block->base, size, until_ps);
  }
  chip->until_ps = ALREADY_PS;
  uint32_t value = chip->host.read(chip->now_ps, address, size);
  *until_ps = chip->until_ps;
  return value;
}

static void store(Chip *chip, Block *block, uint32_t address, unsigned size, uint32_t value) {
  if (block) {
    block_write(block, address - block->base, size, value);
  } else {
    chip->host.write(chip->now_ps, address, size, value);
  }
}

static void flip_ram_bit(Chip *chip, uint32_t byte, unsigned bit, uint32_t value) {
  uint8_t *place = chip->ram + byte;
  *place = (uint8_t)((*place & ~(1u << bit)) | (value & 1) << bit);
  core_note_stores(&chip->core, RAM_BASE + byte, 1);
}

bool bus_load(Chip *chip, uint32_t address, unsigned size, uint32_t *value) {
  int64_t until_ps;
  const uint8_t *bytes = core_bytes_at(&chip->core, address, size);
  *value = 0;
  if (bytes) {
    memcpy(value, bytes, size);
    return true;
  }
  if (!is_registers(address)) {
    return false;
  }
  *value = load(chip, chip_block_at(chip, address), address, size, &until_ps);
  return true;
}

bool bus_store(Chip *chip, uint32_t address, unsigned size, uint32_t value) {
  if (address - RAM_BASE <= RAM_SIZE - size) {
    memcpy(chip->ram + (address - RAM_BASE), &value, size);
    core_note_stores(&chip->core, address, size);
    return true;
  }
  if (!is_registers(address)) {
    return false;
  }
  store(chip, chip_block_at(chip, address), address, size, value);
  return true;
}

int32_t fcu_load(Chip *chip, uint32_t address, uint32_t size, uint32_t *value) {
  chip_settle(chip);
  return bus_load(chip, address, size, value);
}

int32_t fcu_store(Chip *chip, uint32_t address, uint32_t size, uint32_t value) {
  chip_settle(chip);
  return bus_store(chip, address, size, value);
}

/* -- the core's accesses --------------------------------------------------------------------------------- */

/* It is the time of the access in flight, and everything due by now has happened. */
static void arrive(Chip *chip) {
  chip->now_ps = timeline_ps(&chip->timeline, (int64_t)chip->core.counter - 1);
  if (chip->due_ps <= chip->now_ps || chip->host_next_ps <= chip->now_ps) {
    chip_settle(chip);
  }
}

static void depart(Chip *chip) {
  bool sooner = chip->next_ps < chip->machine.end_ps || chip->host_next_ps < chip->machine.end_ps;
  if (sooner || chip->nvic.changed || chip->must_stop || chip->machine.reset_reason || chip->machine.halting) {
    machine_end_in_time(chip);
  }
}

static bool read_bit(Chip *chip, uint32_t address, uint32_t *value) {
  uint32_t place;
  unsigned bit;
  int64_t until_ps;
  if (is_ram_bit(address, &place, &bit)) {
    *value = chip->ram[place] >> bit & 1;
    return true;
  }
  if (!is_peripheral_bit(address, &place, &bit)) {
    return false;
  }
  waiting_disturb(chip);
  arrive(chip);
  *value = load(chip, chip_block_at(chip, place), place, 4, &until_ps) >> bit & 1;
  depart(chip);
  return true;
}

static bool write_bit(Chip *chip, uint32_t address, uint32_t value) {
  uint32_t place;
  unsigned bit;
  int64_t until_ps;
  if (is_ram_bit(address, &place, &bit)) {
    waiting_disturb(chip);
    flip_ram_bit(chip, place, bit, value);
    return true;
  }
  if (!is_peripheral_bit(address, &place, &bit)) {
    return false;
  }
  waiting_disturb(chip);
  arrive(chip);
  Block *block = chip_block_at(chip, place);
  uint32_t old = load(chip, block, place, 4, &until_ps);
  store(chip, block, place, 4, (old & ~(1u << bit)) | (value & 1) << bit);
  depart(chip);
  return true;
}

static bool read_register(Chip *chip, Block *block, uint32_t address, unsigned size, uint32_t *value) {
  int64_t until_ps;
  arrive(chip);
  *value = load(chip, block, address, size, &until_ps);
  depart(chip);
  if (until_ps < 0) {
    waiting_disturb(chip);
  } else if (waiting_polled(chip, address, until_ps)) {
    arrive(chip);
    *value = load(chip, block, address, size, &until_ps);
    depart(chip);
  }
  return true;
}

bool bus_read(Chip *chip, uint32_t address, unsigned size, uint32_t *value) {
  return is_registers(address) ? read_register(chip, chip_block_at(chip, address), address, size, value)
                               : read_bit(chip, address, value);
}

/* Loops that show a state write the same to a register all the time. */
static bool changes_nothing(const Block *block, uint32_t address, unsigned size, uint32_t value) {
  uint32_t shift = 8 * (address & 3), mask = size == 4 ? WORD : ((1u << 8 * size) - 1) << shift;
  return block && block->clocked && block_knows(block, address) && block->type->changes_nothing &&
         block->type->changes_nothing(block, (address - block->base) & ~3u, value << shift & mask, mask);
}

bool bus_write(Chip *chip, uint32_t address, unsigned size, uint32_t value) {
  if (!is_registers(address)) {
    return write_bit(chip, address, value);
  }
  Block *block = chip_block_at(chip, address);
  if (!chip->waiting.comparing || !changes_nothing(block, address, size, value)) {
    waiting_disturb(chip);
  }
  if (block) {
    block->looks = 0;
  }
  arrive(chip);
  store(chip, block, address, size, value);
  depart(chip);
  return true;
}
