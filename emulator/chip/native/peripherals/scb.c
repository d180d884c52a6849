/* System control block (ARMv7-M ARM B3.2). SysTick and NVIC, in the same 4 KB, are separate files.
 *
 * NOT MODELLED: FPCCR.LSPACT is 0, because floating-point registers are stacked at entry; only a program that reads
 * an unused frame can see the difference. FPDSCR: stored; FPSCR of a new context is 0, the reset value of FPDSCR.
 * MPU: protects nothing.
 */
#include "peripherals/scb.h"

#include "fcu.h"
#include "generated/registers_scb.h"
#include "generated/registers_systick.h"

#define ID_PFR0 0xD40u
#define ID_END 0xD74u
#define MPU_TYPE 0xD90u
#define MPU_END 0xDBCu
#define MPU_TYPE_EIGHT_REGIONS 0x800u /* DREGION = 8 */

#define AIRCR_KEY 0x05FAu
#define CPACR_FULL (CPACR_CP10 | CPACR_CP11)
#define SHCSR_ENABLES (SHCSR_MEMFAULTENA | SHCSR_BUSFAULTENA | SHCSR_USGFAULTENA)
#define PRIORITY_BITS 0xF0F0F0F0u /* only the upper half of each byte is stored */

/* The registers up to ID_ISAR4 (Cortex-M4 TRM table 4-1). */
static const uint32_t identification[13] = {0x30,       0x200,      0x100000,   0,          0x30, 0, 0x01000000, 0,
                                            0x01101110, 0x02112000, 0x21232231, 0x01111131, 0x01310132};

typedef struct {
  uint32_t bit;
  int exception;
} ExceptionBit;

static const ExceptionBit shcsr_active[] = {
  {SHCSR_MEMFAULTACT, MEM_MANAGE},    {SHCSR_BUSFAULTACT, BUS_FAULT}, {SHCSR_USGFAULTACT, USAGE_FAULT},
  {SHCSR_SVCALLACT, SV_CALL},         {SHCSR_MONITORACT, DEBUG_MONITOR}, {SHCSR_PENDSVACT, PEND_SV},
  {SHCSR_SYSTICKACT, SYS_TICK}};
static const ExceptionBit shcsr_pending[] = {{SHCSR_USGFAULTPENDED, USAGE_FAULT},
                                                  {SHCSR_MEMFAULTPENDED, MEM_MANAGE},
                                                  {SHCSR_BUSFAULTPENDED, BUS_FAULT},
                                                  {SHCSR_SVCALLPENDED, SV_CALL}};

static const ExceptionBit icsr_set_bits[] = {
  {ICSR_NMIPENDSET, NMI}, {ICSR_PENDSVSET, PEND_SV}, {ICSR_PENDSTSET, SYS_TICK}};
static const ExceptionBit icsr_clear_bits[] = {{ICSR_PENDSVCLR, PEND_SV}, {ICSR_PENDSTCLR, SYS_TICK}};

#define FOR_EACH(index, table)  \
  for (unsigned index = 0; index < sizeof(table) / sizeof *(table); index++)

bool scb_fault_enabled(const Scb *scb, int exception) {
  return exception < MEM_MANAGE || exception > USAGE_FAULT ||
         scb->shcsr & SHCSR_MEMFAULTENA << (exception - MEM_MANAGE);
}

bool scb_sleeps_deeply(const Scb *scb) { return scb->scr & SCR_SLEEPDEEP; }

static uint32_t icsr(const Chip *chip) {
  const Nvic *nvic = &chip->nvic;
  uint32_t value = chip->core.ipsr | (uint32_t)nvic_highest_pending(nvic) << ICSR_VECTPENDING_SHIFT;
  FOR_EACH(n, icsr_set_bits) {
    value |= nvic_is_pending(nvic, icsr_set_bits[n].exception) ? icsr_set_bits[n].bit : 0;
  }
  if (nvic->pending[0] >> FIRST_INTERRUPT || nvic->pending[1]) {
    value |= ICSR_ISRPENDING;
  }
  int number = (int)chip->core.ipsr; /* a debugger or a damaged stack frame can set any number of 9 bits */
  int current = number < EXCEPTIONS && nvic_is_active(nvic, number);
  return nvic_active_count(nvic) == current ? value | ICSR_RETTOBASE : value;
}

static uint32_t shcsr(const Scb *scb) {
  const Nvic *nvic = &scb->peripheral.chip->nvic;
  uint32_t value = scb->shcsr;
  FOR_EACH(n, shcsr_active) {
    value |= nvic_is_active(nvic, shcsr_active[n].exception) ? shcsr_active[n].bit : 0;
  }
  FOR_EACH(n, shcsr_pending) {
    value |= nvic_is_pending(nvic, shcsr_pending[n].exception) ? shcsr_pending[n].bit : 0;
  }
  return value;
}

static uint32_t value_of(const Scb *scb, uint32_t offset) {
  if (offset >= ID_PFR0 && offset < ID_END) {
    return identification[(offset - ID_PFR0) / 4];
  }
  switch (offset) {
  case ACTLR: return scb->actlr;
  case CPUID: return CPUID_RESET;
  case ICSR: return icsr(scb->peripheral.chip);
  case VTOR: return scb->vtor;
  case AIRCR: return AIRCR_RESET | scb->aircr;
  case SCR: return scb->scr;
  case CCR: return scb->ccr;
  case SHPR1:
  case SHPR2:
  case SHPR3: return scb->shpr[(offset - SHPR1) / 4];
  case SHCSR: return shcsr(scb);
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
  case MPU_TYPE: return MPU_TYPE_EIGHT_REGIONS;
  default: return 0;
  }
}

static void write_icsr(Nvic *nvic, uint32_t value) {
  FOR_EACH(n, icsr_set_bits) {
    if (value & icsr_set_bits[n].bit) {
      nvic_pend(nvic, icsr_set_bits[n].exception);
    }
  }
  FOR_EACH(n, icsr_clear_bits) {
    if (value & icsr_clear_bits[n].bit) {
      nvic_unpend(nvic, icsr_clear_bits[n].exception);
    }
  }
}

/* A write without the key has no effect (B3.2.6). */
static void write_aircr(Scb *scb, uint32_t value) {
  Chip *chip = scb->peripheral.chip;
  if (FIELD(value, AIRCR_VECTKEY) != AIRCR_KEY) {
    return;
  }
  scb->aircr = value & AIRCR_PRIGROUP;
  chip->nvic.subpriority_bits = (int32_t)FIELD(value, AIRCR_PRIGROUP) + 1; /* bits PRIGROUP to 0 */
  chip->nvic.changed = 1;
  if (value & AIRCR_VECTCLRACTIVE) {
    chip->nvic.active[0] = chip->nvic.active[1] = 0;
  }
  if (value & AIRCR_SYSRESETREQ) {
    fcu_request_reset(chip, RESET_SYSRESETREQ);
  }
}

static void set_bit(uint64_t *word, int bit, bool level) {
  *word = (*word & ~((uint64_t)1 << bit)) | (uint64_t)level << bit;
}

static void write_shcsr(Scb *scb, uint32_t value) {
  Nvic *nvic = &scb->peripheral.chip->nvic;
  scb->shcsr = value & SHCSR_ENABLES;
  FOR_EACH(n, shcsr_active) {
    set_bit(&nvic->active[0], shcsr_active[n].exception, value & shcsr_active[n].bit);
  }
  FOR_EACH(n, shcsr_pending) {
    set_bit(&nvic->pending[0], shcsr_pending[n].exception, value & shcsr_pending[n].bit);
  }
  nvic->changed = 1;
}

/* Exceptions 4 to 15. */
static void set_priorities(Scb *scb, unsigned word) {
  Nvic *nvic = &scb->peripheral.chip->nvic;
  for (unsigned byte = 0; byte < 4; byte++) {
    nvic->priority[4 + 4 * word + byte] = (int16_t)(scb->shpr[word] >> 8 * byte & 0xFF);
  }
  nvic->changed = 1;
}

static void apply(Scb *scb) {
  Chip *chip = scb->peripheral.chip;
  bool floating = (scb->cpacr & CPACR_FULL) == CPACR_FULL;
  chip->nvic.sevonpend = (scb->scr & SCR_SEVONPEND) != 0;
  chip->core.div_0_trp = (scb->ccr & CCR_DIV_0_TRP) != 0;
  core_trap_unaligned(&chip->core, (scb->ccr & CCR_UNALIGN_TRP) != 0);
  if (chip->core.fpu_on != floating) { /* decoded code depends on fpu_on */
    chip->core.fpu_on = floating;
    fcu_invalidate_code(chip);
  }
  dwt_enable(&chip->dwt, (scb->demcr & DEMCR_TRCENA) != 0);
}

/* The caller has cleared all bits of value outside of the mask. */
static void write_register(Scb *scb, uint32_t offset, uint32_t value, uint32_t mask) {
  static const uint32_t writable_shpr[3] = {
    SHPR1_STORED & PRIORITY_BITS, SHPR2_STORED & PRIORITY_BITS, SHPR3_STORED & PRIORITY_BITS};
  unsigned word = (offset - SHPR1) / 4;
  switch (offset) {
  case ACTLR: write_bits(&scb->actlr, value, mask, ACTLR_STORED); break;
  case ICSR: write_icsr(&scb->peripheral.chip->nvic, value); break;
  case VTOR: write_bits(&scb->vtor, value, mask, VTOR_STORED); break;
  case AIRCR: write_aircr(scb, value); break;
  case SCR: write_bits(&scb->scr, value, mask, SCR_STORED); break;
  case CCR: write_bits(&scb->ccr, value, mask, CCR_STORED); break;
  case SHPR1:
  case SHPR2:
  case SHPR3:
    write_bits(&scb->shpr[word], value, mask, writable_shpr[word]);
    set_priorities(scb, word);
    break;
  case SHCSR: write_shcsr(scb, (shcsr(scb) & ~mask) | value); break;
  case CFSR: scb->cfsr &= ~value; break; /* writing 1 clears a bit */
  case HFSR: scb->hfsr &= ~value; break;
  case DFSR: scb->dfsr &= ~value; break;
  case MMFAR: write_bits(&scb->mmfar, value, mask, WORD); break;
  case BFAR: write_bits(&scb->bfar, value, mask, WORD); break;
  case CPACR: write_bits(&scb->cpacr, value, mask, CPACR_FULL); break;
  case DEMCR: write_bits(&scb->demcr, value, mask, DEMCR_STORED); break;
  case FPCCR: write_bits(&scb->fpccr, value, mask, FPCCR_STORED); break;
  case FPCAR: write_bits(&scb->fpcar, value, mask, FPCAR_STORED); break;
  case FPDSCR: write_bits(&scb->fpdscr, value, mask, FPDSCR_STORED); break;
  default: break;
  }
  if (offset == SCR || offset == CCR || offset == CPACR || offset == DEMCR) {
    apply(scb);
  }
}

static bool is_systick(uint32_t offset) { return offset >= SYST_CSR && offset <= SYST_CALIB; }

static bool is_known(uint32_t offset) {
  return offset == ACTLR || (offset >= CPUID && offset < ID_END) || offset == CPACR ||
         (offset >= DHCSR && offset <= DEMCR) || (offset >= FPCCR && offset <= MVFR1);
}

static void note_unknown(Scb *scb, uint32_t offset, const char *what, bool written) {
  if (offset < MPU_TYPE || offset >= MPU_END) {
    peripheral_note(&scb->peripheral, -1, NOTE_NOT_MODELLED,
                    "no-register address=%u | 0x%08X %s; there is no such register", SCS_BASE + offset,
                    SCS_BASE + offset, what);
  } else if (written) {
    peripheral_note(&scb->peripheral, 0, NOTE_NOT_MODELLED,
                    "mpu | MPU: set up by the firmware; the emulator protects no memory");
  }
}

static uint32_t read(Peripheral *peripheral, uint32_t offset, int64_t *until_ps) {
  Chip *chip = peripheral->chip;
  if (is_systick(offset)) {
    return systick_read(&chip->systick, offset, until_ps);
  }
  if (nvic_has_register(offset)) {
    return nvic_read(&chip->nvic, offset);
  }
  if (!is_known(offset)) {
    note_unknown((Scb *)peripheral, offset, "read", false);
  }
  return value_of((Scb *)peripheral, offset);
}

static uint32_t peek(const Peripheral *peripheral, uint32_t offset) {
  const Chip *chip = peripheral->chip;
  if (is_systick(offset)) {
    return systick_peek(&chip->systick, offset);
  }
  return nvic_has_register(offset) ? nvic_read(&chip->nvic, offset) : value_of((const Scb *)peripheral, offset);
}

static void write(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  Chip *chip = peripheral->chip;
  if (is_systick(offset)) {
    systick_write(&chip->systick, offset, value, mask);
  } else if (nvic_has_register(offset)) {
    nvic_write(&chip->nvic, offset, value, mask);
  } else if (is_known(offset)) {
    write_register((Scb *)peripheral, offset, value, mask);
  } else {
    note_unknown((Scb *)peripheral, offset, "written", true);
  }
}

/* SYST_CVR counts, and reading SYST_CSR clears COUNTFLAG; other registers have no side effect. */
static bool is_pure(const Peripheral *peripheral, uint32_t offset) {
  return offset != SYST_CVR &&
         !(offset == SYST_CSR && systick_peek(&peripheral->chip->systick, SYST_CSR) & SYST_CSR_COUNTFLAG);
}

void scb_reset(Scb *scb) {
  Peripheral peripheral = scb->peripheral;
  *scb = (Scb){.peripheral = peripheral, .ccr = CCR_RESET, .fpccr = FPCCR_RESET};
  apply(scb);
}

static void reset(Peripheral *peripheral) { scb_reset((Scb *)peripheral); }

static void clocks_changed(Peripheral *peripheral) { systick_retime(&peripheral->chip->systick); }

void scb_create(Chip *chip) {
  static const PeripheralType type = {.read = read, .peek = peek, .write = write, .reset = reset, .is_pure = is_pure,
                                 .clocks_changed = clocks_changed};
  static const int16_t none[] = {-1};
  peripheral_create(chip, &chip->scb.peripheral, &type, SCS_BASE, SCS_SIZE, none);
  peripheral_set_all_registers(&chip->scb.peripheral);
  scb_reset(&chip->scb);
}
