/* The data processing operations shared by 16-bit and 32-bit encodings. */
#ifndef FCU_OPERATIONS_H
#define FCU_OPERATIONS_H

#include "cpu/dispatch.h"

/* The second operand: the register m shifted by insn->by, 1 to 32 (the first five are enum Shift; RRX has no
 * distance), the register m unshifted, or insn->imm. After a logical operation with CONSTANT, C is unchanged; with
 * ROTATED_CONSTANT it is bit 31 of the constant (ThumbExpandImm_C, A5.3.2). */
enum Operand { BY_LSL = LSL, BY_LSR, BY_ASR, BY_ROR, BY_RRX, UNSHIFTED, CONSTANT, ROTATED_CONSTANT, OPERANDS };

/* d = n <operation> operand; MOV and MVN have no n, the last four no d. */
enum Alu { NO_ALU, AND, BIC, ORR, ORN, EOR, ADD, ADC, SBC, SUB, RSB, MOV, MVN, TST, TEQ, CMN, CMP, ALUS };

/* Select the operation of insn; the caller sets d, n, m, imm and by. The last four always set flags. */
void select_alu(Insn *insn, enum Alu alu, enum Operand operand, bool set_flags);
/* The same for 16-bit instructions, which set flags only outside of IT blocks; insn->it says if it is in one. */
void select_alu16(Insn *insn, enum Alu alu, enum Operand operand);

/* The low bits of SP and PC are always 0 (B1.4.1; BranchWritePC, A2.3.1); d must already be decoded. */
static inline void writes_d(Insn *insn) {
  insn->flags |= insn->d == 13 ? WRITES_SP : insn->d == 15 ? WRITES_SP | ENDS_BLOCK : 0;
}

/* bitfield.c; d, n and m must already be decoded. */
void decode_movt(Insn *insn);
/* 0xEACx: PKHBT, PKHTB. */
bool decode_pack(uint16_t first, uint16_t second, Insn *insn);
/* 0xF3xx: saturation and bit fields. */
bool decode_bit_field(uint16_t first, uint16_t second, Insn *insn);

#endif
