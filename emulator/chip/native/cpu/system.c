/* Special registers, hints and barriers (ARMv7-M ARM B5.2, A5.3.4). */
#include "cpu/system.h"

#include "peripherals/nvic.h"

/* Values of SYSm (table B5-1); 0 to 7 are xPSR. */
enum SpecialRegister {
  MSP = 8,
  PSP = 9,
  PRIMASK = 16,
  BASEPRI = 17,
  BASEPRI_MAX = 18,
  FAULTMASK = 19,
  CONTROL = 20,
};

static bool privileged(const Core *core) { return in_handler(core) || !(core->control & NPRIV); }

/* FAULTMASK cannot be set in NMI and HardFault (B5.2.1, B5.2.3). */
static void set_faultmask(Core *core, uint32_t value) {
  core->faultmask = value && core->ipsr != NMI && core->ipsr != HARD_FAULT;
}

/* Bit 0 of SYSm selects IPSR; bit 2 excludes APSR. EPSR reads as 0. */
static uint32_t program_status(const Core *core, unsigned which) {
  uint32_t apsr = read_xpsr(core) & 0xF80F0000;
  return (which & 4 ? 0 : apsr) | ((which & 1) && privileged(core) ? core->ipsr : 0);
}

static uint32_t special_register(Core *core, unsigned number) {
  if (number < 8) {
    return program_status(core, number);
  }
  if (number == CONTROL) {
    return core->control & (NPRIV | SPSEL | FPCA);
  }
  if (!privileged(core)) {
    return 0;
  }
  switch (number) {
  case MSP: return read_stack_pointer(core, false);
  case PSP: return read_stack_pointer(core, true);
  case PRIMASK: return core->primask;
  case BASEPRI:
  case BASEPRI_MAX: return core->basepri;
  case FAULTMASK: return core->faultmask;
  default: return 0;
  }
}

COMPUTATION(mrs, core->r[insn->d] = special_register(core, insn->imm))

static void set_control(Core *core, uint32_t value) {
  uint32_t settable = NPRIV | FPCA | (in_handler(core) ? 0 : SPSEL);
  write_control(core, (core->control & ~settable) | (value & settable));
}

static void write_special_register(Core *core, unsigned number, uint32_t value) {
  uint32_t priority = value & 0xFF;
  if (!privileged(core)) {
    return;
  }
  switch (number) {
  case MSP: write_stack_pointer(core, false, value); break;
  case PSP: write_stack_pointer(core, true, value); break;
  case PRIMASK: core->primask = value & 1; break;
  case BASEPRI: core->basepri = priority; break;
  case BASEPRI_MAX:
    if (priority && (priority < core->basepri || !core->basepri)) {
      core->basepri = priority;
    }
    break;
  case FAULTMASK: set_faultmask(core, value & 1); break;
  case CONTROL: set_control(core, value); break;
  }
}

/* Called after a write to a mask, because an exception may now preempt. */
INLINE void continue_unmasked(Core *core, const Insn *insn, int32_t budget) {
  if (LIKELY(!core_exception_pending(core))) {
    NEXT;
  }
  sync_state(core, insn, budget);
  core_masks_changed(core);
  resume_chain(core, insn);
}

OPERATION(msr) {
  write_special_register(core, insn->imm, core->r[insn->n]);
  continue_unmasked(core, insn, budget);
}

/* shift: bit 1 for NZCVQ, bit 0 for GE. */
COMPUTATION(msr_apsr, write_apsr(core, core->r[insn->n], insn->shift & 2, insn->shift & 1))

/* shift: bit 1 for PRIMASK, bit 0 for FAULTMASK; imm: value. */
OPERATION(cps) {
  if (privileged(core)) {
    if (insn->shift & 2) {
      core->primask = insn->imm;
    }
    if (insn->shift & 1) {
      set_faultmask(core, insn->imm);
    }
  }
  continue_unmasked(core, insn, budget);
}

bool decode_cps(uint16_t first, Insn *insn) {
  insn->run = cps;
  insn->imm = bits(first, 4, 4);
  insn->shift = bits(first, 1, 0);
  return bits(first, 3, 2) == 0;
}

/* Barriers also use nop(), because accesses complete immediately. */
void nop(Core *core, const Insn *insn, int32_t budget) { NEXT; }

OPERATION(wfe) { stop_after(core, insn, budget, STOP_WFE); }
OPERATION(wfi) { stop_after(core, insn, budget, STOP_WFI); }

COMPUTATION(sev, core_send_event(core))
COMPUTATION(clrex, core->exclusive = 0)

bool decode_hint(unsigned number, Insn *insn) {
  insn->run = number == 2 ? wfe : number == 3 ? wfi : number == 4 ? sev : nop;
  insn->flags |= number == 2 || number == 3 ? ENDS_BLOCK : 0;
  return true;
}

static bool decode_barrier(unsigned number, Insn *insn) {
  insn->run = number == 2 ? clrex : nop;
  return number == 2 || (number >= 4 && number <= 6);
}

bool decode_system32(uint16_t first, uint16_t second, Insn *insn) {
  insn->imm = bits(second, 7, 0);
  switch (bits(first, 10, 4)) {
  case 0x38: /* only APSR of xPSR can be written */
    insn->n = bits(first, 3, 0);
    insn->shift = bits(second, 11, 10);
    insn->run = insn->imm < 4 ? msr_apsr : msr;
    return true;
  case 0x3A: return bits(second, 10, 8) == 0 && decode_hint(insn->imm, insn);
  case 0x3B: return decode_barrier(bits(second, 7, 4), insn);
  case 0x3E:
    insn->d = bits(second, 11, 8);
    insn->run = mrs;
    return insn->d != 13 && insn->d != 15;
  default: return false;
  }
}
