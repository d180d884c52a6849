/* Numbers in single precision as bits, and FPSCR. */
#ifndef FLOATING_H
#define FLOATING_H

#include <string.h>

#include "kernel.h"

/* Special ones and their neighbours, integers, numbers about 1, denormal ones, and anything. */
uint32_t single(void);
/* FPSCR for the n-th run: each rounding mode, FZ and DN, in turn. */
uint32_t mode(unsigned n);

/* FPSCR as it is after reset, which the compiler's code expects. */
static inline void plain(void) { __asm volatile("vmsr fpscr, %0" : : "r"(0)); }

static inline float of_bits(uint32_t bits) {
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

/* Every NaN is one: which operand's payload it has is the compiler's choice. */
static inline void add_float(float value) {
  uint32_t bits;
  memcpy(&bits, &value, sizeof bits);
  add(value != value ? 0x7FC00000 : bits);
}

#endif
