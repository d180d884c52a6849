/* The system control block: state, vector table, reset, fault status, FPU context (ARMv7-M ARM B3.2).
 *
 * NOT MODELLED: FPCCR.LSPACT never becomes 1, because floating-point registers are stacked at exception entry,
 * not at the handler's first floating-point instruction; a program sees the difference only by looking at a
 * frame that it has not made use of. FPDSCR is stored; a new context begins with FPSCR 0, which is FPDSCR's reset
 * value. MPU: none of its regions protects anything.
 */
#include "scb.h"

#include "chip.h"
#include "registers_scb.h"

#define BASE 0xE000E000u
#define MPU_TYPE 0xD90u
#define MPU_END 0xDBCu
#define EIGHT_REGIONS 0x800u

#define AIRCR_KEY 0x05FAu
#define CPACR_FULL (CPACR_CP10 | CPACR_CP11)
#define SHCSR_ENABLED (SHCSR_MEMFAULTENA | SHCSR_BUSFAULTENA | SHCSR_USGFAULTENA)
#define IMPLEMENTED 0xF0F0F0F0u /* of four priorities */

/* ID_PFR0 to ID_ISAR4 (Cortex-M4 technical reference manual, table 4-1). */
static const uint32_t identification[13] = {0x30,       0x200,      0x100000,   0,          0x30, 0, 0x01000000, 0,
                                            0x01101110, 0x02112000, 0x21232231, 0x01111131, 0x01310132};

/* Exceptions by their bits in SHCSR (B3.2.13). */
static const struct {
  uint8_t bit, exception;
} active_in_shcsr[] = {{0, 4}, {1, 5}, {3, 6}, {7, 11}, {8, 12}, {10, 14}, {11, 15}},
  pending_in_shcsr[] = {{12, USAGE_FAULT}, {13, MEM_MANAGE}, {14, BUS_FAULT}, {15, SV_CALL}};

#define FOR_EACH(entry, table) \
  for (unsigned entry = 0; entry < sizeof(table) / sizeof *(table); entry++)

bool scb_fault_enabled(const Scb *scb, int exception) {
  return exception < MEM_MANAGE || exception > USAGE_FAULT || scb->shcsr >> (exception + 12) & 1;
}

/* -- reading --------------------------------------------------------------------------------------------- */

static uint32_t interrupt_state(const Chip *chip) {
  const Nvic *nvic = &chip->nvic;
  uint32_t value = chip->core.ipsr | (uint32_t)nvic_most_urgent(nvic) << 12;
  value |= (uint32_t)nvic_is_pending(nvic, SYS_TICK) << 26 | (uint32_t)nvic_is_pending(nvic, PEND_SV) << 28;
  value |= (uint32_t)nvic_is_pending(nvic, NMI) << 31;
  if (nvic->pending[0] >> FIRST_INTERRUPT || nvic->pending[1]) {
    value |= ICSR_ISRPENDING;
  }
  return nvic_depth(nvic) <= 1 ? value | ICSR_RETTOBASE : value;
}

static uint32_t handlers(const Scb *scb) {
  const Nvic *nvic = &scb->block.chip->nvic;
  uint32_t value = scb->shcsr;
  FOR_EACH(n, active_in_shcsr) {
    value |= (uint32_t)nvic_is_active(nvic, active_in_shcsr[n].exception) << active_in_shcsr[n].bit;
  }
  FOR_EACH(n, pending_in_shcsr) {
    value |= (uint32_t)nvic_is_pending(nvic, pending_in_shcsr[n].exception) << pending_in_shcsr[n].bit;
  }
  return value;
}

static uint32_t look(const Scb *scb, uint32_t offset) {
  if (offset >= 0xD40 && offset < 0xD74) {
    return identification[(offset - 0xD40) / 4];
  }
  switch (offset) {
  case ACTLR: return scb->actlr;
  case CPUID: return CPUID_RESET;
  case ICSR: return interrupt_state(scb->block.chip);
  case VTOR: return scb->vtor;
  case AIRCR: return AIRCR_RESET | scb->aircr;
  case SCR: return scb->scr;
  case CCR: return scb->ccr;
  case SHPR1:
  case SHPR2:
  case SHPR3: return scb->shpr[(offset - SHPR1) / 4];
  case SHCSR: return handlers(scb);
  case CFSR: return scb->cfsr;
  case HFSR: return scb->hfsr;
  case DFSR: return scb->dfsr;
  case MMFAR: return scb->mmfar;
  case BFAR: return scb->bfar;
  case CPACR: return scb->cpacr;
  case DEMCR: return scb->demcr;
  case FPCCR: return scb->fpccr;
  case FPCAR: return scb->fpcar;
  case FPDSCR: return scb->fpdscr;
  case MVFR0: return MVFR0_RESET;
  case MVFR1: return MVFR1_RESET;
  case MPU_TYPE: return EIGHT_REGIONS;
  default: return 0;
  }
}

/* -- writing --------------------------------------------------------------------------------------------- */

static void pend(Nvic *nvic, uint32_t value) {
  static const struct {
    uint8_t bit, exception;
  } sets[] = {{31, NMI}, {28, PEND_SV}, {26, SYS_TICK}}, clears[] = {{27, PEND_SV}, {25, SYS_TICK}};
  FOR_EACH(n, sets) {
    if (value >> sets[n].bit & 1) {
      nvic_pend(nvic, sets[n].exception);
    }
  }
  FOR_EACH(n, clears) {
    if (value >> clears[n].bit & 1) {
      nvic_unpend(nvic, clears[n].exception);
    }
  }
}

/* AIRCR; ignored without the key (B3.2.6). */
static void control(Scb *scb, uint32_t value) {
  Chip *chip = scb->block.chip;
  if (value >> 16 != AIRCR_KEY) {
    return;
  }
  scb->aircr = value & AIRCR_PRIGROUP;
  chip->nvic.subpriority_bits = (int32_t)(value >> 8 & 7) + 1;
  chip->nvic.changed = 1;
  if (value & AIRCR_VECTCLRACTIVE) {
    chip->nvic.active[0] = chip->nvic.active[1] = 0;
  }
  if (value & AIRCR_SYSRESETREQ) {
    machine_request_reset(chip, RESET_SYSRESETREQ);
  }
}

static void set_bit(uint64_t *word, int bit, uint32_t level) {
  *word = (*word & ~((uint64_t)1 << bit)) | (uint64_t)(level & 1) << bit;
}

static void set_handlers(Scb *scb, uint32_t value) {
  Nvic *nvic = &scb->block.chip->nvic;
  scb->shcsr = value & SHCSR_ENABLED;
  FOR_EACH(n, active_in_shcsr) {
    set_bit(&nvic->active[0], active_in_shcsr[n].exception, value >> active_in_shcsr[n].bit);
  }
  FOR_EACH(n, pending_in_shcsr) {
    set_bit(&nvic->pending[0], pending_in_shcsr[n].exception, value >> pending_in_shcsr[n].bit);
  }
  nvic->changed = 1;
}

static void set_priorities(Scb *scb, unsigned word) {
  Nvic *nvic = &scb->block.chip->nvic;
  for (unsigned byte = 0; byte < 4; byte++) {
    nvic->priority[4 + 4 * word + byte] = (int16_t)(scb->shpr[word] >> 8 * byte & 0xFF);
  }
  nvic->changed = 1;
}

/* What of the core depends on a register that has been written. */
static void apply(Scb *scb) {
  Chip *chip = scb->block.chip;
  bool floating = (scb->cpacr & CPACR_FULL) == CPACR_FULL;
  chip->nvic.event_on_pending = (scb->scr & SCR_SEVONPEND) != 0;
  chip->core.div_0_trp = (scb->ccr & CCR_DIV_0_TRP) != 0;
  core_trap_unaligned(&chip->core, (scb->ccr & CCR_UNALIGN_TRP) != 0);
  if (chip->core.fpu_on != floating) { /* instructions are decoded for one or the other */
    chip->core.fpu_on = floating;
    core_forget_all_code(&chip->core);
  }
  dwt_enable(&chip->dwt, (scb->demcr & DEMCR_TRCENA) != 0);
}

static void store(uint32_t *word, uint32_t value, uint32_t mask, uint32_t writable) {
  mask &= writable;
  *word = (*word & ~mask) | (value & mask);
}

static void put(Scb *scb, uint32_t offset, uint32_t value, uint32_t mask) {
  static const uint32_t writable_shpr[3] = {
    SHPR1_STORED & IMPLEMENTED, SHPR2_STORED & IMPLEMENTED, SHPR3_STORED & IMPLEMENTED};
  unsigned word = (offset - SHPR1) / 4;
  switch (offset) {
  case ACTLR: store(&scb->actlr, value, mask, ACTLR_STORED); break;
  case ICSR: pend(&scb->block.chip->nvic, value); break;
  case VTOR: store(&scb->vtor, value, mask, VTOR_STORED); break;
  case AIRCR: control(scb, value); break;
  case SCR: store(&scb->scr, value, mask, SCR_STORED); break;
  case CCR: store(&scb->ccr, value, mask, CCR_STORED); break;
  case SHPR1:
  case SHPR2:
  case SHPR3:
    store(&scb->shpr[word], value, mask, writable_shpr[word]);
    set_priorities(scb, word);
    break;
  case SHCSR: set_handlers(scb, (handlers(scb) & ~mask) | value); break;
  case CFSR: scb->cfsr &= ~value; break;
  case HFSR: scb->hfsr &= ~value; break;
  case DFSR: scb->dfsr &= ~value; break;
  case MMFAR: store(&scb->mmfar, value, mask, WORD); break;
  case BFAR: store(&scb->bfar, value, mask, WORD); break;
  case CPACR: store(&scb->cpacr, value, mask, CPACR_FULL); break;
  case DEMCR: store(&scb->demcr, value, mask, DEMCR_STORED); break;
  case FPCCR: store(&scb->fpccr, value, mask, FPCCR_STORED); break;
  case FPCAR: store(&scb->fpcar, value, mask, FPCAR_STORED); break;
  case FPDSCR: store(&scb->fpdscr, value, mask, FPDSCR_STORED); break;
  default: break;
  }
  if (offset == SCR || offset == CCR || offset == CPACR || offset == DEMCR) {
    apply(scb);
  }
}

/* -- the block ------------------------------------------------------------------------------------------- */

static bool is_systick(uint32_t offset) { return offset >= SYST_CSR && offset <= SYST_CALIB; }

static bool is_known(uint32_t offset) {
  return offset == ACTLR || (offset >= CPUID && offset < 0xD74) || offset == CPACR ||
         (offset >= DHCSR && offset <= DEMCR) || (offset >= FPCCR && offset <= MVFR1);
}

/* Another one's, or nobody's: MPU, or no register at all. */
static void absent(Scb *scb, uint32_t offset, const char *what, bool written) {
  if (offset < MPU_TYPE || offset >= MPU_END) {
    block_note(&scb->block, -1, NOTE_NOT_MODELLED, "0x%08X %s; there is no such register", BASE + offset, what);
  } else if (written) {
    block_note(&scb->block, 0, NOTE_NOT_MODELLED, "MPU: set up by the firmware; nothing is protected");
  }
}

static uint32_t read(Block *block, uint32_t offset, int64_t *until_ps) {
  Chip *chip = block->chip;
  if (is_systick(offset)) {
    return systick_read(&chip->systick, offset, until_ps);
  }
  if (nvic_has(offset)) {
    return nvic_read(&chip->nvic, offset);
  }
  if (!is_known(offset)) {
    absent((Scb *)block, offset, "read", false);
  }
  return look((Scb *)block, offset);
}

static uint32_t peek(const Block *block, uint32_t offset) {
  const Chip *chip = block->chip;
  if (is_systick(offset)) {
    return systick_peek(&chip->systick, offset);
  }
  return nvic_has(offset) ? nvic_read(&chip->nvic, offset) : look((const Scb *)block, offset);
}

static void write(Block *block, uint32_t offset, uint32_t value, uint32_t mask) {
  Chip *chip = block->chip;
  if (is_systick(offset)) {
    systick_write(&chip->systick, offset, value, mask);
  } else if (nvic_has(offset)) {
    nvic_write(&chip->nvic, offset, value, mask);
  } else if (is_known(offset)) {
    put((Scb *)block, offset, value, mask);
  } else {
    absent((Scb *)block, offset, "written", true);
  }
}

static bool is_pure(const Block *block, uint32_t offset) {
  return offset != SYST_CVR && !(offset == SYST_CSR && systick_peek(&block->chip->systick, SYST_CSR) >> 16 & 1);
}

void scb_reset(Scb *scb) {
  Block block = scb->block;
  *scb = (Scb){.block = block, .ccr = CCR_RESET, .fpccr = FPCCR_RESET};
  apply(scb);
}

static void reset(Block *block) { scb_reset((Scb *)block); }

static void clocks_changed(Block *block) { systick_retime(&block->chip->systick); }

void scb_create(Chip *chip) {
  static const BlockType type = {.read = read, .peek = peek, .write = write, .reset = reset, .is_pure = is_pure,
                                 .clocks_changed = clocks_changed};
  static const int16_t none[] = {-1};
  block_create(chip, &chip->scb.block, &type, BASE, 0x1000, none);
  block_knows_all(&chip->scb.block);
  scb_reset(&chip->scb);
}
