/* Accesses outside of RAM, and in RAM those that need more than the bytes. */
#include <string.h>

#include "fcu.h"

#define STEADY_AFTER 1000 /* reads of a steady block without a write after which it is read like memory */

const uint8_t *core_bytes_at(const Core *core, uint32_t address, uint32_t size) {
  for (const Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    uint32_t offset = address - memory->base;
    if (offset < memory->size && size <= memory->size - offset) {
      return memory->bytes + offset;
    }
  }
  return NULL;
}

static bool in_ram(uint32_t address, unsigned size) { return address - RAM_BASE <= RAM_SIZE - size; }

/* A call for each of three sizes would take longer than all else about an access. */
static void copy(void *to, const void *from, unsigned size) {
  switch (size) {
  case 1: memcpy(to, from, 1); break;
  case 2: memcpy(to, from, 2); break;
  default: memcpy(to, from, 4); break;
  }
}

/* size is a power of 2; a remainder would take a division. */
static bool is_unaligned(uint32_t address, unsigned size) { return address & (size - 1); }

static bool fault(Core *core, uint32_t address, enum Stop why) {
  core->fault_address = address;
  core->stop = why;
  core->limit = core->counter;
  return false;
}

bool memory_is_aligned(Core *core, uint32_t address) {
  return !(address & 3) || fault(core, address, STOP_UNALIGNED);
}

/* Somebody watches the data, or unaligned accesses trap; false: the access has been refused. */
static bool look_at_access(Core *core, uint32_t address, unsigned size, bool written) {
  if (core->unalign_trp && is_unaligned(address, size)) {
    return fault(core, address, STOP_UNALIGNED);
  }
  if (core->watches && address - core->data_begin <= core->data_end - core->data_begin) {
    chip_accessed(core->chip, address, size, written);
  }
  return true;
}

static bool read_unaligned(Core *core, uint32_t address, unsigned size, uint32_t *value) {
  uint32_t low, high, first = address & -size;
  if (!bus_read(core->chip, first, size, &low) || !bus_read(core->chip, first + size, size, &high)) {
    return fault(core, address, STOP_READ);
  }
  unsigned shift = 8 * (address - first);
  *value = (uint32_t)(((uint64_t)high << 8 * size | low) >> shift);
  if (size == 2) {
    *value &= 0xFFFF;
  }
  return true;
}

/* A register of a block that firmware polls all the time; false: it has to be asked for. */
static bool read_steady(Chip *chip, uint32_t address, unsigned size, uint32_t *value) {
  Block *block = chip_block_at(chip, address);
  if (!block || !block->steady || ++block->looks <= STEADY_AFTER || !block->clocked ||
      !block_knows(block, address) || is_unaligned(address, size)) {
    return false;
  }
  *value = block->type->peek(block, (address - block->base) & ~3u) >> 8 * (address & 3);
  *value &= size == 4 ? WORD : (1u << 8 * size) - 1;
  return true;
}

/* Whatever is there. */
static __attribute__((noinline)) bool read_any(Core *core, uint32_t address, unsigned size, uint32_t *value) {
  if (UNLIKELY((core->watches || core->unalign_trp) && !look_at_access(core, address, size, false))) {
    return false;
  }
  const uint8_t *bytes = address < PERIPHERALS ? core_bytes_at(core, address, size) : NULL;
  if (bytes) {
    *value = 0;
    copy(value, bytes, size);
    return true;
  }
  if (is_unaligned(address, size)) {
    return read_unaligned(core, address, size, value);
  }
  return bus_read(core->chip, address, size, value) || fault(core, address, STOP_READ);
}

bool memory_read(Core *core, uint32_t address, unsigned size, uint32_t *value) {
  return (!core->watches && read_steady(core->chip, address, size, value)) ||
         read_any(core, address, size, value);
}

/* Words that a store of size bytes changes, before it does. */
static void log_words(Core *core, uint32_t address, unsigned size, uint32_t value) {
  uint32_t first = address & ~3u, last = (address + size - 1) & ~3u;
  uint64_t old = 0, now;
  memcpy(&old, core->ram + (first - RAM_BASE), last - first + 4);
  now = old;
  copy((uint8_t *)&now + (address - first), &value, size);
  for (uint32_t word = first; word <= last; word += 4, old >>= 32, now >>= 32) {
    if ((uint32_t)old != (uint32_t)now) {
      waiting_log(core->chip, word, (uint32_t)old);
    }
  }
}

void core_note_stores(Core *core, uint32_t address, uint32_t size) {
  if (core->slow_stores & STORES_CHANGE_CODE) {
    for (uint32_t at = 0; at < size; at += 4) {
      core_forget_code(core, address + at, size - at < 4 ? size - at : 4);
    }
  }
}

static void write_ram(Core *core, uint32_t address, unsigned size, uint32_t value) {
  if (core->slow_stores & STORES_ARE_LOGGED) {
    log_words(core, address, size, value);
  }
  copy(core->ram + (address - RAM_BASE), &value, size);
  core_note_stores(core, address, size);
}

static bool write_piece(Core *core, uint32_t address, unsigned size, uint32_t value) {
  if (in_ram(address, size)) {
    write_ram(core, address, size, value);
    return true;
  }
  return bus_write(core->chip, address, size, value);
}

bool memory_write(Core *core, uint32_t address, unsigned size, uint32_t value) {
  if (UNLIKELY((core->watches || core->unalign_trp) && !look_at_access(core, address, size, true))) {
    return false;
  }
  value &= size == 4 ? 0xFFFFFFFFu : (1u << 8 * size) - 1;
  if (!is_unaligned(address, size) || in_ram(address, size)) {
    return write_piece(core, address, size, value) || fault(core, address, STOP_WRITE);
  }
  for (unsigned n = 0; n < size; n++) {
    if (!write_piece(core, address + n, 1, value >> 8 * n & 0xFF)) {
      return fault(core, address, STOP_WRITE);
    }
  }
  return true;
}

static void look_at_accesses(Core *core) {
  bool looks = core->watches || core->unalign_trp;
  core->slow_stores = (core->slow_stores & ~STORES_ARE_LOOKED_AT) | (looks ? STORES_ARE_LOOKED_AT : 0);
  core_choose_plain(core);
}

void fcu_watch_memory(Chip *chip, int32_t on, uint32_t begin, uint32_t end) {
  Core *core = &chip->core;
  bool otherwise = core->watches != (on != 0);
  core->watches = on != 0;
  core->data_begin = begin;
  core->data_end = end;
  if (otherwise) {
    fcu_forget_code(chip); /* loads of literals are decoded otherwise */
  }
  look_at_accesses(core);
}

void core_trap_unaligned(Core *core, bool on) {
  core->unalign_trp = on;
  look_at_accesses(core);
}

void core_log_stores(Core *core, bool on) {
  core->slow_stores = (core->slow_stores & ~STORES_ARE_LOGGED) | (on ? STORES_ARE_LOGGED : 0);
  core_choose_plain(core);
}

void core_choose_plain(Core *core) {
  bool looks = core->watches || core->unalign_trp;
  core->plain_loads = looks ? 0 : RAM_SIZE - 3;
  core->plain_stores = core->slow_stores ? 0 : RAM_SIZE - 3;
  core->plain_constants = looks ? 0 : FLASH_SIZE - 3;
}
