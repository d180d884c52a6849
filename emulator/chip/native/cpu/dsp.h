/* Declarations that multiply.c and dsp.c share. */
#ifndef FCU_DSP_H
#define FCU_DSP_H
#include "cpu/dispatch.h"

bool decode_multiply(uint16_t first, uint16_t second, Insn *insn);

/* Instructions with SP or PC as result are UNPREDICTABLE. This core treats them as undefined. */
static inline bool can_be_written(unsigned number) { return number != 13 && number != 15; }

#endif
