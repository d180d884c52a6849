/* 32-bit data processing (ARMv7-M ARM A5.3.1 to A5.3.3, A5.3.11). */
#include "cpu/operations.h"

/* The instructions TST to CMP have no d. MOV and MVN have no n (tables A5-10, A5-22). */
static enum Alu alu_of(unsigned opcode, bool set_flags, const Insn *insn) {
  static const uint8_t alus[16] = {
      [0] = AND, [1] = BIC, [2] = ORR, [3] = ORN, [4] = EOR, [8] = ADD, [10] = ADC, [11] = SBC, [13] = SUB,
      [14] = RSB,
  };
  static const uint8_t tests[ALUS] = {[AND] = TST, [EOR] = TEQ, [ADD] = CMN, [SUB] = CMP};
  static const uint8_t moves[ALUS] = {[ORR] = MOV, [ORN] = MVN};
  enum Alu alu = alus[opcode];
  if (insn->d == 15 && set_flags && tests[alu]) {
    return tests[alu];
  }
  return insn->n == 15 && moves[alu] ? moves[alu] : alu;
}

/* Shifted register (A5.3.11). */
static bool decode_shifted(uint16_t first, uint16_t second, Insn *insn) {
  unsigned opcode = bits(first, 8, 5), type = bits(second, 5, 4);
  unsigned by = bits(second, 14, 12) << 2 | bits(second, 7, 6);
  bool set_flags = bits(first, 4, 4);
  insn->n = bits(first, 3, 0);
  insn->d = bits(second, 11, 8);
  insn->m = bits(second, 3, 0);
  if (opcode == 6) {
    return decode_pack(first, second, insn);
  }
  enum Alu alu = alu_of(opcode, set_flags, insn);
  enum Operand operand = (enum Operand)type;
  if (by == 0) {
    operand = type == LSL ? UNSHIFTED : type == ROR ? BY_RRX : operand;
    by = 32;
  }
  insn->shift = (uint8_t)by;
  select_alu(insn, alu, operand, set_flags);
  return alu != NO_ALU && !bits(second, 15, 15);
}

/* ThumbExpandImm (A5.3.2). */
static uint32_t expand_immediate(uint32_t imm12) {
  uint32_t imm8 = imm12 & 0xFF;
  switch (imm12 >> 8) {
  case 0: return imm8;
  case 1: return imm8 * 0x00010001u;
  case 2: return imm8 * 0x01000100u;
  case 3: return imm8 * 0x01010101u;
  default: return rotate_right(0x80 | (imm8 & 0x7F), imm12 >> 7);
  }
}

/* Section A5.3.1. */
static bool decode_modified_immediate(uint16_t first, uint32_t imm12, Insn *insn) {
  bool set_flags = bits(first, 4, 4);
  enum Alu alu = alu_of(bits(first, 8, 5), set_flags, insn);
  insn->imm = expand_immediate(imm12);
  select_alu(insn, alu, imm12 >> 10 ? ROTATED_CONSTANT : CONSTANT, set_flags);
  return alu != NO_ALU;
}

/* If n is PC, the instruction is ADR. */
static void decode_addw_subw(uint32_t address, enum Alu alu, uint32_t imm12, Insn *insn) {
  insn->imm = imm12;
  if (insn->n == 15) {
    uint32_t pc = (address + 4) & ~3u;
    insn->imm = alu == ADD ? pc + imm12 : pc - imm12;
    alu = MOV;
  }
  select_alu(insn, alu, CONSTANT, false);
}

/* Section A5.3.3. */
static bool decode_plain_immediate(uint32_t address, uint16_t first, uint16_t second, uint32_t imm12, Insn *insn) {
  uint32_t imm16 = bits(first, 3, 0) << 12 | imm12;
  switch (bits(first, 8, 4)) {
  case 0x00: decode_addw_subw(address, ADD, imm12, insn); return true;
  case 0x0A: decode_addw_subw(address, SUB, imm12, insn); return true;
  case 0x04:
    insn->imm = imm16;
    select_alu(insn, MOV, CONSTANT, false);
    return true;
  case 0x0C:
    insn->imm = imm16;
    decode_movt(insn);
    return true;
  default: return bits(first, 8, 8) && decode_bit_field(first, second, insn);
  }
}

bool decode_data32(uint32_t address, uint16_t first, uint16_t second, Insn *insn) {
  if (first >> 9 == 0x75) {
    return decode_shifted(first, second, insn);
  }
  uint32_t imm12 = bits(first, 10, 10) << 11 | bits(second, 14, 12) << 8 | bits(second, 7, 0);
  insn->n = bits(first, 3, 0);
  insn->d = bits(second, 11, 8);
  return bits(first, 9, 9) ? decode_plain_immediate(address, first, second, imm12, insn)
                           : decode_modified_immediate(first, imm12, insn);
}
