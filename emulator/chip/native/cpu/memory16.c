/* 16-bit loads and stores (ARMv7-M ARM A5.2.4, A5.2.5). */
#include "cpu/transfers.h"

static bool decode_single(enum Transfer transfer, enum Form form, unsigned d, unsigned n, Insn *insn) {
  insn->n = (uint8_t)n;
  return decode_transfer(transfer, form, d, insn);
}

bool decode_memory16(uint32_t address, uint16_t first, Insn *insn) {
  unsigned low = bits(first, 2, 0), middle = bits(first, 5, 3), high = bits(first, 10, 8);
  bool load = bits(first, 11, 11);
  switch (first >> 12) {
  case 4:
    insn->imm = ((address + 4) & ~3u) + 4 * bits(first, 7, 0);
    return decode_single(LDR, LITERAL_FORM, high, 0, insn);
  case 5:
    insn->m = bits(first, 8, 6);
    return decode_single((enum Transfer)bits(first, 11, 9), REGISTER, low, middle, insn);
  case 6:
    insn->imm = 4 * bits(first, 10, 6);
    return decode_single(load ? LDR : STR, OFFSET, low, middle, insn);
  case 7:
    insn->imm = bits(first, 10, 6);
    return decode_single(load ? LDRB : STRB, OFFSET, low, middle, insn);
  case 8:
    insn->imm = 2 * bits(first, 10, 6);
    return decode_single(load ? LDRH : STRH, OFFSET, low, middle, insn);
  case 9:
    insn->imm = 4 * bits(first, 7, 0);
    return decode_single(load ? LDR : STR, OFFSET, high, 13, insn);
  case 0xB: {
    uint32_t list = bits(first, 7, 0) | bits(first, 8, 8) << (load ? 15 : 14);
    return decode_multiple(load, !load, true, 13, list, insn);
  }
  default: { /* a base register in the list is not written back (A7.7.40) */
    uint32_t list = bits(first, 7, 0);
    return decode_multiple(load, false, !load || !(list >> high & 1), high, list, insn);
  }
  }
}
