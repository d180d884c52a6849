/* Exceptions entered and left in the usual cases: cpu/exceptions.py and cpu/frames.py in C. Whatever is not
 * usual, a fault, a stack elsewhere, an event of the clock while a frame is saved, is left to them, before
 * anything has changed. */
#include <string.h>

#include "bus.h"
#include "nvic.h"

enum { ENTRY_CYCLES = 12, RETURN_CYCLES = 10, CHAIN_CYCLES = 6 };
enum { NPRIV = 1, SPSEL = 2, FPCA = 4, FLOATING_CONTEXT = 12 }; /* CONTROL */
enum { THREAD = 8, PROCESS_STACK = 4, BASIC_FRAME = 16 };       /* EXC_RETURN (ARMv7-M ARM table B1-8) */
enum { TO_HANDLER = 1, TO_THREAD = 9, TO_PROCESS = 13 };        /* its last four bits */
enum { NMI = 2, FRAME = 0x20, FLOATING_FRAME = 0x68 };

#define EXC_RETURN 0xFFFFFFE1u
#define PADDED (1u << 9)
#define THUMB (1u << 24)
#define IPSR 0x1FFu
#define STORED_XPSR 0xFF0FFDFFu

static bool in_ram(uint32_t address, uint32_t size) { return address - RAM_BASE <= RAM_SIZE - size; }

static void note_stores(Core *core, uint32_t address, uint32_t size) {
  for (uint32_t at = address - RAM_BASE; at < address - RAM_BASE + size; at += 4) {
    core->stored[at >> PAGE_BITS] = 1;
  }
}

/* Whether the clock has nothing to fire before so many cycles are over. */
static bool quiet_for(const Bus *bus, int cycles) {
  return bus_time_after_ps(bus, cycles) < bus->end_ps;
}

static bool may_preempt(const Bus *bus, int number) {
  const Core *core = bus->core;
  const Nvic *nvic = bus->nvic;
  int level = nvic_level(nvic, core->primask, core->basepri, core->faultmask);
  return number && nvic_group(nvic, nvic->priority[number]) < level;
}

bool exceptions_pending(const Bus *bus) { return may_preempt(bus, nvic_most_urgent(bus->nvic)); }

/* The handler's address; 0 if there is no usual one. */
static uint32_t vector_of(const Core *core, const Nvic *nvic, int number) {
  uint32_t vector = 0, address = (uint32_t)nvic->vtor + 4 * (uint32_t)number;
  for (const Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    if (memory->size >= 4 && address - memory->base <= memory->size - 4) {
      memcpy(&vector, memory->bytes + (address - memory->base), 4);
      break;
    }
  }
  return vector & 1 ? vector : 0;
}

static void enter_handler(Bus *bus, int number, uint32_t vector, uint32_t exc_return) {
  Core *core = bus->core;
  nvic_activate(bus->nvic, number);
  bus->nvic->event = 1;
  write_xpsr(core, (uint32_t)number | THUMB);
  write_control(core, core->control & NPRIV);
  core->r[14] = exc_return;
  core->pc = core->r[15] = vector & ~1u;
}

/* Save the context (B1.5.6): its EXC_RETURN value. */
static uint32_t push(Bus *bus, uint32_t frame, bool padded, bool floating) {
  Core *core = bus->core;
  uint32_t xpsr = read_xpsr(core), exc_return = EXC_RETURN | (floating ? 0 : BASIC_FRAME);
  if (!in_handler(core)) {
    exc_return |= THREAD | (core->control & SPSEL ? PROCESS_STACK : 0);
  }
  uint32_t words[8] = {core->r[0],  core->r[1],  core->r[2],  core->r[3],
                       core->r[12], core->r[14], core->r[15], (xpsr & STORED_XPSR) | (padded ? PADDED : 0)};
  if (frame < bus->nvic->lowest && !(exc_return & PROCESS_STACK)) {
    bus->nvic->lowest = frame;
  }
  core->r[13] = frame;
  memcpy(core->ram + (frame - RAM_BASE), words, sizeof words);
  if (floating) {
    uint32_t last[2] = {core->fpscr, 0};
    memcpy(core->ram + (frame - RAM_BASE) + 0x20, core->s, 64);
    memcpy(core->ram + (frame - RAM_BASE) + 0x60, last, sizeof last);
    bus->nvic->floating_area = frame + 0x20;
  }
  note_stores(core, frame, floating ? FLOATING_FRAME : FRAME);
  return exc_return;
}

bool exceptions_enter(Bus *bus) {
  Core *core = bus->core;
  Nvic *nvic = bus->nvic;
  int number = nvic_most_urgent(nvic);
  bool floating = core->control & FPCA, align = nvic->align || floating;
  uint32_t size = floating ? FLOATING_FRAME : FRAME, sp = core->r[13], frame = sp - size;
  uint32_t vector = vector_of(core, nvic, number);
  if (align) {
    frame &= ~4u;
  }
  if (!nvic->alone || !may_preempt(bus, number) || !vector || !in_ram(frame, size) || core->slow_stores ||
      !quiet_for(bus, ENTRY_CYCLES)) {
    return false;
  }
  nvic->changed = 0;
  uint32_t exc_return = push(bus, frame, align && sp & 4, floating);
  bus_spend(bus, ENTRY_CYCLES);
  enter_handler(bus, number, vector, exc_return);
  return true;
}

/* The checks of ExceptionReturn (B1.5.8). */
static bool is_valid(const Nvic *nvic, uint32_t exc_return, int number) {
  uint32_t kind = exc_return & 0xF;
  if (exc_return >> 5 != 0xFFFFFFFFu >> 5 || !nvic_is_active(nvic, number)) {
    return false;
  }
  if (kind == TO_HANDLER) {
    return !nvic_outermost(nvic);
  }
  return (kind == TO_THREAD || kind == TO_PROCESS) && (nvic_outermost(nvic) || nvic->base_return);
}

/* Take a context back (B1.5.8). */
static void pop(Bus *bus, uint32_t frame, uint32_t exc_return, const uint32_t *words) {
  Core *core = bus->core;
  bool process = (exc_return & 0xF) == TO_PROCESS, floating = !(exc_return & BASIC_FRAME);
  uint32_t xpsr = words[7];
  if (floating) {
    memcpy(core->s, core->ram + (frame - RAM_BASE) + 0x20, 64);
    memcpy(&core->fpscr, core->ram + (frame - RAM_BASE) + 0x60, 4);
  }
  uint32_t sp = (frame + (floating ? FLOATING_FRAME : FRAME)) | (xpsr & PADDED ? 4 : 0);
  memcpy(core->r, words, 16);
  core->r[12] = words[4];
  core->r[14] = words[5];
  core->r[15] = words[6] & ~1u;
  write_control(core, (core->control & NPRIV) | (process ? SPSEL : 0) | (floating ? FLOATING_CONTEXT : 0));
  write_xpsr(core, xpsr & STORED_XPSR);
  write_stack_pointer(core, process, sp);
}

bool exceptions_leave(Bus *bus) {
  Core *core = bus->core;
  Nvic *nvic = bus->nvic;
  uint32_t exc_return = core->r[15] | 1, words[8];
  int number = (int)core->ipsr;
  if (!nvic->alone || !number || number >= EXCEPTIONS || !is_valid(nvic, exc_return, number) ||
      nvic->may_sleep || core->slow_stores) {
    return false;
  }
  bool process = (exc_return & 0xF) == TO_PROCESS, to_thread = (exc_return & 0xF) != TO_HANDLER;
  uint32_t frame = read_stack_pointer(core, process);
  if (!in_ram(frame, exc_return & BASIC_FRAME ? FRAME : FLOATING_FRAME)) {
    return false;
  }
  memcpy(words, core->ram + (frame - RAM_BASE), sizeof words);
  if (to_thread == ((words[7] & IPSR) != 0) || !(words[7] & THUMB) || !quiet_for(bus, CHAIN_CYCLES)) {
    return false;
  }
  Nvic before = *nvic;
  uint32_t faultmask = core->faultmask;
  nvic_deactivate(nvic, number);
  nvic->event = 1;
  core->faultmask = number == NMI ? faultmask : 0;
  int next = nvic_most_urgent(nvic);
  if (may_preempt(bus, next)) {
    uint32_t vector = vector_of(core, nvic, next);
    if (!vector) {
      *nvic = before;
      core->faultmask = faultmask;
      return false;
    }
    bus_spend(bus, CHAIN_CYCLES);
    enter_handler(bus, next, vector, exc_return);
    return true;
  }
  pop(bus, frame, exc_return, words);
  bus_spend(bus, RETURN_CYCLES);
  if (to_thread) {
    nvic->thread_ps = bus_time_after_ps(bus, 0);
  }
  return true;
}
