/* Cache of registers in Python. The cache saves calls of Python, each of which takes as long as
 * hundreds of instructions.
 *
 * For a read without side effects, Python returns a value and the time until which this value is valid.
 * If a call may change a register in Python, the cached values become invalid at once. An access to an
 * address without register or clock is reported once; then C ignores further accesses. Entries with the
 * same hash replace each other.
 */
#include "bus.h"
#include "fcu.h"

/* Knuth, The Art of Computer Programming, 6.4. */
static uint32_t hash(uint32_t address, uint32_t size) { return (address * 0x9E3779B1u >> 16) % size; }

void python_registers_invalidate(Chip *chip) {
  chip->python_registers.version++;
  poll_skip_invalidate(&chip->poll_skip);
}

bool python_registers_is_ignored(const Chip *chip, uint32_t address, enum IgnoreReason kind) {
  return chip->python_registers.ignored[hash(address, IGNORED_SLOTS)] == (address | kind);
}

void python_registers_ignore(Chip *chip, uint32_t address, enum IgnoreReason kind) {
  /* The new entry may replace another address. An access to the replaced address must be reported again, so
     its cached value must not be used. */
  poll_skip_invalidate(&chip->poll_skip);
  chip->python_registers.ignored[hash(address, IGNORED_SLOTS)] = address | kind;
}

static uint32_t harmless_slot(uint32_t address, uint32_t value) {
  return hash(address ^ value ^ value >> 16, HARMLESS_SLOTS); /* the hash uses only the lower 22 bits, so the
                                                                 upper half of the value is folded into them */
}

bool python_registers_is_harmless(const Chip *chip, uint32_t address, uint32_t value) {
  uint32_t slot = harmless_slot(address, value);
  return chip->python_registers.harmless[slot].address == address &&
         chip->python_registers.harmless[slot].value == value;
}

void python_registers_set_harmless(Chip *chip, uint32_t address, uint32_t value) {
  uint32_t slot = harmless_slot(address, value);
  chip->python_registers.harmless[slot].address = address;
  chip->python_registers.harmless[slot].value = value;
}

static enum IgnoreReason ignore_reason(const Chip *chip, uint32_t address, enum Access access) {
  if (!chip->python_registers.unclocked[page_of(address)]) {
    return NO_REGISTER;
  }
  return access == ACCESS_READ ? READ_WITHOUT_CLOCK : WRITE_WITHOUT_CLOCK;
}

static bool is_ignored(const Chip *chip, uint32_t address, enum Access access) {
  enum IgnoreReason kind = ignore_reason(chip, address, access);
  bool in_empty_page = kind == NO_REGISTER && chip->python_registers.empty_pages[page_of(address)] & access;
  return in_empty_page || python_registers_is_ignored(chip, address & ~3u, kind);
}

static void cache_answer(Chip *chip, uint32_t address, enum Access access) {
  if (chip->until_ps == NO_REGISTER_PS) {
    python_registers_ignore(chip, address & ~3u, ignore_reason(chip, address, access));
  } else if (chip->until_ps == EMPTY_PAGE_PS && page_of(address) != PAGE_PRIVATE) {
    chip->python_registers.empty_pages[page_of(address)] |= (uint8_t)access;
  }
}

uint32_t python_load(Chip *chip, uint32_t address, unsigned size, int64_t *until_ps) {
  PythonRegisters *python_registers = &chip->python_registers;
  uint32_t slot = hash(address, CACHED_READS);
  if (is_ignored(chip, address, ACCESS_READ)) {
    *until_ps = NEVER_PS;
    return 0;
  }
  if (python_registers->reads[slot].address == address && python_registers->reads[slot].size == size &&
      python_registers->reads[slot].version == python_registers->version &&
          chip->now_ps < python_registers->reads[slot].until_ps) {
    *until_ps = python_registers->reads[slot].until_ps;
    return python_registers->reads[slot].value;
  }
  chip->until_ps = NOT_CACHEABLE_PS;
  uint32_t value = chip->host.read(chip->now_ps, address, size);
  poll_skip_invalidate(&chip->poll_skip);
  *until_ps = chip->until_ps <= NO_REGISTER_PS ? NOT_CACHEABLE_PS : chip->until_ps;
  cache_answer(chip, address, ACCESS_READ);
  if (*until_ps < 0) {
    python_registers_invalidate(chip); /* the read may have had an effect */
    return value;
  }
  python_registers->reads[slot].address = address;
  python_registers->reads[slot].size = size;
  python_registers->reads[slot].version = python_registers->version;
  python_registers->reads[slot].until_ps = *until_ps;
  python_registers->reads[slot].value = value;
  return value;
}

static bool is_repeated(const Chip *chip, uint32_t address, unsigned size, uint32_t value) {
  const PythonRegisters *python_registers = &chip->python_registers;
  return python_registers->repeated.address == address && python_registers->repeated.size == size &&
         python_registers->repeated.value == value && python_registers->repeated.version == python_registers->version &&
         chip->now_ps < python_registers->repeated.until_ps;
}

void python_store(Chip *chip, uint32_t address, unsigned size, uint32_t value) {
  PythonRegisters *python_registers = &chip->python_registers;
  if (is_ignored(chip, address, ACCESS_WRITE) || is_repeated(chip, address, size, value)) {
    return;
  }
  python_registers_invalidate(chip);
  chip->until_ps = NOT_CACHEABLE_PS;
  chip->host.write(chip->now_ps, address, size, value);
  cache_answer(chip, address, ACCESS_WRITE);
  python_registers->repeated.address = address;
  python_registers->repeated.size = size;
  python_registers->repeated.value = value;
  python_registers->repeated.version = python_registers->version;
  python_registers->repeated.until_ps = chip->until_ps;
}
