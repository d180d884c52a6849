/* Floating-point arithmetic and comparison (ARMv7-M ARM A6.4). d, n, m: S registers. */
#include <math.h>

#include "cpu/vfp.h"

#define N core->s[insn->n]
#define M core->s[insn->m]
#define D core->s[insn->d]
#define RESULT(name, result) COMPUTATION(name, use_floating_point(core), D = result)

/* The host's result is used if three conditions hold: FPSCR selects rounding to nearest, FZ is 0, and IXC
 * is already set. IXC is the only flag that ordinary operands raise. A finite result of at least 2^-100
 * does not underflow. */

static inline bool host_is_exact(const Core *core) {
  return LIKELY((core->fpscr & (FPSCR_RMODE | FPSCR_FZ | FPSCR_IXC)) == FPSCR_IXC);
}

static inline bool is_ordinary(uint32_t result) {
  const uint32_t lowest = (127 - 100) << 23;
  return LIKELY((result & ~SIGN) - lowest < INFINITE - lowest);
}

#define DEFINE_ARITHMETIC(name, operator, exact)                                            \
  static inline uint32_t name(Core *core, uint32_t left, uint32_t right) {                  \
    uint32_t result = from_float(to_float(left) operator to_float(right));                  \
    return host_is_exact(core) && is_ordinary(result) ? result : exact(core, left, right);  \
  }
DEFINE_ARITHMETIC(add, +, exact_add)
DEFINE_ARITHMETIC(multiply, *, exact_multiply)
DEFINE_ARITHMETIC(divide, /, exact_divide)

/* A NaN keeps its sign. */
static inline uint32_t subtract(Core *core, uint32_t left, uint32_t right) {
  return add(core, left, is_nan(right) ? right : negated(right));
}

static inline uint32_t square_root(Core *core, uint32_t value) {
  uint32_t result = from_float(sqrtf(to_float(value)));
  return host_is_exact(core) && is_ordinary(result) ? result : exact_square_root(core, value);
}

/* The product is exact as a double. The sum is rounded twice. The result is wrong only if the double is
 * half-way between two floats. */
static inline uint32_t multiply_add(Core *core, uint32_t addend, uint32_t left, uint32_t right) {
  double product = (double)to_float(left) * to_float(right), sum = product + to_float(addend);
  uint64_t sum_bits;
  memcpy(&sum_bits, &sum, sizeof sum_bits);
  uint32_t result = from_float((float)sum);
  bool half_way = (sum_bits & 0x1FFFFFFF) == 0x10000000;
  bool is_sum = host_is_exact(core) && !half_way && product != 0 && is_ordinary(result);
  return is_sum ? result : exact_multiply_add(core, addend, left, right);
}

RESULT(vadd, add(core, N, M))
RESULT(vsub, subtract(core, N, M))
RESULT(vmul, multiply(core, N, M))
RESULT(vnmul, negated(multiply(core, N, M)))
RESULT(vdiv, divide(core, N, M))
RESULT(vsqrt, square_root(core, M))

RESULT(vmla, add(core, D, multiply(core, N, M)))
RESULT(vmls, add(core, D, negated(multiply(core, N, M))))
RESULT(vnmla, add(core, negated(D), negated(multiply(core, N, M))))
RESULT(vnmls, add(core, negated(D), multiply(core, N, M)))

RESULT(vfma, multiply_add(core, D, N, M))
RESULT(vfms, multiply_add(core, D, negated(N), M))
RESULT(vfnma, multiply_add(core, negated(D), negated(N), M))
RESULT(vfnms, multiply_add(core, negated(D), N, M))

RESULT(vmov_immediate, insn->imm)
RESULT(vmov, M)
RESULT(vabs, M & ~SIGN)
RESULT(vneg, negated(M))

/* Map a float to an integer so that comparing the integers compares the floats. */
static int32_t ordinal(uint32_t value) {
  int32_t magnitude = (int32_t)(value & ~SIGN);
  return value & SIGN ? -magnitude : magnitude;
}

static uint32_t flushed(Core *core, uint32_t value) {
  return core->fpscr & FPSCR_FZ && unpacked(core, value).significand == 0 ? value & SIGN : value;
}

/* FPCompare. */
static void compare(Core *core, uint32_t left, uint32_t right, bool quiet_nan_is_invalid) {
  use_floating_point(core);
  left = flushed(core, left);
  right = flushed(core, right);
  uint32_t nzcv;
  if (UNLIKELY(is_nan(left) || is_nan(right))) {
    nzcv = 3;
    bool invalid = quiet_nan_is_invalid || is_signalling(left) || is_signalling(right);
    core->fpscr |= invalid ? FPSCR_IOC : 0;
  } else {
    int32_t a = ordinal(left), b = ordinal(right);
    nzcv = a == b ? 6 : a < b ? 8 : 2;
  }
  core->fpscr = (core->fpscr & ~FPSCR_NZCV) | nzcv << 28;
}

COMPUTATION(vcmp, compare(core, D, M, false))
COMPUTATION(vcmpe, compare(core, D, M, true))
COMPUTATION(vcmp_zero, compare(core, D, 0, false))
COMPUTATION(vcmpe_zero, compare(core, D, 0, true))

/* VFPExpandImm (A6.4.1). */
static uint32_t expand_immediate(uint32_t imm8) {
  uint32_t exponent = imm8 & 0x40 ? 0x7C : 0x80;
  return (imm8 & 0x80) << 24 | (exponent | (imm8 >> 4 & 3)) << 23 | (imm8 & 15) << 19;
}

/* Table A6-5. */
static Operation decode_other(uint16_t first, uint16_t second, Insn *insn) {
  if (!(second & 0x40)) {
    insn->imm = expand_immediate((first & 15u) << 4 | (second & 15));
    return second & 0xA0 ? NULL : vmov_immediate;
  }
  bool high = second & 0x80;
  switch (first & 15) {
  case 0: return high ? vabs : vmov;
  case 1: return high ? vsqrt : vneg;
  case 4: return high ? vcmpe : vcmp;
  case 5: return second & 0x2F ? NULL : high ? vcmpe_zero : vcmp_zero;
  default: return NULL;
  }
}

bool decode_vfp_data(uint16_t first, uint16_t second, Insn *insn) {
  static const Operation ARITHMETIC[][2] = { /* indices: opc1 without its bit D, and bit 6 of the second
                                                half-word (table A6-4) */
      [0x0] = {vmla, vmls}, [0x1] = {vnmls, vnmla}, [0x2] = {vmul, vnmul}, [0x3] = {vadd, vsub},
      [0x8] = {vdiv, NULL}, [0x9] = {vfnms, vfnma}, [0xA] = {vfma, vfms}, [0xB] = {NULL, NULL}};
  insn->d = single(second >> 12, first >> 6);
  insn->n = single(first, second >> 7);
  insn->m = single(second, second >> 5);
  unsigned opc1 = first >> 4 & 0xB;
  if (opc1 == 0xB) {
    insn->run = decode_other(first, second, insn);
    return insn->run || decode_vfp_conversion(first, second, insn);
  }
  insn->run = ARITHMETIC[opc1][second >> 6 & 1];
  return insn->run != NULL;
}
