/* 32-bit loads and stores (ARMv7-M ARM A5.3.5 to A5.3.10). */
#include "cpu/system.h"
#include "cpu/transfers.h"

static bool decode_form(uint32_t address, uint16_t first, uint16_t second, Insn *insn, enum Form *form) {
  bool pre = bits(second, 10, 10), add = bits(second, 9, 9), write_back = bits(second, 8, 8);
  insn->n = bits(first, 3, 0);
  if (insn->n == 15) {
    *form = LITERAL_FORM;
    insn->n = 0;
    insn->imm = bits(first, 7, 7) ? bits(second, 11, 0) : -bits(second, 11, 0);
    insn->imm += (address + 4) & ~3u;
  } else if (bits(first, 7, 7)) {
    *form = OFFSET;
    insn->imm = bits(second, 11, 0);
  } else if (bits(second, 11, 6) == 0) {
    *form = REGISTER;
    insn->m = bits(second, 3, 0);
    insn->shift = bits(second, 5, 4);
  } else { /* LDRT and similar instructions; no region is protected */
    *form = !write_back ? OFFSET : pre ? PRE_INDEXED : POST_INDEXED;
    insn->imm = add ? bits(second, 7, 0) : -bits(second, 7, 0);
    return bits(second, 11, 11) && (pre || write_back);
  }
  return true;
}

static bool decode_single(uint32_t address, uint16_t first, uint16_t second, Insn *insn) {
  static const enum Transfer transfers[3][3] = {{STRB, LDRB, LDRSB}, {STRH, LDRH, LDRSH}, {STR, LDR, LDR}};
  unsigned size = bits(first, 6, 5);
  bool load = bits(first, 4, 4), sign_extended = bits(first, 8, 8), word = size == 2;
  enum Form form;
  if (size == 3 || (sign_extended && (!load || word)) || !decode_form(address, first, second, insn, &form)) {
    return false;
  }
  unsigned d = second >> 12;
  if (load && !word && d == 15) { /* PLD, PLI, hints */
    insn->n = 0;
    insn->run = nop;
    return form < PRE_INDEXED;
  }
  bool known = decode_transfer(transfers[size][load + sign_extended], form, d, insn);
  return known && !(load && !word && d == 13);
}

/* P = W = 0 are exclusive accesses (A5.3.6). */
static bool decode_dual_or_exclusive(uint32_t address, uint16_t first, uint16_t second, Insn *insn) {
  bool pre = bits(first, 8, 8), add = bits(first, 7, 7), write_back = bits(first, 5, 5);
  bool load = bits(first, 4, 4);
  unsigned n = bits(first, 3, 0);
  uint32_t distance = 4 * bits(second, 7, 0), imm = add ? distance : -distance;
  if (!pre && !write_back) {
    return add ? decode_exclusive_or_table(address, load, n, second, insn)
               : decode_exclusive_word(load, n, second, insn);
  }
  if (n == 15) {
    imm += (address + 4) & ~3u;
    return load && !write_back && decode_dual(load, LITERAL_FORM, n, second, imm, insn);
  }
  enum Form form = !write_back ? OFFSET : pre ? PRE_INDEXED : POST_INDEXED;
  return decode_dual(load, form, n, second, imm, insn);
}

static bool decode_multiple32(uint16_t first, uint16_t second, Insn *insn) {
  unsigned n = bits(first, 3, 0), direction = bits(first, 8, 7);
  bool write_back = bits(first, 5, 5), load = bits(first, 4, 4);
  bool is_one = (second & (second - 1)) == 0, loads_sp = load && second >> 13 & 1;
  if (direction == 0 || direction == 3 || is_one || loads_sp || (write_back && second >> n & 1)) {
    return false; /* RFE, SRS, UNPREDICTABLE */
  }
  return decode_multiple(load, direction == 2, write_back, n, second, insn);
}

bool decode_memory32(uint32_t address, uint16_t first, uint16_t second, Insn *insn) {
  if (first >> 9 == 0x7C) {
    return decode_single(address, first, second, insn);
  }
  return first & 0x40 ? decode_dual_or_exclusive(address, first, second, insn)
                      : decode_multiple32(first, second, insn);
}
