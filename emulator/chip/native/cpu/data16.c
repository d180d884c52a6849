/* 16-bit data processing (ARMv7-M ARM A5.2.1 to A5.2.3, and parts of A5.2 and A5.2.5). */
#include "cpu/operations.h"

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
  case 2: insn->run = shift_by_register(LSL, !insn->it); break;
  case 3: insn->run = shift_by_register(LSR, !insn->it); break;
  case 4: insn->run = shift_by_register(ASR, !insn->it); break;
  case 7: insn->run = shift_by_register(ROR, !insn->it); break;
  case 9:
    insn->n = insn->m;
    select_alu16(insn, RSB, CONSTANT);
    break;
  case 13: insn->run = insn->it ? mul : muls; break;
  default: select_alu16(insn, alus[opcode], UNSHIFTED);
  }
}

/* Section A5.2.3. If PC is an operand, its value is a constant. */
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
  static const Operation extensions[] = {sxth, sxtb, uxth, uxtb};
  uint32_t imm = bits(first, 6, 0) << 2;
  insn->d = bits(first, 2, 0);
  insn->m = bits(first, 5, 3);
  switch (bits(first, 11, 8)) {
  case 0x0:
    insn->imm = bits(first, 7, 7) ? -imm : imm;
    insn->run = add_sp;
    break;
  case 0x2: insn->run = extensions[bits(first, 7, 6)]; break;
  case 0xA: insn->run = bits(first, 7, 6) == 2 ? NULL : reversal(bits(first, 7, 6)); break;
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
