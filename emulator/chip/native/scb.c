/* The system control block: state, vector table, reset, fault status, FPU context (ARMv7-M ARM B3.2).
 *
 * NOT MODELLED: FPCCR.LSPACT never becomes 1, because floating-point registers are stacked at exception entry,
 * not at the handler's first floating-point instruction; a program sees the difference only by looking at a
 * frame that it has not made use of. FPDSCR is stored; a new context begins with FPSCR 0, which is FPDSCR's reset
 * value. MPU: none of its regions protects anything.
 */
#include "scb.h"

#include "chip.h"

#define BASE 0xE000E000u
#define MPU_TYPE 0xD90u
#define MPU_END 0xDBCu
#define EIGHT_REGIONS 0x800u

#define AIRCR_KEY 0x05FAu
#define AIRCR_PRIGROUP 0x700u
#define AIRCR_SYSRESETREQ (1u << 2)
#define AIRCR_VECTCLRACTIVE (1u << 1)
#define ICSR_RETTOBASE (1u << 11)
#define ICSR_ISRPENDING (1u << 22)
#define DEMCR_TRCENA (1u << 24)
#define CPACR_FULL 0x00F00000u

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
  case SCB_ACTLR: return scb->actlr;
  case SCB_CPUID: return 0x410FC241; /* Cortex-M4 r0p1 (PM0214 4.4.2) */
  case SCB_ICSR: return interrupt_state(scb->block.chip);
  case SCB_VTOR: return scb->vtor;
  case SCB_AIRCR: return 0xFA050000u | scb->aircr;
  case SCB_SCR: return scb->scr;
  case SCB_CCR: return scb->ccr;
  case SCB_SHPR1:
  case SCB_SHPR2:
  case SCB_SHPR3: return scb->shpr[(offset - SCB_SHPR1) / 4];
  case SCB_SHCSR: return handlers(scb);
  case SCB_CFSR: return scb->cfsr;
  case SCB_HFSR: return scb->hfsr;
  case SCB_DFSR: return scb->dfsr;
  case SCB_MMFAR: return scb->mmfar;
  case SCB_BFAR: return scb->bfar;
  case SCB_CPACR: return scb->cpacr;
  case SCB_DEMCR: return scb->demcr;
  case SCB_FPCCR: return scb->fpccr;
  case SCB_FPCAR: return scb->fpcar;
  case SCB_FPDSCR: return scb->fpdscr;
  case SCB_MVFR0: return 0x10110021;
  case SCB_MVFR1: return 0x11000011;
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
  scb->shcsr = value & 0x70000;
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
  static const uint32_t writable_shpr[3] = {0x00F0F0F0, 0xF0000000, 0xF0F000F0};
  unsigned word = (offset - SCB_SHPR1) / 4;
  switch (offset) {
  case SCB_ACTLR: store(&scb->actlr, value, mask, 0x307); break;
  case SCB_ICSR: pend(&scb->block.chip->nvic, value); break;
  case SCB_VTOR: store(&scb->vtor, value, mask, 0x3FFFFF80); break;
  case SCB_AIRCR: control(scb, value); break;
  case SCB_SCR: store(&scb->scr, value, mask, 0x16); break;
  case SCB_CCR: store(&scb->ccr, value, mask, 0x31B); break;
  case SCB_SHPR1:
  case SCB_SHPR2:
  case SCB_SHPR3:
    store(&scb->shpr[word], value, mask, writable_shpr[word]);
    set_priorities(scb, word);
    break;
  case SCB_SHCSR: set_handlers(scb, (handlers(scb) & ~mask) | value); break;
  case SCB_CFSR: scb->cfsr &= ~value; break;
  case SCB_HFSR: scb->hfsr &= ~value; break;
  case SCB_DFSR: scb->dfsr &= ~value; break;
  case SCB_MMFAR: store(&scb->mmfar, value, mask, WORD); break;
  case SCB_BFAR: store(&scb->bfar, value, mask, WORD); break;
  case SCB_CPACR: store(&scb->cpacr, value, mask, CPACR_FULL); break;
  case SCB_DEMCR: store(&scb->demcr, value, mask, 0x010F07F1); break;
  case SCB_FPCCR: store(&scb->fpccr, value, mask, 0xC0000000); break;
  case SCB_FPCAR: store(&scb->fpcar, value, mask, 0xFFFFFFF8); break;
  case SCB_FPDSCR: store(&scb->fpdscr, value, mask, 0x07C00000); break;
  default: break;
  }
  if (offset == SCB_SCR || offset == SCB_CCR || offset == SCB_CPACR || offset == SCB_DEMCR) {
    apply(scb);
  }
}

/* -- the block ------------------------------------------------------------------------------------------- */

static bool is_systick(uint32_t offset) { return offset >= SYST_CSR && offset <= SYST_CALIB; }

static bool is_known(uint32_t offset) {
  return offset == SCB_ACTLR || (offset >= SCB_CPUID && offset < 0xD74) || offset == SCB_CPACR ||
         (offset >= SCB_DHCSR && offset <= SCB_DEMCR) || (offset >= SCB_FPCCR && offset <= SCB_MVFR1);
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
  *scb = (Scb){.block = block, .ccr = CCR_STKALIGN, .fpccr = 0xC0000000};
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
