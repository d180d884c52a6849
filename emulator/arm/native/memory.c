/* Accesses outside of RAM, and in RAM those that need more than the bytes. */
#include <string.h>

#include "bus.h"

static Window *window_at(Core *core, uint32_t address) {
  for (Window *window = core->window; window < core->window + core->windows; window++) {
    if (address - window->base < window->size) {
      return window;
    }
  }
  return NULL;
}

static const uint8_t *bytes_at(const Core *core, uint32_t address, unsigned size) {
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

static bool refused(Core *core, const Insn *insn, uint32_t address, unsigned size, bool write) {
  if (!core->memory_hook || address - core->data_begin > core->data_end - core->data_begin) {
    return false;
  }
  core->r[15] -= insn->size;
  core->memory_hook(address, size, write);
  core->r[15] += insn->size;
  if (core->stop != STOP_REFUSED) {
    return false;
  }
  core->r[15] -= insn->size;
  return true;
}

static bool fault(Core *core, const Insn *insn, uint32_t address, enum Stop why) {
  core->fault_address = address;
  stop_on(core, insn, why);
  return false;
}

/* Callbacks see PC on the instruction. */
static bool read_window(Core *core, const Insn *insn, uint32_t address, unsigned size, uint32_t *value) {
  Window *window = window_at(core, address);
  if (!window) {
    return false;
  }
  uint32_t offset = address - window->base;
  *value = 0;
  if (core->bus && bus_read(core->bus, address, size, value)) {
    return true;
  }
  if (window->image) {
    copy(value, window->image + offset, size);
  } else {
    core->r[15] -= insn->size;
    *value = core->bus && window->look ? bus_look(core->bus, window, address, size)
                                       : (uint32_t)window->read(NULL, offset, size, NULL);
    core->r[15] += insn->size;
  }
  return true;
}

__attribute__((noinline)) static bool read_carefully(Core *core, const Insn *insn, uint32_t address,
                                                     unsigned size, uint32_t *value) {
  core->ahead = 0;
  if (UNLIKELY(refused(core, insn, address, size, false))) {
    return false;
  }
  const uint8_t *bytes = bytes_at(core, address, size);
  if (bytes) {
    *value = 0;
    copy(value, bytes, size);
    return true;
  }
  if (address % size == 0) {
    return read_window(core, insn, address, size, value) || fault(core, insn, address, STOP_READ);
  }
  uint32_t low, high, first = address & -size;
  if (!read_window(core, insn, first, size, &low) || !read_window(core, insn, first + size, size, &high)) {
    return fault(core, insn, address, STOP_READ);
  }
  unsigned shift = 8 * (address - first);
  *value = (uint32_t)(((uint64_t)high << 8 * size | low) >> shift);
  if (size == 2) {
    *value &= 0xFFFF;
  }
  return true;
}

bool memory_read_elsewhere(Core *core, const Insn *insn, uint32_t address, unsigned size, uint32_t *value) {
  uint32_t offset = address - core->code.base;
  if (UNLIKELY((uint64_t)offset + size > core->code.size || core->memory_hook)) {
    return read_carefully(core, insn, address, size, value);
  }
  *value = 0;
  copy(value, core->code.bytes + offset, size);
  return true;
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
      waiting_log(core->bus->waiting, word, (uint32_t)old);
    }
  }
}

static void write_ram(Core *core, uint32_t address, unsigned size, uint32_t value) {
  uint32_t offset = address - RAM_BASE, page = offset >> PAGE_BITS, last = (offset + size - 1) >> PAGE_BITS;
  if (core->slow_stores & STORES_ARE_LOGGED) {
    log_words(core, address, size, value);
  }
  copy(core->ram + offset, &value, size);
  core->stored[page] = core->stored[last] = 1;
  if (core->decoded[page] || core->decoded[last]) {
    core_forget_code(core, address - 2, size + 2);
  }
}

static bool write_piece(Core *core, const Insn *insn, uint32_t address, unsigned size, uint32_t value) {
  if (in_ram(address, size)) {
    write_ram(core, address, size, value);
    return true;
  }
  Window *window = window_at(core, address);
  if (window && !(core->bus && bus_write(core->bus, address, size, value))) {
    core->r[15] -= insn->size;
    if (core->bus && window->put) {
      bus_put(core->bus, window, address, size, value);
    } else {
      window->write(NULL, address - window->base, size, value, NULL);
    }
    core->r[15] += insn->size;
    if (window->image) {
      core->limit = core->counter;
      core->must_stop = 1;
    }
  }
  return window != NULL;
}

bool memory_write_elsewhere(Core *core, const Insn *insn, uint32_t address, unsigned size, uint32_t value) {
  core->ahead = 0;
  if (UNLIKELY(refused(core, insn, address, size, true))) {
    return false;
  }
  value &= size == 4 ? 0xFFFFFFFFu : (1u << 8 * size) - 1;
  if (address % size == 0 || in_ram(address, size)) {
    return write_piece(core, insn, address, size, value) || fault(core, insn, address, STOP_WRITE);
  }
  for (unsigned n = 0; n < size; n++) {
    if (!write_piece(core, insn, address + n, 1, value >> 8 * n & 0xFF)) {
      return fault(core, insn, address, STOP_WRITE);
    }
  }
  return true;
}

/* The window's number; -1 if there are too many. */
int core_map(Core *core, uint32_t base, uint32_t size, ReadCallback read, WriteCallback write) {
  if (core->windows == WINDOWS) {
    return -1;
  }
  core->window[core->windows] = (Window){.base = base, .size = size, .read = read, .write = write};
  return (int)core->windows++;
}

void core_access_by(Core *core, int window, LookCallback look, PutCallback put) {
  core->window[window].look = look;
  core->window[window].put = put;
}

void core_show_image(Core *core, int window, const uint8_t *image) { core->window[window].image = image; }

void core_hook_code(Core *core, CodeHook hook, uint32_t begin, uint32_t end) {
  core->code_hook = hook;
  core->code_begin = begin;
  core->code_end = end;
}

void core_hook_memory(Core *core, MemoryHook hook, uint32_t begin, uint32_t end) {
  core->memory_hook = hook;
  core->slow_stores = (core->slow_stores & ~STORES_ARE_HOOKED) | (hook ? STORES_ARE_HOOKED : 0);
  core->data_begin = begin;
  core->data_end = end;
}

void core_log_stores(Core *core, bool on) {
  core->slow_stores = (core->slow_stores & ~STORES_ARE_LOGGED) | (on ? STORES_ARE_LOGGED : 0);
}

/* Whether pages of RAM were stored to since this was last asked that never were before. */
bool core_pages_stored(Core *core) {
  uint32_t count = 0;
  for (uint32_t page = 0; page < RAM_SIZE >> PAGE_BITS; page++) {
    count += core->stored[page];
  }
  bool more = count != core->stored_known;
  core->stored_known = count;
  return more;
}

void core_read_stored(const Core *core, uint8_t *flags) { memcpy(flags, core->stored, sizeof core->stored); }
