/* The cache of Python's registers: polled values, and addresses without a register.
 *
 * A call of Python takes as long as hundreds of instructions. A read without side effects is valid until the time
 * returned with it, or until a call that may change one of Python's peripherals: a write, an event, a reset. An
 * address without a register, and a peripheral without clock, are reported once; afterwards they read as 0 and
 * ignore writes without a call. Tables use a hash of the address: two entries with the same hash replace each other,
 * which affects only the speed.
 */
#include "bus.h"
#include "fcu.h"

/* Knuth, The Art of Computer Programming, 6.4. */
static uint32_t hash(uint32_t address, uint32_t size) { return (address * 0x9E3779B1u >> 16) % size; }

void python_registers_outdate(Chip *chip) {
  chip->python_registers.version++;
  poll_skip_outdate(&chip->poll_skip);
}

bool python_registers_forgotten(const Chip *chip, uint32_t address, enum Forgotten kind) {
  return chip->python_registers.forgotten[hash(address, FORGOTTEN)] == (address | kind);
}

void python_registers_forget(Chip *chip, uint32_t address, enum Forgotten kind) {
  poll_skip_outdate(&chip->poll_skip); /* another address may be reported again */
  chip->python_registers.forgotten[hash(address, FORGOTTEN)] = address | kind;
}

static enum Forgotten kind_of(const Chip *chip, uint32_t address) {
  return chip->python_registers.unclocked[page_of(address)] ? WITHOUT_CLOCK : WITHOUT_REGISTER;
}

/* Return true if Python has reported that no register is there. */
static bool is_nothing(const Chip *chip, uint32_t address, enum Access access) {
  enum Forgotten kind = kind_of(chip, address);
  bool is_silent = kind == WITHOUT_REGISTER && chip->python_registers.silent[page_of(address)] & access;
  return is_silent || python_registers_forgotten(chip, address & ~3u, kind);
}

/* Keep the valid parts of Python's answer. */
static void heed(Chip *chip, uint32_t address, enum Access access) {
  if (chip->until_ps == NOTHING_PS) {
    python_registers_forget(chip, address & ~3u, kind_of(chip, address));
  } else if (chip->until_ps == SILENT_PAGE_PS && page_of(address) != PAGE_PRIVATE) {
    chip->python_registers.silent[page_of(address)] |= (uint8_t)access;
  }
}

uint32_t python_load(Chip *chip, uint32_t address, unsigned size, int64_t *until_ps) {
  PythonRegisters *python_registers = &chip->python_registers;
  uint32_t place = hash(address, MAX_KEPT_READS);
  if (is_nothing(chip, address, READ)) {
    *until_ps = NEVER_PS;
    return 0;
  }
  if (python_registers->reads[place].address == address && python_registers->reads[place].size == size &&
      python_registers->reads[place].version == python_registers->version &&
          chip->now_ps < python_registers->reads[place].until_ps) {
    *until_ps = python_registers->reads[place].until_ps;
    return python_registers->reads[place].value;
  }
  chip->until_ps = ALREADY_PS;
  uint32_t value = chip->host.read(chip->now_ps, address, size);
  poll_skip_outdate(&chip->poll_skip);
  *until_ps = chip->until_ps <= NOTHING_PS ? ALREADY_PS : chip->until_ps;
  heed(chip, address, READ);
  if (*until_ps < 0) {
    python_registers_outdate(chip); /* it may have had an effect */
    return value;
  }
  python_registers->reads[place].address = address;
  python_registers->reads[place].size = size;
  python_registers->reads[place].version = python_registers->version;
  python_registers->reads[place].until_ps = *until_ps;
  python_registers->reads[place].value = value;
  return value;
}

void python_store(Chip *chip, uint32_t address, unsigned size, uint32_t value) {
  if (is_nothing(chip, address, WRITTEN)) {
    return;
  }
  python_registers_outdate(chip);
  chip->until_ps = ALREADY_PS;
  chip->host.write(chip->now_ps, address, size, value);
  heed(chip, address, WRITTEN);
}
