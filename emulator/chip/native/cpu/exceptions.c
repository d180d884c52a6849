/* Exception entry and return (ARMv7-M ARM B1.5).
 *
 * An entry saves the frame, then takes the most urgent pending exception. This exception may have arrived after the
 * entry began (B1.5.11). A return enters a pending exception directly (tail-chaining, B1.5.12). A fault becomes a
 * HardFault if it may not preempt, or if its handler is not enabled (B1.5.14). A HardFault inside HardFault or NMI
 * locks the core up (B1.5.15).
 *
 * Frames have eight words, or 26 with floating point (CONTROL.FPCA). Frames are aligned to eight bytes if
 * CCR.STKALIGN is set or if they have floating point. Bit 9 of the saved xPSR marks padding (B1.5.6 to B1.5.8).
 * Decision: exception entry saves S0 to S15 and FPSCR immediately. A handler cannot detect the difference from
 * lazy stacking (FPCCR.LSPEN) if it restores all registers that it changes.
 *
 * NOT MODELLED: an entry does not clear the exclusive monitor (A3.4); stores are never buffered, so all bus faults
 * are precise.
 */
#include "cpu/exceptions.h"

#include <string.h>

#include "fcu.h"
#include "generated/registers_scb.h"

enum { ENTRY_CYCLES = 12, RETURN_CYCLES = 10, CHAIN_CYCLES = 6 }; /* Cortex-M4 TRM 3.9 */
enum { THREAD = 8, PROCESS_STACK = 4, BASIC_FRAME = 16 };         /* EXC_RETURN (table B1-8) */
enum { TO_HANDLER = 1, TO_THREAD = 9, TO_PROCESS = 13 };          /* lowest four bits of EXC_RETURN */
enum { FRAME = 0x20, FLOATING_FRAME = 0x68, FLOATING_AREA = 0x20 };

#define EXC_RETURN 0xFFFFFFE1u
#define PADDED (1u << 9)
#define IPSR 0x1FFu
#define STORED_XPSR 0xFF0FFDFFu /* all but the padding bit and the reserved bits 23:20 */

static const Fault STACKING = {BUS_FAULT, CFSR_STKERR, 0, 0}, UNSTACKING = {BUS_FAULT, CFSR_UNSTKERR, 0, 0},
                   INVALID_RETURN = {USAGE_FAULT, CFSR_INVPC, 0, 0}, NO_VECTOR = {HARD_FAULT, 0, HFSR_VECTTBL, 0};

static bool pend_fault(Chip *chip, Fault fault);

void exceptions_reset(Chip *chip) {
  chip->exceptions = (Exceptions){.lowest_msp = HIGHEST_ADDRESS};
  chip->exceptions.thread_ps = chip->exceptions.switched_ps = cycle_clock_ps(&chip->cycle_clock, 0);
}

static int execution_priority(const Chip *chip) {
  const Core *core = &chip->core;
  return nvic_execution_priority(&chip->nvic, core->primask, core->basepri, core->faultmask);
}

static int group_priority(const Chip *chip, int number) {
  return nvic_group_priority(&chip->nvic, chip->nvic.priority[number]);
}

bool exceptions_may_preempt(const Chip *chip) {
  int number = nvic_highest_pending(&chip->nvic);
  return number && group_priority(chip, number) < execution_priority(chip);
}

bool exceptions_end_wfi(const Chip *chip) {
  int number = nvic_highest_pending(&chip->nvic);
  const Core *core = &chip->core;
  return number && group_priority(chip, number) <
                       nvic_execution_priority(&chip->nvic, false, core->basepri, core->faultmask);
}

/* Return false if the stack cannot be written. */
static bool push_stack(Chip *chip) {
  Core *core = &chip->core;
  Exceptions *exceptions = &chip->exceptions;
  bool floating = core->control & FPCA, align = chip->scb.ccr & CCR_STKALIGN || floating;
  uint32_t sp = core->r[13], xpsr = read_xpsr(core), size = floating ? FLOATING_FRAME : FRAME;
  uint32_t frame = align ? (sp - size) & ~4u : sp - size;
  uint32_t words[8] = {core->r[0],  core->r[1],  core->r[2],  core->r[3],
                       core->r[12], core->r[14], core->r[15], (xpsr & STORED_XPSR) | (align && sp & 4 ? PADDED : 0)};
  exceptions->exc_return = EXC_RETURN | (floating ? 0 : BASIC_FRAME);
  if (!in_handler(core)) {
    exceptions->exc_return |= THREAD | (core->control & SPSEL ? PROCESS_STACK : 0);
    exceptions->thread_frame = core->control & SPSEL ? frame : 0;
  }
  if (frame < exceptions->lowest_msp && !(exceptions->exc_return & PROCESS_STACK)) {
    exceptions->lowest_msp = frame;
  }
  core->r[13] = frame;
  if (frame - RAM_BASE > RAM_SIZE - size) {
    return false;
  }
  memcpy(core->ram + (frame - RAM_BASE), words, sizeof words);
  if (floating) {
    uint32_t last[2] = {core->fpscr, 0};
    memcpy(core->ram + (frame - RAM_BASE) + FLOATING_AREA, core->s, 64);
    memcpy(core->ram + (frame - RAM_BASE) + FLOATING_AREA + 64, last, sizeof last);
    chip->scb.fpcar = frame + FLOATING_AREA;
  }
  core_ram_written(core, frame, size);
  return true;
}

/* ExceptionTaken(): the handler uses the main stack and has no floating-point context. */
static void enter_handler(Chip *chip, int number, uint32_t vector) {
  Core *core = &chip->core;
  core->thumb = vector & 1;
  write_xpsr(core, (uint32_t)number | (core->thumb ? THUMB : 0));
  write_control(core, core->control & NPRIV);
  core->r[14] = chip->exceptions.exc_return;
  core->r[15] = vector & ~1u;
}

static bool pop_stack(Chip *chip, uint32_t exc_return, uint32_t *address, uint32_t *xpsr) {
  Core *core = &chip->core;
  bool process = (exc_return & 0xF) == TO_PROCESS, floating = !(exc_return & BASIC_FRAME);
  uint32_t frame = read_stack_pointer(core, process), size = floating ? FLOATING_FRAME : FRAME, words[8];
  const uint8_t *bytes = core_bytes_at(core, frame, size);
  if (!bytes) {
    return false;
  }
  memcpy(words, bytes, sizeof words);
  if (floating) {
    memcpy(core->s, bytes + FLOATING_AREA, 64);
    memcpy(&core->fpscr, bytes + FLOATING_AREA + 64, 4);
  }
  memcpy(core->r, words, 16);
  core->r[12] = words[4];
  core->r[14] = words[5];
  *address = words[6];
  *xpsr = words[7] & STORED_XPSR;
  uint32_t sp = (frame + size) | (words[7] & PADDED ? 4 : 0);
  write_control(core, (core->control & NPRIV) | (process ? SPSEL : 0) | (floating ? FLOATING_CONTEXT : 0));
  write_xpsr(core, *xpsr);
  write_stack_pointer(core, process, sp);
  return true;
}

static void schedule_entry(Chip *chip, int cycles) {
  cycle_clock_add_cycles(&chip->cycle_clock, cycles);
  chip->exceptions.entering = 1;
}

static void begin_entry(Chip *chip) {
  bool saved = push_stack(chip);
  schedule_entry(chip, ENTRY_CYCLES);
  if (!saved) {
    pend_fault(chip, STACKING);
  }
}

bool exceptions_take_pending(Chip *chip) {
  if (!exceptions_may_preempt(chip)) {
    return false;
  }
  begin_entry(chip);
  return true;
}

void exceptions_finish_entry(Chip *chip) {
  int number = nvic_highest_pending(&chip->nvic);
  uint32_t vector = 0;
  const uint8_t *bytes = core_bytes_at(&chip->core, chip->scb.vtor + 4 * (uint32_t)number, 4);
  chip->exceptions.entering = 0;
  chip->work += WORK_EXCEPTION;
  chip->costs.exceptions[number].times += number > USAGE_FAULT; /* pend_fault() counts faults */
  chip->costs.exceptions[number].work += WORK_EXCEPTION;
  nvic_activate(&chip->nvic, number);
  chip->nvic.event_register = 1;
  if (!bytes) {
    enter_handler(chip, number, 1);
    exceptions_fault(chip, NO_VECTOR);
    return;
  }
  memcpy(&vector, bytes, 4);
  enter_handler(chip, number, vector);
}

int32_t fcu_enter_exception(Chip *chip, int32_t number, uint32_t vectors) {
  uint32_t vector;
  const uint8_t *bytes = core_bytes_at(&chip->core, vectors + 4 * (uint32_t)number, 4);
  chip->scb.ccr |= CCR_STKALIGN;
  chip->scb.vtor = vectors;
  if (!bytes || !push_stack(chip)) {
    return false;
  }
  memcpy(&vector, bytes, 4);
  enter_handler(chip, number, vector | 1);
  return true;
}

void exceptions_supervisor_call(Chip *chip) {
  if (group_priority(chip, SV_CALL) < execution_priority(chip)) {
    nvic_pend(&chip->nvic, SV_CALL);
    begin_entry(chip);
  } else {
    exceptions_fault(chip, (Fault){HARD_FAULT, 0, HFSR_FORCED, 0});
  }
}

/* Return false if the core locks up. */
static bool escalate(Chip *chip, Fault fault) {
  Scb *scb = &chip->scb;
  int now = execution_priority(chip), number = fault.exception;
  scb->cfsr |= fault.cfsr;
  scb->hfsr |= fault.hfsr;
  if (fault.cfsr & CFSR_BFARVALID) {
    scb->bfar = fault.address;
  }
  if (fault.hfsr & HFSR_DEBUGEVT) {
    scb->dfsr |= DFSR_BKPT;
  }
  if (number != HARD_FAULT && !(scb_fault_enabled(scb, number) && group_priority(chip, number) < now)) {
    number = HARD_FAULT;
    scb->hfsr |= HFSR_FORCED;
  }
  if (number == HARD_FAULT && now <= chip->nvic.priority[HARD_FAULT]) {
    chip->exceptions.entering = 0;
    chip->exceptions.locked_up = 1;
    chip->exceptions.locked_up_pc = chip->core.r[15];
    return false;
  }
  nvic_pend(&chip->nvic, number);
  return true;
}

static bool pend_fault(Chip *chip, Fault fault) {
  bool pending = escalate(chip, fault);
  int64_t before = chip->work;
  chip->host.fault(cycle_clock_ps(&chip->cycle_clock, 0), fault.exception, fault.cfsr, fault.hfsr, fault.address);
  chip->costs.exceptions[fault.exception].times++;
  chip->costs.exceptions[fault.exception].work += chip->work - before;
  return pending;
}

void exceptions_fault(Chip *chip, Fault fault) {
  if (pend_fault(chip, fault)) {
    begin_entry(chip);
  }
}

/* Index: region of 512 MB (ARMv7-M ARM table B3-1). */
static bool is_execute_never(uint32_t address) { return 0xE4u >> (address >> 29) & 1; }

Fault exceptions_fault_for(const Chip *chip, enum Stop stop) {
  switch (stop) {
  case STOP_UNDEFINED: return (Fault){USAGE_FAULT, CFSR_UNDEFINSTR, 0, 0};
  case STOP_INVALID_STATE: return (Fault){USAGE_FAULT, CFSR_INVSTATE, 0, 0};
  case STOP_NO_COPROCESSOR: return (Fault){USAGE_FAULT, CFSR_NOCP, 0, 0};
  case STOP_UNALIGNED: return (Fault){USAGE_FAULT, CFSR_UNALIGNED, 0, 0};
  case STOP_DIVIDE_BY_ZERO: return (Fault){USAGE_FAULT, CFSR_DIVBYZERO, 0, 0};
  case STOP_READ:
  case STOP_WRITE: return (Fault){BUS_FAULT, CFSR_PRECISERR | CFSR_BFARVALID, 0, chip->core.fault_address};
  case STOP_BKPT: return (Fault){HARD_FAULT, 0, HFSR_DEBUGEVT, 0};
  case STOP_FETCH:
    return is_execute_never(chip->core.r[15]) ? (Fault){MEM_MANAGE, CFSR_IACCVIOL, 0, 0}
                                              : (Fault){BUS_FAULT, CFSR_IBUSERR, 0, 0};
  default: return (Fault){0, 0, 0, 0};
  }
}

/* ExceptionReturn (B1.5.8). */
static bool is_valid(const Chip *chip, uint32_t exc_return, int number) {
  bool outermost = nvic_active_count(&chip->nvic) == 1;
  uint32_t kind = exc_return & 0xF;
  if (exc_return >> 5 != 0xFFFFFFFFu >> 5 || number >= EXCEPTIONS || !nvic_is_active(&chip->nvic, number)) {
    return false;
  }
  if (kind == TO_HANDLER) {
    return !outermost;
  }
  return (kind == TO_THREAD || kind == TO_PROCESS) && (outermost || chip->scb.ccr & CCR_NONBASETHRDENA);
}

static void tail_chain(Chip *chip, uint32_t exc_return) {
  chip->exceptions.exc_return = exc_return;
  schedule_entry(chip, CHAIN_CYCLES);
}

static void tail_chain_fault(Chip *chip, Fault fault, uint32_t exc_return) {
  if (pend_fault(chip, fault)) {
    tail_chain(chip, exc_return);
  }
}

static bool return_to_context(Chip *chip, uint32_t exc_return) {
  uint32_t address, xpsr;
  bool to_thread = (exc_return & 0xF) != TO_HANDLER;
  uint32_t frame = (exc_return & 0xF) == TO_PROCESS ? read_stack_pointer(&chip->core, true) : 0;
  if (!pop_stack(chip, exc_return, &address, &xpsr)) {
    tail_chain_fault(chip, UNSTACKING, exc_return);
    return false;
  }
  cycle_clock_add_cycles(&chip->cycle_clock, RETURN_CYCLES);
  chip->core.r[15] = address & ~1u;
  chip->core.thumb = (xpsr & THUMB) != 0;
  if (to_thread == ((xpsr & IPSR) != 0)) {
    exceptions_fault(chip, INVALID_RETURN);
    return false;
  }
  if (to_thread) {
    chip->exceptions.thread_ps = cycle_clock_ps(&chip->cycle_clock, 0);
    if (frame != chip->exceptions.thread_frame) {
      chip->exceptions.switched_ps = chip->exceptions.thread_ps;
    }
  }
  return to_thread && chip->scb.scr & SCR_SLEEPONEXIT;
}

bool exceptions_return(Chip *chip) {
  Core *core = &chip->core;
  uint32_t exc_return = core->r[15] | 1;
  int number = (int)core->ipsr;
  if (!number) {
    /* in Thread mode EXC_RETURN is an ordinary address, which is execute-never */
    exceptions_fault(chip, (Fault){MEM_MANAGE, CFSR_IACCVIOL, 0, 0});
    return false;
  }
  bool valid = is_valid(chip, exc_return, number);
  if (number < EXCEPTIONS) {
    nvic_deactivate(&chip->nvic, number);
  }
  chip->nvic.event_register = 1;
  if (number != NMI) {
    core->faultmask = 0;
  }
  if (!valid) {
    core->r[14] = 0xF0000000u | (exc_return & 0x0FFFFFFF);
    tail_chain_fault(chip, INVALID_RETURN, exc_return);
    return false;
  }
  if (exceptions_may_preempt(chip)) {
    tail_chain(chip, exc_return);
    return false;
  }
  return return_to_context(chip, exc_return);
}
