/* The loop: fetch, decode once, execute. */
#include <string.h>

#include "bus.h"

#define AHEAD 1000 /* instructions that are executed without returning to the loop */

static void undefined(Core *core, const Insn *insn) { stop_on(core, insn, STOP_UNDEFINED); }

static Memory *memory_at(Core *core, uint32_t address) {
  for (Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    if (address - memory->base < memory->size) {
      return memory;
    }
  }
  return NULL;
}

static Insn decoded(Memory *memory, uint32_t address) {
  uint32_t offset = address - memory->base;
  uint16_t first = 0, second = 0;
  memcpy(&first, memory->bytes + offset, 2);
  if (offset + 4 <= memory->size) {
    memcpy(&second, memory->bytes + offset + 2, 2);
  }
  Insn insn = {.size = first >> 11 >= 0x1D ? 4 : 2};
  if (!(insn.size == 2 ? decode16(address, first, &insn) : decode32(address, first, second, &insn))) {
    insn.run = undefined;
  }
  if (!insn.run_in_it) {
    insn.run_in_it = insn.run;
  }
  return insn;
}

/* In front of a place the run ends; the one that core->passing names is executed. */
static void place(Core *core, const Insn *insn) {
  uint32_t address = core->r[15] - insn->size;
  if (address == core->passing) {
    Insn real[2] = {decoded(memory_at(core, address), address)}; /* behind it, nothing is decoded */
    core->ahead = 0;
    (core->itstate ? real->run_in_it : real->run)(core, real);
  } else {
    core->counter--;
    stop_on(core, insn, STOP_PLACE);
  }
}

/* Gives where it is from now on. The last word's are decoded apart, each time: what would be looked at next
 * is not there. */
__attribute__((noinline)) static Insn *decode(Core *core, Memory *memory, uint32_t address, Insn *insn) {
  bool is_place = insn->place;
  if (address - memory->base >= memory->size - 4) {
    insn = core->apart;
  }
  *insn = decoded(memory, address);
  if (is_place) {
    insn->place = true;
    insn->run = insn->run_in_it = place;
  }
  if (memory->writable) {
    uint32_t offset = address - memory->base, last = offset + insn->size - 1;
    core->slow_stores |= STORES_CHANGE_CODE;
    core->decoded[offset >> PAGE_BITS] = 1;
    core->decoded[(last < RAM_SIZE ? last : offset) >> PAGE_BITS] = 1;
  }
  return insn;
}

/* Where PC is; NULL, and the run has ended, if nothing can be executed there. */
static Memory *code_at_pc(Core *core) {
  Memory *memory = memory_at(core, core->r[15]);
  if (!memory || (memory->writable && !core->ram_is_code)) {
    core->stop = STOP_FETCH;
    core->limit = core->counter;
    return NULL;
  }
  return memory;
}

__attribute__((always_inline)) static inline Insn *fetch(Core *core, Memory *memory, uint32_t offset) {
  Insn *insn = &memory->insns[offset >> 1];
  if (UNLIKELY(!insn->run)) {
    insn = decode(core, memory, core->r[15], insn);
  }
  return insn;
}

/* Whether somebody has refused the instruction at PC. */
static bool refused(Core *core) {
  uint32_t address = core->r[15];
  if (core->code_hook && address - core->code_begin <= core->code_end - core->code_begin) {
    core->code_hook(address);
  }
  return core->stop == STOP_REFUSED;
}

static bool was_not_executed(enum Stop stop) {
  return stop > STOP_EXCEPTION_RETURN || stop == STOP_PLACE || stop == STOP_BKPT;
}

/* The one at PC, decoded; NULL, and the run has ended, if nothing can be executed there. */
static const Insn *insn_at_pc(Core *core) {
  Memory *memory = code_at_pc(core);
  return memory ? fetch(core, memory, core->r[15] - memory->base) : NULL;
}

/* ConditionPassed (A7.3.1); condition is 0..14, 15 counts as always. A mask for each condition has the bits
 * NZCV (as a number) with which it holds. */
static bool holds(const Core *core, unsigned condition) {
  static const uint16_t masks[16] = {0xF0F0, 0x0F0F, 0xCCCC, 0x3333, 0xFF00, 0x00FF, 0xAAAA, 0x5555,
                                     0x0C0C, 0xF3F3, 0xAA55, 0x55AA, 0x0A05, 0xF5FA, 0xFFFF, 0xFFFF};
  unsigned nzcv = core->n >> 31 << 3 | (unsigned)(core->z == 0) << 2 | core->c << 1 | core->v;
  return masks[condition] >> nzcv & 1;
}

/* One instruction of a block, if its condition holds; false if it was not executed for another reason. */
static bool execute_in_it(Core *core, const Insn *insn) {
  uint32_t next = core->r[15] + insn->size;
  if (holds(core, core->itstate >> 4) || insn->always) {
    core->counter++;
    if (refused(core)) {
      return false;
    }
    core->r[15] = next;
    insn->run_in_it(core, insn);
    return !was_not_executed(core->stop);
  }
  core->r[15] = next;
  return true;
}

void core_it_block(Core *core) {
  core->ahead = 0;
  while (core->itstate) {
    const Insn *insn = insn_at_pc(core);
    uint32_t state = core->itstate, next = core->r[15] + (insn ? insn->size : 0);
    if (!insn || !execute_in_it(core, insn)) {
      return;
    }
    core->itstate = it_advance(state);
    if (core->stop != STOP_SLICE || (core->r[15] != next && core->counter >= core->limit)) {
      return; /* a jump out of the middle is UNPREDICTABLE, but must not go on for ever */
    }
  }
}

void core_it_left(Core *core, uint64_t ahead) {
  if (core->stop != STOP_SLICE && was_not_executed(core->stop)) {
    return;
  }
  core->itstate = it_advance(core->itstate);
  if (core->stop != STOP_SLICE) {
    return;
  }
  if (core->itstate && core->counter < core->limit) {
    core_it_block(core);
  } else if (!core->itstate) {
    core->ahead = ahead < core->limit ? ahead : core->limit;
    execute_at(core, core->r[15]);
  }
}

void core_invalid_state(Core *core) {
  stop_behind(core, STOP_INVALID_STATE);
}

static void run(Core *core) {
  while (core->counter < core->limit) {
    Memory *memory = code_at_pc(core);
    if (!memory) {
      return;
    }
    uint32_t base = memory->base, size = memory->size;
    core->code = *memory;
    do {
      uint32_t offset = core->r[15] - base;
      if (UNLIKELY(offset >= size)) {
        break;
      }
      const Insn *insn = fetch(core, memory, offset);
      uint64_t ahead = core->counter + AHEAD;
      core->ahead = ahead < core->limit ? ahead : core->limit;
      core->counter++;
      core->r[15] += insn->size;
      insn->run(core, insn);
    } while (core->counter < core->limit);
  }
}

/* The same while somebody wants to be asked. */
static void run_asking(Core *core) {
  core->ahead = 0;
  while (core->counter < core->limit) {
    Memory *memory = code_at_pc(core);
    if (!memory) {
      return;
    }
    const Insn *insn = fetch(core, memory, core->r[15] - memory->base);
    core->counter++;
    if (refused(core)) {
      return;
    }
    core->r[15] += insn->size;
    insn->run(core, insn);
  }
}

void core_execute(Core *core) {
  if (core->itstate) {
    core_it_block(core);
  }
  if (!core->thumb && core->counter < core->limit) {
    core_invalid_state(core);
  }
  (core->code_hook ? run_asking : run)(core);
}

void core_run(Core *core) {
  core->stop = STOP_SLICE;
  core->must_stop = 0;
  core->wanted = core->limit;
  core->r[15] = core->pc;
  do {
    core_execute(core);
  } while (core->bus && bus_goes_on(core->bus));
  core->pc = core->r[15];
}

void core_forget_code(Core *core, uint32_t address, uint32_t size) {
  for (Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    int64_t begin = (int64_t)(address & ~1u) - memory->base, end = (int64_t)address + size - memory->base;
    end = end < memory->size ? end : memory->size;
    for (int64_t at = begin > 0 ? begin : 0; at < end; at += 2) {
      if (memory->insns[at >> 1].run) { /* untouched pages stay so */
        memory->insns[at >> 1].run = NULL;
      }
    }
  }
}

void core_set_places(Core *core, const uint32_t *addresses, uint32_t count, bool on) {
  for (uint32_t n = 0; n < count; n++) {
    Memory *memory = memory_at(core, addresses[n]);
    if (memory) {
      Insn *insn = &memory->insns[(addresses[n] - memory->base) >> 1];
      insn->place = on;
      insn->run = NULL;
    }
  }
}
