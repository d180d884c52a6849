/* Select the decoder by the instruction's group (ARMv7-M ARM A5.2, A5.3). */
#include "cpu/core.h"

bool decode16(uint32_t address, uint16_t first, Insn *insn) {
  unsigned group = first >> 12;
  if (first >> 10 == 0x11) { /* high registers, BX, BLX */
    bool exchanges = bits(first, 9, 8) == 3;
    return exchanges ? decode_control16(address, first, insn) : decode_data16(address, first, insn);
  }
  if (group < 4 || first >> 10 == 0x10) { /* shifts, immediates, registers */
    return decode_data16(address, first, insn);
  }
  if (group < 0xA || group == 0xC || first >> 11 == 9 || (first & 0xF600) == 0xB400) {
    return decode_memory16(address, first, insn);
  }
  if (group == 0xA || first >> 8 == 0xB0 || first >> 8 == 0xB2 || first >> 8 == 0xBA) {
    return decode_data16(address, first, insn); /* ADR, SP, extension, REV */
  }
  return decode_control16(address, first, insn);
}

bool decode32(uint32_t address, uint16_t first, uint16_t second, Insn *insn) {
  if ((first & 0xEC00) == 0xEC00) {
    return decode_vfp(address, first, second, insn);
  }
  if ((first & 0xFE00) == 0xEA00) {
    return decode_data32(address, first, second, insn);
  }
  if ((first & 0xFE00) == 0xE800) {
    return decode_memory32(address, first, second, insn); /* multiple, dual, exclusive, table branch */
  }
  if ((first & 0xF800) == 0xF000) {
    return second & 0x8000 ? decode_control32(address, first, second, insn)
                           : decode_data32(address, first, second, insn);
  }
  if ((first & 0xFE00) == 0xF800) {
    return decode_memory32(address, first, second, insn);
  }
  return decode_dsp(first, second, insn);
}
