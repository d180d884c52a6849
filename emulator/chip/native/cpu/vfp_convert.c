/* VCVT: integers, fixed point, half precision (ARMv7-M ARM A7.7). d, m: S registers; shift: fraction bits. */
#include "cpu/vfp.h"

#define M core->s[insn->m]
#define D core->s[insn->d]
#define RESULT(name, result) COMPUTATION(name, use_floating_point(core), D = result)

static uint32_t saturated(Core *core, bool negative, bool is_signed, unsigned width) {
  core->fpscr |= FPSCR_IOC;
  uint32_t highest = (uint32_t)((1ull << (is_signed ? width - 1 : width)) - 1);
  return negative ? (is_signed ? ~highest : 0) : highest;
}

/* FPToFixed. */
static uint32_t to_fixed(Core *core, uint32_t value, unsigned by, bool is_signed, unsigned width,
                         enum Rounding mode) {
  Number number = unpacked(core, value);
  if (is_nan(value)) {
    core->fpscr |= FPSCR_IOC;
    return 0;
  }
  int exponent = number.exponent + (int)by;
  if (number.significand && exponent > 16) { /* exceeds 32 bits, or is infinite */
    return saturated(core, number.sign, is_signed, width);
  }
  uint64_t wide = number.significand << 24; /* 24 binary places; the lowest is sticky */
  int down = -exponent;
  if (down <= 0) {
    wide = number.significand << exponent << 24;
  } else if (down < 48) {
    wide = wide >> down | ((wide & ((1ull << down) - 1)) != 0);
  } else {
    wide = number.significand != 0;
  }
  uint64_t magnitude = wide >> 24, lost = wide & 0xFFFFFF, half = 0x800000;
  bool up = mode == TO_NEAREST ? lost > half || (lost == half && magnitude & 1)
                               : lost && mode == (number.sign ? DOWNWARD : UPWARD);
  int64_t result = (int64_t)(magnitude + up);
  result = number.sign ? -result : result;
  int64_t highest = (int64_t)((1ull << (is_signed ? width - 1 : width)) - 1);
  if (result > highest || result < (is_signed ? -highest - 1 : 0)) {
    return saturated(core, number.sign, is_signed, width);
  }
  core->fpscr |= lost ? FPSCR_IXC : 0;
  return (uint32_t)result;
}

/* Return whether the host can convert the value: it must be a normal number (neither zero nor denormal)
 * with an absolute value below 2^31. */
static inline bool fits_int32(uint32_t value) { return LIKELY((value >> 23 & 0xFF) - 1 < 126 + 31); }

static uint32_t to_signed(Core *core, uint32_t value) {
  if (!fits_int32(value)) {
    return to_fixed(core, value, 0, true, 32, TOWARD_ZERO);
  }
  int32_t result = (int32_t)to_float(value);
  core->fpscr |= (float)result != to_float(value) ? FPSCR_IXC : 0;
  return (uint32_t)result;
}
static uint32_t to_unsigned(Core *core, uint32_t value) {
  bool easy = fits_int32(value) && !(value & SIGN);
  return easy ? to_signed(core, value) : to_fixed(core, value, 0, false, 32, TOWARD_ZERO);
}

RESULT(vcvt_s32_f32, to_signed(core, M))
RESULT(vcvt_u32_f32, to_unsigned(core, M))
RESULT(vcvtr_s32_f32, to_fixed(core, M, 0, true, 32, rounding_mode(core)))
RESULT(vcvtr_u32_f32, to_fixed(core, M, 0, false, 32, rounding_mode(core)))
RESULT(fixed_s32_f32, to_fixed(core, D, insn->shift, true, 32, TOWARD_ZERO))
RESULT(fixed_u32_f32, to_fixed(core, D, insn->shift, false, 32, TOWARD_ZERO))
RESULT(fixed_s16_f32, to_fixed(core, D, insn->shift, true, 16, TOWARD_ZERO))
RESULT(fixed_u16_f32, to_fixed(core, D, insn->shift, false, 16, TOWARD_ZERO))

/* FixedToFP. */
static uint32_t from_fixed(Core *core, int64_t value, unsigned by, enum Rounding mode) {
  uint64_t magnitude = (uint64_t)(value < 0 ? -value : value);
  return rounded(core, (Number){value < 0, -(int)by, magnitude}, SINGLE, mode);
}

static uint32_t from_integer(Core *core, int64_t value) {
  if (UNLIKELY(rounding_mode(core) != TO_NEAREST)) {
    return from_fixed(core, value, 0, rounding_mode(core));
  }
  float result = (float)value;
  core->fpscr |= (int64_t)result != value ? FPSCR_IXC : 0;
  return from_float(result);
}

RESULT(vcvt_f32_s32, from_integer(core, (int32_t)M))
RESULT(vcvt_f32_u32, from_integer(core, M))
/* These instructions round to nearest, regardless of FPSCR (A7.7). */
RESULT(fixed_f32_s32, from_fixed(core, (int32_t)D, insn->shift, TO_NEAREST))
RESULT(fixed_f32_u32, from_fixed(core, D, insn->shift, TO_NEAREST))
RESULT(fixed_f32_s16, from_fixed(core, (int16_t)D, insn->shift, TO_NEAREST))
RESULT(fixed_f32_u16, from_fixed(core, (uint16_t)D, insn->shift, TO_NEAREST))

static uint32_t from_half(Core *core, uint32_t half) {
  uint32_t sign = (half & 0x8000) << 16, fraction = half & 0x3FF;
  int biased = half >> 10 & 31;
  if (biased == 31 && !(core->fpscr & FPSCR_AHP)) {
    uint32_t value = sign | INFINITE | fraction << 13;
    return fraction ? quieted(core, value) : value;
  }
  Number number = {sign != 0, (biased ? biased : 1) - 25, biased ? fraction | 0x400 : fraction};
  return rounded(core, number, SINGLE, TO_NEAREST);
}

static uint32_t to_half(Core *core, uint32_t value) {
  bool alternative = core->fpscr & FPSCR_AHP;
  uint32_t sign = value >> 16 & 0x8000;
  Number number = unpacked(core, value);
  if (alternative && (is_nan(value) || is_infinite(value))) { /* not in this format */
    core->fpscr |= FPSCR_IOC;
    return is_nan(value) ? sign : sign | 0x7FFF;
  }
  if (is_nan(value)) {
    uint32_t nan = quieted(core, value);
    return (nan >> 16 & 0x8000) | 0x7C00 | (nan >> 13 & 0x3FF);
  }
  if (is_infinite(value)) {
    return sign | 0x7C00;
  }
  uint32_t result = rounded(core, number, alternative ? ALTERNATIVE_HALF : HALF, rounding_mode(core));
  return result >> 16 | (result & 0x7FFF);
}

static uint32_t with_half(uint32_t word, uint32_t half, bool high) {
  return high ? (word & 0xFFFF) | half << 16 : (word & 0xFFFF0000) | half;
}

RESULT(vcvtb_f32_f16, from_half(core, M & 0xFFFF))
RESULT(vcvtt_f32_f16, from_half(core, M >> 16))
RESULT(vcvtb_f16_f32, with_half(D, to_half(core, M), false))
RESULT(vcvtt_f16_f32, with_half(D, to_half(core, M), true))

static bool decode_fixed(uint16_t first, uint16_t second, Insn *insn) {
  static const Operation FIXED[] = { /* bits of the index: to fixed point, unsigned, 32 bits */
      fixed_f32_s16, fixed_f32_s32, fixed_f32_u16, fixed_f32_u32,
      fixed_s16_f32, fixed_s32_f32, fixed_u16_f32, fixed_u32_f32};
  bool is_word = second & 0x80;
  int by = (is_word ? 32 : 16) - (int)((second & 15) << 1 | (second >> 5 & 1));
  insn->shift = (uint8_t)by;
  insn->run = FIXED[(first & 4) | (first & 1) << 1 | is_word];
  return by >= 0;
}

/* Table A6-5. */
bool decode_vfp_conversion(uint16_t first, uint16_t second, Insn *insn) {
  unsigned opc2 = first & 15;
  bool high = second & 0x80;
  if (!(second & 0x40)) {
    return false;
  }
  switch (opc2) {
  case 2: insn->run = high ? vcvtt_f32_f16 : vcvtb_f32_f16; break;
  case 3: insn->run = high ? vcvtt_f16_f32 : vcvtb_f16_f32; break;
  case 8: insn->run = high ? vcvt_f32_s32 : vcvt_f32_u32; break;
  case 12: insn->run = high ? vcvt_u32_f32 : vcvtr_u32_f32; break;
  case 13: insn->run = high ? vcvt_s32_f32 : vcvtr_s32_f32; break;
  case 10: case 11: case 14: case 15: return decode_fixed(first, second, insn);
  default: return false;
  }
  return true;
}
