/* The library's face; fcu.h explains it. */
#include "fcu.h"

#include <string.h>

#include "registers_scb.h"

#define HOST_SOURCE 63

Chip *fcu_create(const Host *host) { return chip_create(host); }

void fcu_destroy(Chip *chip) { chip_destroy(chip); }

uint8_t *fcu_flash(Chip *chip) { return chip->flash; }

uint8_t *fcu_ram(Chip *chip) { return chip->ram; }

uint8_t *fcu_system_memory(Chip *chip) { return chip->system_memory; }

void fcu_forget_code(Chip *chip) { core_forget_all_code(&chip->core); }

void fcu_read_registers(const Chip *chip, const int32_t *numbers, uint32_t *values, int32_t count) {
  core_read_registers(&chip->core, numbers, values, count);
}

void fcu_write_registers(Chip *chip, const int32_t *numbers, const uint32_t *values, int32_t count) {
  core_write_registers(&chip->core, numbers, values, count);
}

int32_t fcu_thumb(const Chip *chip) { return (int32_t)chip->core.thumb; }

void fcu_set_thumb(Chip *chip, int32_t thumb) { chip->core.thumb = thumb != 0; }

void fcu_configure(Chip *chip, int64_t cycles_num, int64_t cycles_den, int32_t skip) {
  timeline_create(&chip->timeline, cycles_num, cycles_den, chip->clocks.hclk_hz);
  chip->waiting.enabled = skip;
}

void fcu_start(Chip *chip) { machine_start(chip); }

int32_t fcu_run_until(Chip *chip, int64_t at_ps) { return machine_run_until(chip, at_ps); }

int32_t fcu_execute(Chip *chip, int64_t instructions, int32_t past) {
  Core *core = &chip->core;
  chip->bare = 1;
  chip->waiting.enabled = 0;
  core->fpu_on = 1;
  core->counter = 0;
  core->limit = (uint64_t)instructions;
  core->stop = STOP_SLICE;
  core->passing = past ? core->r[15] : 1;
  core_execute(core);
  core->passing = 1;
  return core->stop;
}

void fcu_cut(Chip *chip) { core_limit(&chip->core, chip->core.counter); }

int32_t fcu_enter_exception(Chip *chip, int32_t number, uint32_t vectors) {
  chip->scb.ccr |= CCR_STKALIGN;
  chip->scb.vtor = vectors;
  return exceptions_enter_now(chip, number);
}

int64_t fcu_executed(const Chip *chip) { return (int64_t)chip->core.counter; }

uint32_t fcu_fault_address(const Chip *chip) { return chip->core.fault_address; }

void fcu_request_reset(Chip *chip, int32_t reason) { machine_request_reset(chip, reason); }

void fcu_reset_now(Chip *chip, int32_t reason) { machine_reset_now(chip, reason); }

void fcu_halt(Chip *chip) { machine_halt(chip); }

void fcu_resume(Chip *chip, int32_t step) { machine_resume(chip, step); }

int32_t fcu_is_halted(const Chip *chip) { return machine_is_halted(chip); }

void fcu_wake(Chip *chip) { chip->machine.asleep = AWAKE; }

void fcu_debug(Chip *chip, int32_t on) { chip->machine.debugged = on != 0; }

int32_t fcu_met_breakpoint_instruction(Chip *chip) {
  int32_t met = chip->machine.on_bkpt;
  chip->machine.on_bkpt = 0;
  return met;
}

void fcu_set_breakpoint(Chip *chip, uint32_t address, int32_t on) {
  core_set_places(&chip->core, &address, 1, on);
}

void fcu_watch_memory(Chip *chip, int32_t on, uint32_t begin, uint32_t end) {
  core_watch_memory(&chip->core, on, begin, end);
}

void fcu_status(const Chip *chip, Status *status) {
  const Nvic *nvic = &chip->nvic;
  const Core *core = &chip->core;
  *status = (Status){
      .now_ps = timeline_ps(&chip->timeline, 0),
      .retired = timeline_retired(&chip->timeline),
      .skipped = chip->waiting.skipped,
      .accesses = chip->waiting.accesses,
      .thread_ps = chip->exceptions.thread_ps,
      .pending = {nvic->pending[0], nvic->pending[1]},
      .enabled = {nvic->enabled[0], nvic->enabled[1]},
      .active = {nvic->active[0], nvic->active[1]},
      .level = nvic_level(nvic, core->primask, core->basepri, core->faultmask),
      .lowest = chip->exceptions.lowest,
      .locked_up = chip->exceptions.locked_up,
      .locked_up_pc = chip->exceptions.locked_up_pc,
      .asleep = chip->machine.asleep,
  };
}

int32_t fcu_priority(const Chip *chip, int32_t exception) { return chip->nvic.priority[exception]; }

int32_t fcu_priority_group(const Chip *chip, int32_t priority) { return nvic_group(&chip->nvic, priority); }

int32_t fcu_load(Chip *chip, uint32_t address, uint32_t size, uint32_t *value) {
  chip_settle(chip);
  return bus_load(chip, address, size, value);
}

int32_t fcu_store(Chip *chip, uint32_t address, uint32_t size, uint32_t value) {
  chip_settle(chip);
  return bus_store(chip, address, size, value);
}

int32_t fcu_block_at(const Chip *chip, uint32_t address) {
  const Block *block = chip_block_at(chip, address);
  return block ? block->index : -1;
}

int64_t fcu_snapshot_size(void) { return sizeof(Chip); }

void fcu_save(const Chip *chip, void *snapshot) { memcpy(snapshot, chip, sizeof *chip); }

/* What was decoded is not part of it: where code may be another one it is decoded anew. What a debugger has asked for
 * stays as it is. */
void fcu_restore(Chip *chip, const void *snapshot) {
  const Chip *saved = snapshot;
  Core *core = &chip->core;
  uint32_t watches = core->watches, begin = core->data_begin, end = core->data_end;
  uint32_t code_in_ram = (core->slow_stores | saved->core.slow_stores) & STORES_CHANGE_CODE;
  uint8_t debugged = chip->machine.debugged;
  bool other_code = core->fpu_on != saved->core.fpu_on || code_in_ram ||
                    memcmp(chip->flash, saved->flash, sizeof chip->flash) != 0;
  memcpy(chip, saved, sizeof *chip);
  core->unlinked = NULL;
  core->slow_stores |= code_in_ram;
  chip->machine.debugged = debugged;
  if (other_code) {
    core_forget_all_code(core);
  }
  core_watch_memory(core, watches, begin, end);
}

void fcu_advance(Chip *chip, int64_t to_ps) { chip_advance(chip, to_ps); }

void fcu_settle(Chip *chip) { chip_settle(chip); }

int64_t fcu_next_event(const Chip *chip) { return chip->next_ps; }

void fcu_set_clocks(Chip *chip, const Clocks *clocks) { chip_set_clocks(chip, clocks); }

int32_t fcu_block_count(const Chip *chip) { return chip->block_count; }

uint32_t fcu_block_base(const Chip *chip, int32_t index) { return chip->blocks[index]->base; }

void fcu_gate(Chip *chip, int32_t index, int32_t clocked) {
  Block *block = chip->blocks[index];
  block->clocked = clocked != 0;
  if (block->type->gated) {
    block->type->gated(block);
  }
}

void fcu_reset_block(Chip *chip, int32_t index) { chip->blocks[index]->type->reset(chip->blocks[index]); }

uint32_t fcu_read_block(Chip *chip, int32_t index, uint32_t offset) {
  chip_settle(chip);
  chip->until_ps = NEVER_PS;
  return chip->blocks[index]->type->read(chip->blocks[index], offset, &chip->until_ps);
}

uint32_t fcu_peek_block(Chip *chip, int32_t index, uint32_t offset) {
  return chip->blocks[index]->type->peek(chip->blocks[index], offset);
}

int32_t fcu_is_pure(Chip *chip, int32_t index, uint32_t offset) {
  const Block *block = chip->blocks[index];
  return !block->type->is_pure || block->type->is_pure(block, offset);
}

void fcu_write_block(Chip *chip, int32_t index, uint32_t offset, uint32_t value, uint32_t mask) {
  chip_settle(chip);
  chip->blocks[index]->type->write(chip->blocks[index], offset, value & mask, mask);
}

void fcu_set_irq(Chip *chip, int32_t number, int32_t level) {
  chip_set_irq(chip, HOST_SOURCE, number, level != 0);
}

int32_t fcu_irq_level(const Chip *chip, int32_t number) { return chip->irq_sources[number] != 0; }

void fcu_watch_irqs(Chip *chip, void (*changed)(int64_t now_ps, int32_t number, int32_t level)) {
  chip->irq_changed = changed;
}

void fcu_set_alternate(Chip *chip, int32_t port, int32_t pin, int32_t function) {
  chip->alternate[port][pin] = (int8_t)function;
}
