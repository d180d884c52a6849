/* Data processing in 16-bit and 32-bit encodings. */
#ifndef FCU_OPERATIONS_H
#define FCU_OPERATIONS_H

#include "cpu/dispatch.h"

/* The second operand: register m shifted by 1 to 32 (the values of enum Shift come first), m, or imm. A
 * logical operation with CONSTANT leaves C unchanged; with ROTATED_CONSTANT it sets C to bit 31 of the
 * constant (ThumbExpandImm_C, A5.3.2). */
enum Operand { BY_LSL = LSL, BY_LSR, BY_ASR, BY_ROR, BY_RRX, UNSHIFTED, CONSTANT, ROTATED_CONSTANT, OPERANDS };

/* MOV and MVN have no n. The instructions TST to CMP have no d, and always set flags. */
enum Alu { NO_ALU, AND, BIC, ORR, ORN, EOR, ADD, ADC, SBC, SUB, RSB, MOV, MVN, TST, TEQ, CMN, CMP, ALUS };

/* The caller has set d, n, m, imm and shift. */
void select_alu(Insn *insn, enum Alu alu, enum Operand operand, bool set_flags);
/* 16-bit instructions set flags only outside of IT blocks. */
void select_alu16(Insn *insn, enum Alu alu, enum Operand operand);

/* The low bits of SP and PC are always 0 (B1.4.1, A2.3.1). */
static inline void writes_d(Insn *insn) {
  insn->flags |= insn->d == 13 ? WRITES_SP : insn->d == 15 ? WRITES_SP | ENDS_BLOCK : 0;
}

void decode_movt(Insn *insn);
bool decode_pack(uint16_t first, uint16_t second, Insn *insn);
bool decode_bit_field(uint16_t first, uint16_t second, Insn *insn);

/* Functions of dsp.c: the shift of n by the lowest byte of m, and REV, REV16, RBIT, REVSH of m. */
Operation shift_by_register(enum Shift type, bool set_flags);
Operation reversal(unsigned number);

#endif
