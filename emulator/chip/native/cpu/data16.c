/* 16-bit data processing (ARMv7-M ARM A5.2.1 to A5.2.3, and parts of A5.2 and A5.2.5). */
#include "cpu/operations.h"

/* Shift n by the lowest byte of m. 0 keeps C; more than 33 acts as 33 (A7.4.2). */
#define DEFINE_SHIFT(name, not_zero)                                     \
  static uint32_t name(Core *core, const Insn *insn, uint32_t *carry) {  \
    uint32_t n = core->r[insn->n], by = core->r[insn->m] & 0xFF;         \
    *carry = core->c;                                                    \
    if (by == 0) {                                                       \
      return n;                                                          \
    }                                                                    \
    not_zero                                                             \
  }                                                                      \
  OPERATION(name##_register) {                                           \
    uint32_t carry;                                                      \
    core->r[insn->d] = name(core, insn, &carry);                         \
    NEXT;                                                                \
  }                                                                      \
  OPERATION(name##s_register) {                                          \
    uint32_t carry, result = name(core, insn, &carry);                   \
    core->r[insn->d] = result;                                           \
    core->c = carry;                                                     \
    set_nz(core, result);                                                \
    NEXT;                                                                \
  }
#define AT_MOST_33(by) ((by) < 33 ? (by) : 33)

DEFINE_SHIFT(lsl, {
  uint64_t wide = (uint64_t)n << AT_MOST_33(by);
  *carry = wide >> 32 & 1;
  return (uint32_t)wide;
})
DEFINE_SHIFT(lsr, {
  uint64_t wide = (uint64_t)n >> (AT_MOST_33(by) - 1);
  *carry = wide & 1;
  return (uint32_t)(wide >> 1);
})
DEFINE_SHIFT(asr, {
  int64_t wide = (int64_t)(int32_t)n >> (AT_MOST_33(by) - 1);
  *carry = wide & 1;
  return (uint32_t)(wide >> 1);
})
DEFINE_SHIFT(ror, {
  uint32_t result = rotate_right(n, by);
  *carry = result >> 31;
  return result;
})

OPERATION(mul) {
  core->r[insn->d] = core->r[insn->n] * core->r[insn->m];
  NEXT;
}
OPERATION(muls) {
  uint32_t result = core->r[insn->n] * core->r[insn->m];
  core->r[insn->d] = result;
  set_nz(core, result);
  NEXT;
}

OPERATION(sxth) {
  core->r[insn->d] = (uint32_t)(int16_t)core->r[insn->m];
  NEXT;
}
OPERATION(sxtb) {
  core->r[insn->d] = (uint32_t)(int8_t)core->r[insn->m];
  NEXT;
}
OPERATION(uxth) {
  core->r[insn->d] = (uint16_t)core->r[insn->m];
  NEXT;
}
OPERATION(uxtb) {
  core->r[insn->d] = (uint8_t)core->r[insn->m];
  NEXT;
}

OPERATION(rev) {
  core->r[insn->d] = __builtin_bswap32(core->r[insn->m]);
  NEXT;
}
OPERATION(rev16) {
  core->r[insn->d] = rotate_right(__builtin_bswap32(core->r[insn->m]), 16);
  NEXT;
}
OPERATION(revsh) {
  core->r[insn->d] = (uint32_t)(int16_t)__builtin_bswap16((uint16_t)core->r[insn->m]);
  NEXT;
}

OPERATION(add_sp) {
  core->r[13] = (core->r[13] + insn->imm) & ~3u;
  NEXT;
}

/* 000xxx: shifts, MOV, ADD, SUB (A5.2.1). */
static void decode_shift(uint16_t first, Insn *insn) {
  unsigned type = bits(first, 12, 11), by = bits(first, 10, 6);
  insn->d = bits(first, 2, 0);
  if (type == 3) {
    enum Alu alu = bits(first, 9, 9) ? SUB : ADD;
    insn->n = bits(first, 5, 3);
    insn->m = insn->imm = bits(first, 8, 6);
    select_alu16(insn, alu, bits(first, 10, 10) ? CONSTANT : UNSHIFTED);
    return;
  }
  insn->m = bits(first, 5, 3);
  insn->shift = by || type == LSL ? by : 32;
  select_alu16(insn, MOV, insn->shift ? (enum Operand)type : UNSHIFTED);
}

/* Section A5.2.1. */
static void decode_immediate(uint16_t first, Insn *insn) {
  static const uint8_t alus[] = {MOV, CMP, ADD, SUB};
  insn->d = insn->n = bits(first, 10, 8);
  insn->imm = bits(first, 7, 0);
  select_alu16(insn, alus[bits(first, 12, 11)], CONSTANT);
}

/* Section A5.2.2. */
static void decode_registers(uint16_t first, Insn *insn) {
  static const uint8_t alus[16] = {
      AND, EOR, NO_ALU, NO_ALU, NO_ALU, ADC, SBC, NO_ALU, TST, NO_ALU, CMP, CMN, ORR, NO_ALU, BIC, MVN,
  };
  unsigned opcode = bits(first, 9, 6);
  insn->d = insn->n = bits(first, 2, 0);
  insn->m = bits(first, 5, 3);
  switch (opcode) {
  case 2: insn->run = insn->it ? lsl_register : lsls_register; break;
  case 3: insn->run = insn->it ? lsr_register : lsrs_register; break;
  case 4: insn->run = insn->it ? asr_register : asrs_register; break;
  case 7: insn->run = insn->it ? ror_register : rors_register; break;
  case 9:
    insn->n = insn->m;
    select_alu16(insn, RSB, CONSTANT);
    break;
  case 13: insn->run = insn->it ? mul : muls; break;
  default: select_alu16(insn, alus[opcode], UNSHIFTED);
  }
}

/* Section A5.2.3. PC as an operand is a constant. */
static void decode_high(uint32_t address, uint16_t first, Insn *insn) {
  static const uint8_t alus[] = {ADD, CMP, MOV};
  enum Alu alu = alus[bits(first, 9, 8)];
  enum Operand operand = UNSHIFTED;
  insn->d = insn->n = (uint8_t)(bits(first, 7, 7) << 3 | bits(first, 2, 0));
  insn->m = bits(first, 6, 3);
  if (insn->m == 15 || (insn->n == 15 && alu == ADD)) {
    insn->n = insn->m == 15 ? insn->n : insn->m;
    insn->imm = address + 4;
    operand = CONSTANT;
  }
  select_alu(insn, alu, operand, false);
}

/* ADR, and ADD of SP. */
static void decode_address(uint32_t address, uint16_t first, Insn *insn) {
  uint32_t imm = bits(first, 7, 0) << 2;
  insn->d = bits(first, 10, 8);
  if (bits(first, 11, 11)) {
    insn->n = 13;
    insn->imm = imm;
    select_alu(insn, ADD, CONSTANT, false);
  } else {
    insn->imm = ((address + 4) & ~3u) + imm;
    select_alu(insn, MOV, CONSTANT, false);
  }
}

/* Section A5.2.5. */
static bool decode_miscellaneous(uint16_t first, Insn *insn) {
  static const Operation extensions[] = {sxth, sxtb, uxth, uxtb}, reversals[] = {rev, rev16, NULL, revsh};
  uint32_t imm = bits(first, 6, 0) << 2;
  insn->d = bits(first, 2, 0);
  insn->m = bits(first, 5, 3);
  switch (bits(first, 11, 8)) {
  case 0x0:
    insn->imm = bits(first, 7, 7) ? -imm : imm;
    insn->run = add_sp;
    break;
  case 0x2: insn->run = extensions[bits(first, 7, 6)]; break;
  case 0xA: insn->run = reversals[bits(first, 7, 6)]; break;
  }
  return insn->run != NULL;
}

bool decode_data16(uint32_t address, uint16_t first, Insn *insn) {
  switch (first >> 12) {
  case 0x0:
  case 0x1: decode_shift(first, insn); return true;
  case 0x2:
  case 0x3: decode_immediate(first, insn); return true;
  case 0x4:
    if (bits(first, 10, 10)) {
      decode_high(address, first, insn);
    } else {
      decode_registers(first, insn);
    }
    return true;
  case 0xA: decode_address(address, first, insn); return true;
  default: return decode_miscellaneous(first, insn);
  }
}
