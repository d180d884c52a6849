/* xPSR, CONTROL, stack pointers, and registers by number for debuggers. */
#include <string.h>

#include "fcu.h"

/* The SP in use: 0 is MSP, 1 is PSP (B1.4.7). */
static unsigned bank(const Core *core) { return !in_handler(core) && core->control & SPSEL ? 1 : 0; }

uint32_t read_xpsr(const Core *core) {
  uint32_t flags = (core->n & 1u << 31) | (uint32_t)(core->z == 0) << 30 | core->c << 29 | core->v >> 31 << 28;
  uint32_t it = (core->itstate & 3) << 25 | (core->itstate & 0xFC) << 8;
  return flags | core->q << 27 | it | core->thumb << 24 | core->ge << 16 | core->ipsr;
}

void write_apsr(Core *core, uint32_t value, bool nzcvq, bool ge) {
  if (nzcvq) {
    core->n = value;
    core->z = ~value >> 30 & 1;
    core->c = value >> 29 & 1;
    core->v = value << 3;
    core->q = value >> 27 & 1;
  }
  if (ge) {
    core->ge = value >> 16 & 0xF;
  }
}

void write_xpsr(Core *core, uint32_t value) {
  write_apsr(core, value, true, true);
  core->itstate = (value >> 8 & 0xFC) | (value >> 25 & 3);
  core->thumb = value >> 24 & 1;
  core->sp[bank(core)] = core->r[13];
  core->ipsr = value & 0x1FF;
  core->r[13] = core->sp[bank(core)];
}

void write_control(Core *core, uint32_t value) {
  core->sp[bank(core)] = core->r[13];
  core->control = value & 0xF;
  core->r[13] = core->sp[bank(core)];
}

uint32_t read_stack_pointer(const Core *core, bool process) {
  return bank(core) == process ? core->r[13] : core->sp[process];
}

void write_stack_pointer(Core *core, bool process, uint32_t value) {
  *(bank(core) == process ? &core->r[13] : &core->sp[process]) = value & ~3u;
}

/* Numbers of the registers after R0 to R15, as in library.py. */
enum Register { XPSR = 16, MSP, PSP, PRIMASK, BASEPRI, FAULTMASK, CONTROL, FPSCR, S0 };

static uint32_t read_register(const Core *core, int number) {
  switch (number) {
  case XPSR: return read_xpsr(core);
  case MSP: return read_stack_pointer(core, false);
  case PSP: return read_stack_pointer(core, true);
  case PRIMASK: return core->primask;
  case BASEPRI: return core->basepri;
  case FAULTMASK: return core->faultmask;
  case CONTROL: return core->control;
  case FPSCR: return core->fpscr;
  default: return number >= S0 ? core->s[number - S0] : core->r[number];
  }
}

static void write_register(Core *core, int number, uint32_t value) {
  switch (number) {
  case XPSR: write_xpsr(core, value); break;
  case MSP: write_stack_pointer(core, false, value); break;
  case PSP: write_stack_pointer(core, true, value); break;
  case PRIMASK: core->primask = value & 1; break;
  case BASEPRI: core->basepri = value & 0xFF; break;
  case FAULTMASK: core->faultmask = value & 1; break;
  case CONTROL: write_control(core, value); break;
  case FPSCR: core->fpscr = value; break;
  case 15: core->r[15] = value; break;
  default: *(number >= S0 ? &core->s[number - S0] : &core->r[number]) = value;
  }
}

void fcu_read_registers(const Chip *chip, const int32_t *numbers, uint32_t *values, int32_t count) {
  for (int32_t n = 0; n < count; n++) {
    values[n] = read_register(&chip->core, numbers[n]);
  }
}

void fcu_write_registers(Chip *chip, const int32_t *numbers, const uint32_t *values, int32_t count) {
  for (int32_t n = 0; n < count; n++) {
    write_register(&chip->core, numbers[n], values[n]);
  }
}

int32_t fcu_thumb(const Chip *chip) { return (int32_t)chip->core.thumb; }

void fcu_set_thumb(Chip *chip, int32_t thumb) { chip->core.thumb = thumb != 0; }
