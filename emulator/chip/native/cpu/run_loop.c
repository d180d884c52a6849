/* The main loop; run_loop.h explains it. */
#include "cpu/run_loop.h"

#include <string.h>

#include "cpu/decode_cache.h"
#include "cpu/value_log.h"
#include "fcu.h"

#define MAX_RUN 2000000                  /* instructions: about 10 ms of the host */
#define MAX_CHAIN 1000                   /* instructions without a return to the main loop; larger than a block */
#define RESET_PULSE_PS INT64_C(20000000) /* minimum (RM0368 6.1.1) */
#define STANDBY_PS INT64_C(314000000)    /* wake-up from Standby, typical (STM32F401xB/C datasheet, wake-up timings) */

void run_loop_create(Chip *chip) {
  cycle_clock_create(&chip->cycle_clock, 13, 10, chip->clocks.hclk_hz);
  chip->run_loop = (RunLoop){0};
}

OPERATION(return_to_loop) {
  exit_chain(core, core->r[15], budget);
}

OPERATION(return_from_exception) {
  exit_chain(core, core->r[15], budget);
  core->stop = STOP_EXCEPTION_RETURN;
  core->limit = core->counter;
}

const Insn exit_to_loop = {.run = return_to_loop}, exception_return = {.run = return_from_exception};

static void end_run(Core *core, enum Stop why) {
  core->stop = why;
  core->limit = core->counter;
}

/* Return NULL if the address has no code; the run has then ended. */
static const Memory *code_at_pc(Core *core) {
  if (!core->thumb) {
    end_run(core, STOP_INVALID_STATE);
    return NULL;
  }
  core->r[15] &= ~1u;
  for (const Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    if (core->r[15] - memory->base < memory->size) {
      return memory;
    }
  }
  end_run(core, STOP_FETCH);
  return NULL;
}

static bool was_not_executed(enum Stop stop) {
  return stop > STOP_EXCEPTION_RETURN || stop == STOP_BREAKPOINT || stop == STOP_BKPT;
}

/* ConditionPassed() (A7.3.1). Bit n of a mask is 1 if the condition holds for the value n of the flags
 * NZCV. */
static bool condition_passed(const Core *core, unsigned condition) {
  static const uint16_t masks[16] = {0xF0F0, 0x0F0F, 0xCCCC, 0x3333, 0xFF00, 0x00FF, 0xAAAA, 0x5555,
                                     0x0C0C, 0xF3F3, 0xAA55, 0x55AA, 0x0A05, 0xF5FA, 0xFFFF, 0xFFFF};
  unsigned nzcv = core->n >> 31 << 3 | (unsigned)(core->z == 0) << 2 | core->c << 1 | core->v >> 31;
  return masks[condition] >> nzcv & 1;
}

/* Return false if the run ends before the instruction. */
static bool step(Core *core) {
  const Memory *memory = code_at_pc(core);
  if (!memory) {
    return false;
  }
  uint32_t state = core->itstate, address = core->r[15];
  const Insn *first = decode_cache_single(core, memory, address), *insn = first;
  while (insn->remaining == 0) {
    insn++;
  }
  uint32_t next = address_after(memory, address);
  if (core->counter >= core->limit) {
    return false;
  }
  if (state && !condition_passed(core, state >> 4) && !(insn->flags & UNCONDITIONAL)) {
    core->counter++;
    core->r[15] = next;
    core->itstate = it_advance(state);
    return true;
  }
  if (code_flags(memory, address) & BREAKPOINT && address != core->step_over) {
    end_run(core, STOP_BREAKPOINT);
    return false;
  }
  if (core->value_log && code_flags(memory, address) & LOGGED) {
    value_log_add(core, address);
  }
  core->counter++;
  core->it_mask = insn->flags & PREDICATED && insn->a ? 0 : -1u;
  if (insn->flags & IS_IT) {
    core->r[15] = next;
    core->itstate = insn->imm;
    return true;
  }
  core->chain_end = core->chain_limit = core->counter;
  first->run(core, first, 0);
  core->itstate = was_not_executed(core->stop) ? state : it_advance(state);
  return true;
}

static void finish_it_block(Core *core) {
  while (core->itstate && core->stop == STOP_SLICE && step(core)) {
  }
}

/* Return false if an IT block exceeds the limit. */
static bool run_chain(Core *core, const Memory *memory) {
  const Insn *block = decode_cache_block(core, memory, core->r[15]);
  uint64_t allowed = core->limit - core->counter;
  int32_t budget = allowed < MAX_CHAIN ? (int32_t)allowed : MAX_CHAIN;
  if (block->remaining > budget) {
    block = decode_cache_prefix(core, block, (unsigned)budget);
    if (!block) {
      return false;
    }
  }
  core->code = *memory;
  core->chain_end = core->chain_limit = core->counter + (uint64_t)budget;
  block->run(core, block, budget - block->remaining);
  return true;
}

/* Execute from r[15] until limit or stop. */
static void execute(Core *core) {
  finish_it_block(core);
  while (core->stop == STOP_SLICE && core->counter < core->limit) {
    const Memory *memory = code_at_pc(core);
    if (!memory) {
      return;
    }
    if (is_stepped(memory, core->r[15]) || !run_chain(core, memory)) {
      step(core);
    }
    finish_it_block(core);
  }
}

/* -- runs between events ------------------------------------------------------------------------------ */

static int64_t min64(int64_t one, int64_t other) { return one < other ? one : other; }

static int64_t next_event_ps(const Chip *chip) { return min64(chip->next_ps, chip->host_next_ps); }

void run_loop_update_limit(Chip *chip) {
  RunLoop *run_loop = &chip->run_loop;
  Core *core = &chip->core;
  if (!run_loop->running) {
    return;
  }
  int64_t end_ps = min64(next_event_ps(chip), run_loop->until_ps), counter = (int64_t)core->counter;
  if (end_ps < run_loop->slice_end_ps) {
    int64_t left = cycle_clock_count_at(&chip->cycle_clock, end_ps) - chip->cycle_clock.count;
    left = left > counter ? left : counter;
    run_loop->slice_end_ps = end_ps;
    run_loop->slice_end = min64(run_loop->slice_end, chip->cycle_clock.count + left);
    core_set_limit(core, (uint64_t)min64(left, (int64_t)core->limit));
  }
  if (chip->nvic.changed || chip->must_stop || run_loop->reset_reason || run_loop->halt_requested ||
      chip->work > chip->work_limit) {
    core_set_limit(core, core->counter);
  }
}

void run_loop_hclk_changed(Chip *chip) {
  RunLoop *run_loop = &chip->run_loop;
  int64_t hclk_hz = chip->clocks.hclk_hz;
  if (!run_loop->running) {
    int64_t now_ps = cycle_clock_ps(&chip->cycle_clock, 0);
    cycle_clock_set_rate(&chip->cycle_clock, hclk_hz, now_ps > chip->now_ps ? now_ps : chip->now_ps, 0);
    return;
  }
  cycle_clock_set_rate(&chip->cycle_clock, hclk_hz, chip->now_ps, (int64_t)chip->core.counter - 1);
  run_loop->slice_end_ps = NEVER_PS;
  run_loop->slice_end = chip->cycle_clock.count + (int64_t)chip->core.limit;
  run_loop_update_limit(chip);
}

bool core_exception_pending(const Core *core) { return nvic_any_ready(&core->chip->nvic); }

void core_masks_changed(Core *core) {
  core->chip->nvic.changed = 1;
  run_loop_update_limit(core->chip);
}

void core_send_event(Core *core) { core->chip->nvic.event_register = 1; }

static void handle_stop(Chip *chip, enum Stop stop) {
  RunLoop *run_loop = &chip->run_loop;
  switch (stop) {
  case STOP_SLICE: break;
  case STOP_EXCEPTION_RETURN:
    if (exceptions_return(chip)) {
      run_loop->asleep = SLEEPS_WFI;
    }
    break;
  case STOP_SVC: exceptions_supervisor_call(chip); break;
  case STOP_WFI: run_loop->asleep = SLEEPS_WFI; break;
  case STOP_WFE: run_loop->asleep = SLEEPS_WFE; break;
  case STOP_BREAKPOINT: run_loop->halt_requested = 1; break;
  case STOP_BKPT:
    if (run_loop->debug_enabled) {
      run_loop->halted_on_bkpt = run_loop->halt_requested = 1;
      break;
    } /* fall through */
  default: exceptions_fault(chip, exceptions_fault_for(chip, stop));
  }
}

enum Stop run_loop_run(Chip *chip, int64_t instructions) {
  Core *core = &chip->core;
  poll_skip_invalidate(&chip->poll_skip);
  core->counter = 0;
  core->limit = (uint64_t)instructions;
  core->stop = STOP_SLICE;
  chip->run_loop.running = 1;
  execute(core);
  chip->run_loop.running = 0;
  chip->run_loop.executed = (int64_t)core->counter;
  chip->cycle_clock.count += (int64_t)core->counter;
  chip->work += (int64_t)core->counter + WORK_RUN;
  chip->costs.instructions.times += (int64_t)core->counter;
  chip->costs.instructions.work += (int64_t)core->counter + WORK_RUN;
  core->counter = core->limit = 0;
  handle_stop(chip, core->stop);
  return core->stop;
}

bool run_loop_step(Chip *chip) {
  bool ordinary = run_loop_run(chip, 1) == STOP_SLICE;
  bool due = next_event_ps(chip) <= cycle_clock_ps(&chip->cycle_clock, 0);
  return ordinary && !due && !exceptions_may_preempt(chip) && !chip->run_loop.reset_reason &&
         !chip->run_loop.halt_requested && !chip->must_stop;
}

static void execute_or_skip(Chip *chip, int64_t instructions) {
  poll_skip_reset(chip);
  if (!chip->poll_skip.enabled) {
    run_loop_run(chip, instructions);
  } else if (!idle_skip_execute(chip, instructions) &&
             run_loop_run(chip, min64(instructions, chip->idle_skip.check_interval)) == STOP_SLICE) {
    idle_skip_check(chip);
  }
}

static void execute_run(Chip *chip) {
  RunLoop *run_loop = &chip->run_loop;
  cycle_clock_move_origin(&chip->cycle_clock);
  run_loop->slice_end_ps = min64(next_event_ps(chip), run_loop->until_ps);
  int64_t left = cycle_clock_count_at(&chip->cycle_clock, run_loop->slice_end_ps) - chip->cycle_clock.count;
  left = min64(left, MAX_RUN);
  run_loop->slice_end = chip->cycle_clock.count + left;
  if (run_loop->stepping) {
    chip->core.step_over = chip->core.r[15];
    run_loop_run(chip, 1);
    chip->core.step_over = 1;
    run_loop->halt_requested = 1;
  } else {
    execute_or_skip(chip, left);
  }
}

/* -- sleep and reset ------------------------------------------------------------------------------------- */

static bool is_woken(Chip *chip) {
  if (chip->run_loop.asleep == SLEEPS_WFE) {
    bool event = chip->nvic.event_register;
    chip->nvic.event_register = 0;
    return event || exceptions_may_preempt(chip);
  }
  return exceptions_end_wfi(chip);
}

static void wake(Chip *chip) {
  RunLoop *run_loop = &chip->run_loop;
  bool stopped = run_loop->depth == STOPPED || run_loop->depth == WAKING;
  run_loop->asleep = AWAKE;
  run_loop->depth = LIGHT;
  if (stopped) {
    python_registers_invalidate(chip);
    chip->host.stop_ended(chip->now_ps);
  }
}

/* Sleep with SLEEPDEEP set (RM0368 5.3.5, 5.3.6). Return false if the chip does not sleep. */
static bool sleep_deeply(Chip *chip) {
  RunLoop *run_loop = &chip->run_loop;
  python_registers_invalidate(chip);
  int64_t result = chip->host.deep_sleep(chip->now_ps);
  run_loop->depth = result == DEEP_STANDBY ? STANDBY : result == DEEP_WITH_CLOCKS ? CLOCKED : STOPPED;
  run_loop->wake_up_ps = result;
  if (result == DEEP_REFUSED) {
    run_loop->depth = LIGHT;
    wake(chip);
  }
  return run_loop->asleep;
}

/* In Stop only EXTI has a clock, so other interrupts do not end it. */
static bool stays_stopped(Chip *chip) {
  RunLoop *run_loop = &chip->run_loop;
  if (run_loop->depth == STOPPED && exti_wakes(&chip->exti) && is_woken(chip)) {
    run_loop->depth = WAKING;
    run_loop->wakes_ps = chip->now_ps + run_loop->wake_up_ps;
  }
  if (run_loop->depth == WAKING && chip->now_ps >= run_loop->wakes_ps) {
    wake(chip);
  }
  return run_loop->asleep;
}

static bool stays_asleep(Chip *chip) {
  RunLoop *run_loop = &chip->run_loop;
  if (run_loop->asleep == AWAKE) {
    return false;
  }
  if (run_loop->depth == STANDBY) {
    return true;
  }
  if (run_loop->depth == STOPPED || run_loop->depth == WAKING) {
    return stays_stopped(chip);
  }
  if (is_woken(chip)) {
    wake(chip);
    return false;
  }
  return run_loop->depth == CLOCKED || !scb_sleeps_deeply(&chip->scb) || sleep_deeply(chip);
}

static void report_lock_up(Chip *chip) {
  if (chip->exceptions.locked_up && !chip->run_loop.reported_lock_up) {
    chip->run_loop.reported_lock_up = 1;
    chip->host.locked_up(chip->now_ps, chip->exceptions.locked_up_pc);
  }
}

void fcu_start(Chip *chip) {
  Core *core = &chip->core;
  uint32_t stack, vector;
  memcpy(&stack, chip->flash, 4);
  memcpy(&vector, chip->flash + 4, 4);
  nvic_reset(&chip->nvic);
  systick_reset(&chip->systick);
  dwt_reset(&chip->dwt);
  scb_reset(&chip->scb);
  exceptions_reset(chip);
  core_reset(core);
  write_xpsr(core, THUMB);
  write_stack_pointer(core, false, stack);
  core->r[14] = 0xFFFFFFFF;
  core->r[15] = vector & ~1u;
  core->thumb = vector & 1;
}

static void reset(Chip *chip) {
  RunLoop *run_loop = &chip->run_loop;
  int32_t reason = run_loop->reset_reason;
  run_loop->reset_reason = RESET_NONE;
  run_loop->asleep = AWAKE;
  run_loop->depth = LIGHT;
  run_loop->reported_lock_up = 0;
  int64_t before = chip->work;
  python_registers_invalidate(chip);
  chip->host.reset(chip->now_ps, reason); /* RCC is reset last, so that no peripheral gets new clocks with old
                                             settings */
  fcu_start(chip);
  int64_t pulse_ps = reason == RESET_STANDBY ? STANDBY_PS : RESET_PULSE_PS;
  cycle_clock_sleep_until(&chip->cycle_clock, chip->now_ps + pulse_ps);
  chip->work += WORK_RESET;
  chip->costs.resets.times++;
  chip->costs.resets.work += chip->work - before;
}

void fcu_request_reset(Chip *chip, int32_t reason) {
  if (!chip->run_loop.reset_reason) {
    chip->run_loop.reset_reason = reason;
  }
  run_loop_update_limit(chip);
}

void fcu_reset_now(Chip *chip, int32_t reason) {
  chip->run_loop.reset_reason = reason;
  reset(chip);
}

static bool is_halted(const Chip *chip) { return chip->run_loop.halt_requested && !chip->exceptions.entering; }

int32_t fcu_is_halted(const Chip *chip) { return is_halted(chip); }

void fcu_halt(Chip *chip) {
  bool was_halted = is_halted(chip);
  chip->run_loop.halt_requested = 1;
  if (chip->run_loop.running) {
    run_loop_update_limit(chip);
  } else if (!was_halted) {
    fcu_run_until(chip, cycle_clock_ps(&chip->cycle_clock, 0) + 1);
  }
}

void fcu_resume(Chip *chip, int32_t step) {
  chip->run_loop.halt_requested = 0;
  chip->run_loop.stepping = step != 0;
}

void fcu_wake(Chip *chip) {
  if (chip->run_loop.depth != STANDBY) {
    wake(chip);
  }
}

void fcu_debug(Chip *chip, int32_t on) { chip->run_loop.debug_enabled = on != 0; }

int32_t fcu_halted_on_bkpt(Chip *chip) {
  int32_t met = chip->run_loop.halted_on_bkpt;
  chip->run_loop.halted_on_bkpt = 0;
  return met;
}

/* Return false if no work is due. */
static bool between_instructions(Chip *chip) {
  RunLoop *run_loop = &chip->run_loop;
  if (run_loop->reset_reason) {
    reset(chip);
  } else if (chip->exceptions.entering) {
    exceptions_finish_entry(chip);
    run_loop->halt_requested |= run_loop->stepping;
  } else if (chip->exceptions.locked_up || stays_asleep(chip)) {
    report_lock_up(chip);
    int64_t wakes_ps = run_loop->depth == WAKING ? run_loop->wakes_ps : NEVER_PS;
    int64_t until_ps = min64(wakes_ps, run_loop->until_ps);
    cycle_clock_sleep_until(&chip->cycle_clock, min64(next_event_ps(chip), until_ps));
  } else {
    chip->nvic.changed = 0;
    return nvic_any_ready(&chip->nvic) && exceptions_take_pending(chip);
  }
  return true;
}

int32_t fcu_run_until(Chip *chip, int64_t at_ps) {
  RunLoop *run_loop = &chip->run_loop;
  run_loop->until_ps = at_ps;
  python_registers_invalidate(chip);
  for (;;) {
    int64_t core_ps = cycle_clock_ps(&chip->cycle_clock, 0), due_ps = min64(core_ps, at_ps);
    if (next_event_ps(chip) <= due_ps) {
      chip_advance(chip, due_ps);
    }
    if (!chip->must_stop && core_ps >= at_ps) {
      chip_advance(chip, at_ps);
      if (!chip->must_stop) {
        return ENDED_AT_TIME;
      }
    }
    if (chip->must_stop) {
      return ENDED_BY_HOST;
    }
    if (chip->work > chip->work_limit) {
      return ENDED_BY_WORK;
    }
    if (core_ps > chip->now_ps) {
      chip->now_ps = core_ps;
    }
    if (is_halted(chip)) {
      return ENDED_HALTED;
    }
    if (!between_instructions(chip)) {
      execute_run(chip);
    }
  }
}

int32_t fcu_execute(Chip *chip, int64_t instructions, int32_t step_over) {
  Core *core = &chip->core;
  chip->bare = 1;
  chip->poll_skip.enabled = 0;
  core->fpu_on = 1;
  core->counter = 0;
  core->limit = (uint64_t)instructions;
  core->stop = STOP_SLICE;
  core->step_over = step_over ? core->r[15] : 1;
  execute(core);
  core->step_over = 1;
  return core->stop;
}

void fcu_end_run(Chip *chip) { core_set_limit(&chip->core, chip->core.counter); }

int64_t fcu_executed(const Chip *chip) { return (int64_t)chip->core.counter; }

uint32_t fcu_fault_address(const Chip *chip) { return chip->core.fault_address; }
