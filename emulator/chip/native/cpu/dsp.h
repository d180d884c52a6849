/* Declarations shared by multiply.c and dsp.c. */
#ifndef FCU_DSP_H
#define FCU_DSP_H
#include "cpu/dispatch.h"

/* The caller sets the fields n, m, d, a. */
bool decode_multiply(uint16_t first, uint16_t second, Insn *insn);

/* SP and PC are UNPREDICTABLE as results of all these; here such an encoding is undefined. */
static inline bool can_be_written(unsigned number) { return number != 13 && number != 15; }

#endif
