/* Decoder of coprocessor instructions (ARMv7-M ARM A5.3.18, A6.3 to A6.7). */
#include "cpu/vfp.h"

void no_coprocessor(Core *core, const Insn *insn, int32_t budget) { stop_at(core, insn, budget, STOP_NO_COPROCESSOR); }

bool is_floating_point(uint16_t first, uint16_t second) {
  return (first & 0xEC00) == 0xEC00 && (first & 0xF00) != 0xF00 && (second & 0xE00) == 0xA00;
}

bool decode_vfp(uint32_t address, uint16_t first, uint16_t second, Insn *insn) {
  bool floating_point = (second & 0xE00) == 0xA00;
  if ((first & 0xF00) == 0xF00) {
    return false; /* Advanced SIMD */
  }
  if (!floating_point) {
    insn->run = no_coprocessor;
    insn->flags |= ENDS_BLOCK;
    return true;
  }
  if (first & 0x1000) {
    return false;
  }
  if ((first & 0xF00) != 0xE00) {
    return (first & 0xE00) == 0xC00 && decode_vfp_memory(address, first, second, insn);
  }
  if (second & 0x10) {
    return decode_vfp_move(first, second, insn);
  }
  return !(second & 0x100) && decode_vfp_data(first, second, insn);
}
