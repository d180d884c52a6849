/* Instructions that control the core. */
#ifndef FCU_SYSTEM_H
#define FCU_SYSTEM_H

#include "cpu/dispatch.h"

void nop(Core *core, const Insn *insn, int32_t budget);

/* Sections A5.2.5, A5.3.4. */
bool decode_hint(unsigned number, Insn *insn);
bool decode_cps(uint16_t first, Insn *insn);
bool decode_system32(uint16_t first, uint16_t second, Insn *insn);

#endif
