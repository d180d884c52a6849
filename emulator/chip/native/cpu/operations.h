/* The data processing operations, which 16-bit and 32-bit encodings share. */
#ifndef FCU_OPERATIONS_H
#define FCU_OPERATIONS_H

#include "cpu/dispatch.h"

/* Where the second operand comes from: the register m shifted by insn->by, 1 to 32 (the first five are enum
 * Shift; RRX has no distance), the register m as it is, or insn->imm. The two constants differ in what a
 * logical operation makes C: what it was, or bit 31 of the constant (ThumbExpandImm_C, A5.3.2). */
enum Operand { BY_LSL = LSL, BY_LSR, BY_ASR, BY_ROR, BY_RRX, PLAIN, CONSTANT, ROTATED_CONSTANT, OPERANDS };

/* d = n <operation> operand; MOV and MVN have no n, the last four no d. */
enum Alu { NO_ALU, AND, BIC, ORR, ORN, EOR, ADD, ADC, SBC, SUB, RSB, MOV, MVN, TST, TEQ, CMN, CMP, ALUS };

/* Chooses what insn does; d, n, m, imm and by are the caller's. The last four set flags either way. */
void choose_alu(Insn *insn, enum Alu alu, enum Operand operand, bool set_flags);
/* Likewise for 16-bit instructions that set flags outside of ITblocks only; insn->it tells. */
void choose_alu16(Insn *insn, enum Alu alu, enum Operand operand);

/* The low bits of SP and PC are 0 whatever is written (B1.4.1; BranchWritePC, A2.3.1); d is decoded already. */
static inline void writes_d(Insn *insn) {
  insn->kind |= insn->d == 13 ? WRITES_SP : insn->d == 15 ? WRITES_SP | ENDS : 0;
}

/* bitfield.c; d, n and m are decoded already. */
void choose_movt(Insn *insn);
/* 0xEACx: PKHBT, PKHTB. */
bool decode_pack(uint16_t first, uint16_t second, Insn *insn);
/* 0xF3xx: saturation and bit fields. */
bool decode_bit_field(uint16_t first, uint16_t second, Insn *insn);

#endif
