/* Multiplication and division (ARMv7-M ARM A5.3.16, A5.3.17).
 *
 * 64-bit results: d is RdHi, a is RdLo. shift: bits 1 and 0 select the high halves of n and m; in dual instructions
 * bit 0 swaps the halves of m.
 */
#include "cpu/dsp.h"

#define N core->r[insn->n]
#define M core->r[insn->m]
#define A core->r[insn->a]
#define D core->r[insn->d]

static int32_t half(uint32_t word, bool high) { return (int16_t)(high ? word >> 16 : word); }
static int32_t half_of_n(const Core *core, const Insn *insn) { return half(N, insn->shift & 2); }
static int32_t half_of_m(const Core *core, const Insn *insn) { return half(M, insn->shift & 1); }

/* Q is set if the sum overflows. */
static void set_sum(Core *core, const Insn *insn, int64_t sum) {
  D = (uint32_t)sum;
  core->q |= sum != (int32_t)sum;
}

static uint64_t long_accumulator(const Core *core, const Insn *insn) { return (uint64_t)D << 32 | A; }
static void set_long(Core *core, const Insn *insn, uint64_t result) {
  A = (uint32_t)result;
  D = (uint32_t)(result >> 32);
}

COMPUTATION(mul, D = N * M)
COMPUTATION(mla, D = A + N * M)
COMPUTATION(mls, D = A - N * M)

COMPUTATION(smul_halves, D = (uint32_t)(half_of_n(core, insn) * half_of_m(core, insn)))
OPERATION(smla_halves) {
  set_sum(core, insn, (int64_t)(int32_t)A + half_of_n(core, insn) * half_of_m(core, insn));
  NEXT;
}

static int64_t word_by_half(const Core *core, const Insn *insn) {
  return (int64_t)(int32_t)N * half_of_m(core, insn) >> 16;
}
COMPUTATION(smulw, D = (uint32_t)word_by_half(core, insn))
COMPUTATION(smlaw, set_sum(core, insn, (int32_t)A + word_by_half(core, insn)))

static int64_t dual(const Core *core, const Insn *insn, bool subtract) {
  uint32_t m = insn->shift & 1 ? rotate_right(M, 16) : M;
  int64_t low = half(N, false) * half(m, false), high = half(N, true) * half(m, true);
  return subtract ? low - high : low + high;
}
COMPUTATION(smuad, set_sum(core, insn, dual(core, insn, false)))
COMPUTATION(smlad, set_sum(core, insn, (int32_t)A + dual(core, insn, false)))
COMPUTATION(smusd, set_sum(core, insn, dual(core, insn, true)))
COMPUTATION(smlsd, set_sum(core, insn, (int32_t)A + dual(core, insn, true)))

/* SMMUL, SMMLA, SMMLS: the result is rounded if bit 0 of shift is 1. */
static uint64_t product(const Core *core, const Insn *insn) {
  return (uint64_t)((int64_t)(int32_t)N * (int32_t)M);
}
static uint64_t rounding(const Insn *insn) { return (uint64_t)(insn->shift & 1) << 31; }
COMPUTATION(smmul, D = (uint32_t)((product(core, insn) + rounding(insn)) >> 32))
COMPUTATION(smmla, D = (uint32_t)((((uint64_t)A << 32) + product(core, insn) + rounding(insn)) >> 32))
COMPUTATION(smmls, D = (uint32_t)((((uint64_t)A << 32) - product(core, insn) + rounding(insn)) >> 32))

static uint32_t sum_of_differences(const Core *core, const Insn *insn) {
  uint32_t sum = 0;
  for (unsigned at = 0; at < 32; at += 8) {
    uint32_t n = N >> at & 0xFF, m = M >> at & 0xFF;
    sum += n > m ? n - m : m - n;
  }
  return sum;
}
COMPUTATION(usad8, D = sum_of_differences(core, insn))
COMPUTATION(usada8, D = A + sum_of_differences(core, insn))

COMPUTATION(smull, set_long(core, insn, product(core, insn)))
COMPUTATION(umull, set_long(core, insn, (uint64_t)N * M))
COMPUTATION(smlal, set_long(core, insn, long_accumulator(core, insn) + product(core, insn)))
COMPUTATION(umlal, set_long(core, insn, long_accumulator(core, insn) + (uint64_t)N * M))
COMPUTATION(umaal, set_long(core, insn, (uint64_t)N * M + D + A))
OPERATION(smlal_halves) {
  int64_t product = half_of_n(core, insn) * half_of_m(core, insn);
  set_long(core, insn, long_accumulator(core, insn) + (uint64_t)product);
  NEXT;
}
COMPUTATION(smlald, set_long(core, insn, long_accumulator(core, insn) + (uint64_t)dual(core, insn, false)))
COMPUTATION(smlsld, set_long(core, insn, long_accumulator(core, insn) + (uint64_t)dual(core, insn, true)))

/* Division by 0 gives 0, or a fault with CCR.DIV_0_TRP. */
#define DEFINE_DIVISION(name, quotient)                  \
  OPERATION(name) {                                      \
    if (UNLIKELY(M == 0 && core->div_0_trp)) {           \
      stop_at(core, insn, budget, STOP_DIVIDE_BY_ZERO);  \
      return;                                            \
    }                                                    \
    D = M ? quotient : 0;                                \
    NEXT;                                                \
  }
DEFINE_DIVISION(udiv, N / M)
DEFINE_DIVISION(sdiv, (uint32_t)((int64_t)(int32_t)N / (int32_t)M))

/* Section A5.3.16. a = 15 means no accumulator. */
static Operation multiply(unsigned op1, unsigned op2, unsigned a) {
  bool alone = a == 15;
  switch (op1) {
  case 0: return op2 == 0 ? (alone ? mul : mla) : op2 == 1 ? mls : NULL;
  case 1: return alone ? smul_halves : smla_halves;
  case 2: return op2 > 1 ? NULL : alone ? smuad : smlad;
  case 3: return op2 > 1 ? NULL : alone ? smulw : smlaw;
  case 4: return op2 > 1 ? NULL : alone ? smusd : smlsd;
  case 5: return op2 > 1 ? NULL : alone ? smmul : smmla;
  case 6: return op2 > 1 ? NULL : alone ? smmul : smmls;
  default: return op2 ? NULL : alone ? usad8 : usada8;
  }
}

/* Section A5.3.17. */
static Operation multiply_long_or_divide(unsigned op1, unsigned op2) {
  switch (op1 << 4 | op2) {
  case 0x00: return smull;
  case 0x1F: return sdiv;
  case 0x20: return umull;
  case 0x3F: return udiv;
  case 0x40: return smlal;
  case 0x48: case 0x49: case 0x4A: case 0x4B: return smlal_halves;
  case 0x4C: case 0x4D: return smlald;
  case 0x5C: case 0x5D: return smlsld;
  case 0x60: return umlal;
  case 0x66: return umaal;
  default: return NULL;
  }
}

bool decode_multiply(uint16_t first, uint16_t second, Insn *insn) {
  unsigned op1 = bits(first, 6, 4), op2 = bits(second, 7, 4);
  insn->shift = op2 & 3;
  if (first & 0x80) {
    insn->run = multiply_long_or_divide(op1, op2);
    if (op2 == 0xF) {
      insn->a = 0;
    }
    return insn->run && can_be_written(insn->a);
  }
  insn->run = op2 < 4 ? multiply(op1, op2, insn->a) : NULL;
  insn->a = insn->a == 15 ? 0 : insn->a;
  return insn->run != NULL;
}
