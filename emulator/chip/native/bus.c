/* The bus matrix: accesses to registers at their exact time, and to memory on the slow path. */
#include "bus.h"

#include <string.h>

#include "fcu.h"

/* the work of programming the flash is counted as work of the flash registers (write_flash()) */
#define FLASH_INTERFACE_BASE 0x40023C00u
/* after this number of reads with no write between them, a peripheral is read by read_memory_like() */
#define MEMORY_LIKE_AFTER 1000

static bool in_ram(uint32_t address, unsigned size) { return address - RAM_BASE <= RAM_SIZE - size; }

const uint8_t *core_bytes_at(const Core *core, uint32_t address, uint32_t size) {
  for (const Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    uint32_t offset = address - memory->base;
    if (offset < memory->size && size <= memory->size - offset) {
      return memory->bytes + offset;
    }
  }
  return NULL;
}

static bool is_register_address(uint32_t address) {
  return address - PERIPHERALS_BASE < PERIPHERALS_SIZE || address - PRIVATE_BASE < PRIVATE_SIZE ||
      address - OTG_BASE < OTG_SIZE;
}

/* Bit-band alias: a word for each bit (PM0214 2.2.5). */
static bool is_peripheral_bit(uint32_t address, uint32_t *word, unsigned *bit) {
  uint32_t offset = address - PERIPHERAL_BITS_BASE, byte = offset >> 5;
  *word = PERIPHERALS_BASE + (byte & ~3u);
  *bit = (byte & 3) * 8 + (offset >> 2 & 7);
  return offset < 32 * PERIPHERALS_SIZE;
}

static bool is_ram_bit(uint32_t address, uint32_t *byte, unsigned *bit) {
  uint32_t offset = address - RAM_BITS_BASE;
  *byte = offset >> 5;
  *bit = offset >> 2 & 7;
  return offset < 32 * RAM_SIZE;
}

/* size is a power of 2, so no division is needed. */
static bool is_unaligned(uint32_t address, unsigned size) { return address & (size - 1); }

/* A call of memcpy() would take longer than the access. */
static void copy(void *to, const void *from, unsigned size) {
  switch (size) {
  case 1: memcpy(to, from, 1); break;
  case 2: memcpy(to, from, 2); break;
  default: memcpy(to, from, 4); break;
  }
}

/* -- single accesses at the current time -------------------------------------------------------------- */

void core_ram_written(Core *core, uint32_t address, uint32_t size) {
  if (core->slow_stores & STORES_CHANGE_CODE) {
    for (uint32_t at = 0; at < size; at += 4) {
      core_invalidate_code(core, address + at, size - at < 4 ? size - at : 4);
    }
  }
}

static inline void charge(Chip *chip, uint32_t address, int64_t before) {
  Cost *cost = &chip->costs.accesses[page_of(address)];
  chip->work += WORK_ACCESS;
  cost->times++;
  cost->work += chip->work - before;
}

static uint32_t load_register(Chip *chip, Peripheral *peripheral, uint32_t address, unsigned size, int64_t *until_ps) {
  if (peripheral) {
    return peripheral_read(peripheral, address - peripheral->base, size, until_ps);
  }
  return python_load(chip, address, size, until_ps);
}

static uint32_t charged_load(Chip *chip, Peripheral *peripheral, uint32_t address, unsigned size, int64_t *until_ps) {
  int64_t before = chip->work;
  uint32_t value = load_register(chip, peripheral, address, size, until_ps);
  charge(chip, address, before);
  return value;
}

static inline void charged_store(Chip *chip, Peripheral *peripheral, uint32_t address, unsigned size, uint32_t value) {
  int64_t before = chip->work;
  if (peripheral) {
    peripheral_write(peripheral, address - peripheral->base, size, value);
  } else {
    python_store(chip, address, size, value);
  }
  charge(chip, address, before);
}

static void write_ram_bit(Chip *chip, uint32_t byte, unsigned bit, uint32_t value) {
  uint8_t *target = chip->ram + byte;
  *target = (uint8_t)((*target & ~(1u << bit)) | (value & 1) << bit);
  core_ram_written(&chip->core, RAM_BASE + byte, 1);
}

bool bus_load(Chip *chip, uint32_t address, unsigned size, uint32_t *value) {
  int64_t until_ps;
  const uint8_t *bytes = core_bytes_at(&chip->core, address, size);
  *value = 0;
  if (bytes) {
    memcpy(value, bytes, size);
    return true;
  }
  if (!is_register_address(address)) {
    return false;
  }
  *value = charged_load(chip, chip_peripheral_at(chip, address), address, size, &until_ps);
  return true;
}

bool bus_store(Chip *chip, uint32_t address, unsigned size, uint32_t value) {
  if (in_ram(address, size)) {
    memcpy(chip->ram + (address - RAM_BASE), &value, size);
    core_ram_written(&chip->core, address, size);
    return true;
  }
  if (!is_register_address(address)) {
    return false;
  }
  charged_store(chip, chip_peripheral_at(chip, address), address, size, value);
  return true;
}

int32_t fcu_load(Chip *chip, uint32_t address, uint32_t size, uint32_t *value) {
  python_registers_invalidate(chip);
  chip_settle(chip);
  return bus_load(chip, address, size, value);
}

int32_t fcu_store(Chip *chip, uint32_t address, uint32_t size, uint32_t value) {
  chip_settle(chip);
  return bus_store(chip, address, size, value);
}

/* -- the core's accesses to registers and bit-band aliases -------------------------------------------- */

/* Advance the chip to the time of the current access. */
static inline void begin_access(Chip *chip) {
  chip->now_ps = cycle_clock_ps(&chip->cycle_clock, (int64_t)chip->core.counter - 1);
  if (chip->due_ps <= chip->now_ps || chip->host_next_ps <= chip->now_ps) {
    chip_settle(chip);
  }
}

static inline void end_access(Chip *chip) {
  bool earlier = chip->next_ps < chip->run_loop.slice_end_ps || chip->host_next_ps < chip->run_loop.slice_end_ps;
  if (earlier || chip->nvic.changed || chip->must_stop || chip->run_loop.reset_reason ||
      chip->run_loop.halt_requested || chip->work > chip->work_limit) {
    run_loop_update_limit(chip);
  }
}

static bool read_bit_band(Chip *chip, uint32_t address, uint32_t *value) {
  uint32_t target;
  unsigned bit;
  int64_t until_ps;
  if (is_ram_bit(address, &target, &bit)) {
    *value = chip->ram[target] >> bit & 1;
    return true;
  }
  if (!is_peripheral_bit(address, &target, &bit)) {
    return false;
  }
  poll_skip_side_effect(chip);
  begin_access(chip);
  *value = charged_load(chip, chip_peripheral_at(chip, target), target, 4, &until_ps) >> bit & 1;
  end_access(chip);
  return true;
}

static bool write_bit_band(Chip *chip, uint32_t address, uint32_t value) {
  uint32_t target;
  unsigned bit;
  int64_t until_ps;
  if (is_ram_bit(address, &target, &bit)) {
    poll_skip_side_effect(chip);
    write_ram_bit(chip, target, bit, value);
    return true;
  }
  if (!is_peripheral_bit(address, &target, &bit)) {
    return false;
  }
  poll_skip_side_effect(chip);
  begin_access(chip);
  Peripheral *peripheral = chip_peripheral_at(chip, target);
  uint32_t old = charged_load(chip, peripheral, target, 4, &until_ps);
  charged_store(chip, peripheral, target, 4, (old & ~(1u << bit)) | (value & 1) << bit);
  end_access(chip);
  return true;
}

/* Cache a register for repeat_read(). Registers of memory-like peripherals are not cached. The core's own
 * registers are not cached either, because they change with the core's state. */
static void cache_polled(Chip *chip, const Peripheral *peripheral, uint32_t address, unsigned size, uint32_t value,
                        int64_t until_ps) {
  Polled *polled = poll_skip_slot(&chip->poll_skip, address);
  bool is_simple =
      !(peripheral && peripheral->memory_like) && address - PERIPHERALS_BASE < PERIPHERALS_SIZE && !chip->bare;
  if (is_simple && until_ps >= 0 && polled->address == address) {
    polled->size = size;
    polled->value = value;
    polled->until_ps = until_ps;
    polled->version = chip->poll_skip.version;
  }
}

/* Return the cached value of a register that cannot have changed. If the result is false, call
 * read_register(). */
static inline bool repeat_read(Chip *chip, uint32_t address, unsigned size, uint32_t *value) {
  PollSkip *poll_skip = &chip->poll_skip;
  Polled *polled = poll_skip_slot(poll_skip, address);
  if (polled->address != address || polled->version != poll_skip->version || polled->size != size ||
      polled->poll_count >= POLL_SKIP_COMPARE_AFTER || poll_skip->state_count) {
    return false;
  }
  int64_t now_ps = cycle_clock_ps(&chip->cycle_clock, (int64_t)chip->core.counter - 1);
  if (now_ps >= polled->until_ps || now_ps >= chip->due_ps || now_ps >= chip->host_next_ps) {
    return false;
  }
  chip->now_ps = now_ps;
  *value = polled->value;
  charge(chip, address, chip->work);
  poll_skip->accesses++;
  polled->poll_count++;
  if (UNLIKELY(chip->work > chip->work_limit)) {
    run_loop_update_limit(chip);
  }
  return true;
}

static bool read_register(Chip *chip, Peripheral *peripheral, uint32_t address, unsigned size, uint32_t *value) {
  int64_t until_ps;
  begin_access(chip);
  *value = charged_load(chip, peripheral, address, size, &until_ps);
  end_access(chip);
  if (until_ps < 0) {
    poll_skip_side_effect(chip);
  } else if (poll_skip_register_read(chip, address, until_ps)) {
    begin_access(chip);
    *value = charged_load(chip, peripheral, address, size, &until_ps);
    end_access(chip);
  }
  cache_polled(chip, peripheral, address, size, *value, until_ps);
  return true;
}

/* Read an aligned register address. Return false if no register is there. */
static bool read_device(Chip *chip, uint32_t address, unsigned size, uint32_t *value) {
  return is_register_address(address) ? read_register(chip, chip_peripheral_at(chip, address), address, size, value)
                               : read_bit_band(chip, address, value);
}

/* Return whether the write changes nothing. Loops that show a state on LEDs repeat such writes. Therefore these
 * writes do not end poll skipping. */
static bool is_redundant_write(const Peripheral *peripheral, uint32_t address, unsigned size, uint32_t value) {
  uint32_t shift = 8 * (address & 3), mask = size_mask(size) << shift;
  return peripheral && peripheral->clocked && peripheral_has_register(peripheral, address) &&
         peripheral->type->is_redundant_write &&
         peripheral->type->is_redundant_write(peripheral, (address - peripheral->base) & ~3u, value << shift & mask,
                                              mask);
}

static void write_register(Chip *chip, uint32_t address, unsigned size, uint32_t value) {
  Peripheral *peripheral = chip_peripheral_at(chip, address);
  if (!chip->poll_skip.state_count || !is_redundant_write(peripheral, address, size, value)) {
    poll_skip_side_effect(chip);
  }
  if (peripheral) {
    peripheral->reads_since_write = 0;
  }
  begin_access(chip);
  charged_store(chip, peripheral, address, size, value);
  end_access(chip);
}

static bool write_device(Chip *chip, uint32_t address, unsigned size, uint32_t value) {
  if (!is_register_address(address)) {
    return write_bit_band(chip, address, value);
  }
  write_register(chip, address, size, value);
  return true;
}

/* -- the core's accesses to any address --------------------------------------------------------------- */

static bool access_fault(Core *core, uint32_t address, enum Stop why) {
  core->fault_address = address;
  core->stop = why;
  core->limit = core->counter;
  return false;
}

bool core_is_aligned(Core *core, uint32_t address) {
  return !(address & 3) || access_fault(core, address, STOP_UNALIGNED);
}

static void report_access(Chip *chip, uint32_t address, unsigned size, bool written) {
  chip->now_ps = cycle_clock_ps(&chip->cycle_clock, (int64_t)chip->core.counter - 1);
  chip->host.accessed(chip->now_ps, address, size, written);
}

/* Report an access to watched memory, and check UNALIGN_TRP. Return false if the access is refused. */
static bool check_access(Core *core, uint32_t address, unsigned size, bool written) {
  if (core->unalign_trp && is_unaligned(address, size)) {
    return access_fault(core, address, STOP_UNALIGNED);
  }
  if (core->watching && address <= core->watch_end && address + (size - 1) >= core->watch_begin) {
    report_access(core->chip, address, size, written);
  }
  return true;
}

static bool read_unaligned(Core *core, uint32_t address, unsigned size, uint32_t *value) {
  uint32_t low, high, first = address & -size;
  if (!read_device(core->chip, first, size, &low) || !read_device(core->chip, first + size, size, &high)) {
    return access_fault(core, address, STOP_READ);
  }
  unsigned shift = 8 * (address - first);
  *value = (uint32_t)(((uint64_t)high << 8 * size | low) >> shift);
  if (size == 2) {
    *value &= 0xFFFF;
  }
  return true;
}

/* Read a register that is polled continuously. Return false if the normal path must be used. */
static bool read_memory_like(Chip *chip, uint32_t address, unsigned size, uint32_t *value) {
  Peripheral *peripheral = chip_peripheral_at(chip, address);
  if (!peripheral || !peripheral->memory_like || ++peripheral->reads_since_write <= MEMORY_LIKE_AFTER ||
      !peripheral->clocked || !peripheral_has_register(peripheral, address) || is_unaligned(address, size)) {
    return false;
  }
  *value = peripheral->type->peek(peripheral, (address - peripheral->base) & ~3u) >> 8 * (address & 3);
  *value &= size_mask(size);
  return true;
}

static __attribute__((noinline)) bool read_any(Core *core, uint32_t address, unsigned size, uint32_t *value) {
  if (UNLIKELY((core->watching || core->unalign_trp) && !check_access(core, address, size, false))) {
    return false;
  }
  const uint8_t *bytes = address < PERIPHERALS_BASE ? core_bytes_at(core, address, size) : NULL;
  if (bytes) {
    *value = 0;
    copy(value, bytes, size);
    return true;
  }
  if (is_unaligned(address, size)) {
    return read_unaligned(core, address, size, value);
  }
  return read_device(core->chip, address, size, value) || access_fault(core, address, STOP_READ);
}

/* Handle all reads except those of memory-like peripherals. This function is separate so that core_read()
 * saves fewer host registers. */
static __attribute__((noinline)) bool read_polled(Core *core, uint32_t address, unsigned size, uint32_t *value) {
  return (!core->watching && repeat_read(core->chip, address, size, value)) ||
         read_any(core, address, size, value);
}

bool core_read(Core *core, uint32_t address, unsigned size, uint32_t *value) {
  return (!core->watching && read_memory_like(core->chip, address, size, value)) ||
         read_polled(core, address, size, value);
}

/* Log the words that a store is about to change. */
static void log_words(Core *core, uint32_t address, unsigned size, uint32_t value) {
  uint32_t first = address & ~3u, last = (address + size - 1) & ~3u;
  uint64_t old = 0, now;
  memcpy(&old, core->ram + (first - RAM_BASE), last - first + 4);
  now = old;
  copy((uint8_t *)&now + (address - first), &value, size);
  for (uint32_t word = first; word <= last; word += 4, old >>= 32, now >>= 32) {
    if ((uint32_t)old != (uint32_t)now) {
      poll_skip_log_store(core->chip, word, (uint32_t)old);
    }
  }
}

static void write_ram(Core *core, uint32_t address, unsigned size, uint32_t value) {
  if (core->slow_stores & STORES_LOGGED) {
    log_words(core, address, size, value);
  }
  copy(core->ram + (address - RAM_BASE), &value, size);
  core_ram_written(core, address, size);
}

/* Let FLASH, a peripheral in Python, program the word or refuse the write. Return false for an address
 * outside the flash. */
static bool write_flash(Chip *chip, uint32_t address, unsigned size, uint32_t value) {
  const uint8_t *bytes = core_bytes_at(&chip->core, address, size);
  if (chip->bare || !bytes || (uintptr_t)(bytes - chip->flash) >= FLASH_SIZE) {
    return false;
  }
  int64_t before = chip->work;
  poll_skip_side_effect(chip);
  begin_access(chip);
  python_registers_invalidate(chip);
  chip->host.write(chip->now_ps, address, size, value);
  charge(chip, FLASH_INTERFACE_BASE, before);
  end_access(chip);
  return true;
}

static bool write_aligned(Core *core, uint32_t address, unsigned size, uint32_t value) {
  if (in_ram(address, size)) {
    write_ram(core, address, size, value);
    return true;
  }
  if (address < RAM_BASE && write_flash(core->chip, address, size, value)) {
    return true;
  }
  return write_device(core->chip, address, size, value);
}

bool core_write(Core *core, uint32_t address, unsigned size, uint32_t value) {
  if (UNLIKELY((core->watching || core->unalign_trp) && !check_access(core, address, size, true))) {
    return false;
  }
  value &= size_mask(size);
  if (!is_unaligned(address, size) || in_ram(address, size)) {
    return write_aligned(core, address, size, value) || access_fault(core, address, STOP_WRITE);
  }
  for (unsigned n = 0; n < size; n++) {
    if (!write_aligned(core, address + n, 1, value >> 8 * n & 0xFF)) {
      return access_fault(core, address, STOP_WRITE);
    }
  }
  return true;
}

/* -- reasons for the slow path ------------------------------------------------------------------------ */

static void update_access_checks(Core *core) {
  bool checked = core->watching || core->unalign_trp;
  core->slow_stores = (core->slow_stores & ~STORES_CHECKED) | (checked ? STORES_CHECKED : 0);
  core_update_fast_limits(core);
}

void fcu_watch_memory(Chip *chip, int32_t on, uint32_t begin, uint32_t end) {
  Core *core = &chip->core;
  bool changed = core->watching != (on != 0);
  core->watching = on != 0;
  core->watch_begin = begin;
  core->watch_end = end;
  if (changed) {
    fcu_invalidate_code(chip); /* watched loads of literals are decoded in another way */
  }
  update_access_checks(core);
}

void core_trap_unaligned(Core *core, bool on) {
  core->unalign_trp = on;
  update_access_checks(core);
}

void core_log_stores(Core *core, bool on) {
  core->slow_stores = (core->slow_stores & ~STORES_LOGGED) | (on ? STORES_LOGGED : 0);
  core_update_fast_limits(core);
}

void core_update_fast_limits(Core *core) {
  bool checked = core->watching || core->unalign_trp;
  core->ram_load_limit = checked ? 0 : RAM_SIZE - 3;
  core->ram_store_limit = core->slow_stores ? 0 : RAM_SIZE - 3;
  core->flash_load_limit = checked ? 0 : FLASH_SIZE - 3;
}
