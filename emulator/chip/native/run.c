/* The loop: chains of blocks, and single instructions where more care is needed. */
#include "blocks.h"
#include "chip.h"

#define CHAIN 1000 /* instructions that are executed without returning to the loop; more than a block has */

/* -- where branches go that the loop deals with ---------------------------------------------------------- */

OPERATION(to_loop) {
  leave_chain(core, core->r[15], budget);
}

OPERATION(return_from_exception) {
  leave_chain(core, core->r[15], budget);
  core->stop = STOP_EXCEPTION_RETURN;
  core->limit = core->counter;
}

const Insn elsewhere = {.run = to_loop}, exception_return = {.run = return_from_exception};

/* -- what is to be executed ------------------------------------------------------------------------------ */

static void stop(Core *core, enum Stop why) {
  core->stop = why;
  core->limit = core->counter;
}

/* Where PC is; NULL, and the run has ended, if nothing can be executed there. */
static const Memory *code_at_pc(Core *core) {
  if (!core->thumb) {
    stop(core, STOP_INVALID_STATE);
    return NULL;
  }
  core->r[15] &= ~1u;
  for (const Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    if (core->r[15] - memory->base < memory->size) {
      return memory;
    }
  }
  stop(core, STOP_FETCH);
  return NULL;
}

/* -- one instruction ------------------------------------------------------------------------------------- */

static bool was_not_executed(enum Stop stop) {
  return stop > STOP_EXCEPTION_RETURN || stop == STOP_PLACE || stop == STOP_BKPT;
}

/* ConditionPassed (A7.3.1); condition is 0..14, 15 counts as always. A mask for each condition has the bits
 * NZCV (as a number) with which it holds. */
static bool holds(const Core *core, unsigned condition) {
  static const uint16_t masks[16] = {0xF0F0, 0x0F0F, 0xCCCC, 0x3333, 0xFF00, 0x00FF, 0xAAAA, 0x5555,
                                     0x0C0C, 0xF3F3, 0xAA55, 0x55AA, 0x0A05, 0xF5FA, 0xFFFF, 0xFFFF};
  unsigned nzcv = core->n >> 31 << 3 | (unsigned)(core->z == 0) << 2 | core->c << 1 | core->v >> 31;
  return masks[condition] >> nzcv & 1;
}

/* The instruction at PC, with everything that can be about it; false if the run is to end before it. */
static bool step(Core *core) {
  const Memory *memory = code_at_pc(core);
  if (!memory) {
    return false;
  }
  uint32_t state = core->itstate, address = core->r[15];
  const Insn *first = blocks_single(core, memory, address), *insn = first;
  while (insn->left == 0) {
    insn++;
  }
  uint32_t next = address_after(memory, address);
  if (core->counter >= core->limit) {
    return false;
  }
  if (state && !holds(core, state >> 4) && !(insn->kind & ALWAYS)) {
    core->counter++;
    core->r[15] = next;
    core->itstate = it_advance(state);
    return true;
  }
  if (is_place(memory, address) && address != core->passing) {
    stop(core, STOP_PLACE);
    return false;
  }
  core->counter++;
  core->mask = insn->kind & MASKED && insn->a ? 0 : -1u;
  if (insn->kind & IS_IT) {
    core->r[15] = next;
    core->itstate = insn->imm;
    return true;
  }
  core->end = core->bound = core->counter;
  first->run(core, first, 0);
  core->itstate = was_not_executed(core->stop) ? state : it_advance(state);
  return true;
}

/* The rest of an IT block, as far as the limit allows. */
static void finish_it_block(Core *core) {
  while (core->itstate && core->stop == STOP_SLICE && step(core)) {
  }
}

/* -- many instructions ----------------------------------------------------------------------------------- */

/* False: the next thing is an IT block that the limit does not allow as a whole. */
static bool chain(Core *core, const Memory *memory) {
  const Insn *block = blocks_at(core, memory, core->r[15]);
  uint64_t allowed = core->limit - core->counter;
  int32_t budget = allowed < CHAIN ? (int32_t)allowed : CHAIN;
  if (block->left > budget) {
    block = blocks_part(core, block, (unsigned)budget);
    if (!block) {
      return false;
    }
  }
  core->code = *memory;
  core->end = core->bound = core->counter + (uint64_t)budget;
  block->run(core, block, budget - block->left);
  return true;
}

void core_execute(Core *core) {
  finish_it_block(core);
  while (core->stop == STOP_SLICE && core->counter < core->limit) {
    const Memory *memory = code_at_pc(core);
    if (!memory) {
      return;
    }
    if (is_place(memory, core->r[15]) || !chain(core, memory)) {
      step(core);
    }
    finish_it_block(core);
  }
}

bool core_exception_waits(const Core *core) { return nvic_any_ready(&core->chip->nvic); }

void core_masks_changed(Core *core) {
  core->chip->nvic.changed = 1;
  machine_end_in_time(core->chip);
}

void core_send_event(Core *core) { core->chip->nvic.event = 1; }
