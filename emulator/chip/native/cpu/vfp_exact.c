/* Floating-point arithmetic with integers (ARMv7-M ARM A2.5.4, chapter D6). */
#include "cpu/vfp.h"

const Format SINGLE = {23, 254}, HALF = {10, 30}, ALTERNATIVE_HALF = {10, 31};

static void raise_flag(Core *core, uint32_t flag) { core->fpscr |= flag; }

static uint32_t invalid(Core *core) {
  raise_flag(core, FPSCR_IOC);
  return DEFAULT_NAN;
}

static uint32_t zero(bool sign) { return sign ? SIGN : 0; }
static uint32_t infinity(bool sign) { return zero(sign) | INFINITE; }

uint32_t quieted(Core *core, uint32_t nan) {
  if (is_signalling(nan)) {
    raise_flag(core, FPSCR_IOC);
  }
  return core->fpscr & FPSCR_DN ? DEFAULT_NAN : nan | QUIET;
}

/* FPProcessNaNs, FPProcessNaNs3: use the first signalling NaN, or the first NaN if none is signalling. */
static bool process_nans(Core *core, const uint32_t *operands, unsigned count, uint32_t *result) {
  uint32_t chosen = 0;
  for (unsigned n = count; n-- > 0;) {
    if (is_signalling(operands[n]) || (is_nan(operands[n]) && !is_signalling(chosen))) {
      chosen = operands[n];
    }
  }
  if (!is_nan(chosen)) {
    return false;
  }
  *result = quieted(core, chosen);
  return true;
}

Number unpacked(Core *core, uint32_t value) {
  uint32_t fraction = value & 0x7FFFFF;
  int biased = value >> 23 & 0xFF;
  if (biased == 0 && fraction && core->fpscr & FPSCR_FZ) {
    raise_flag(core, FPSCR_IDC);
    fraction = 0;
  }
  return (Number){
      .sign = value >> 31,
      .exponent = (biased ? biased : 1) - 150,
      .significand = biased ? fraction | 0x800000 : fraction,
  };
}

/* Shift right. The lowest bit of the result is sticky. */
static uint64_t shifted_right(uint64_t significand, int by) {
  if (by <= 0) {
    return significand;
  }
  return by > 63 ? significand != 0 : significand >> by | ((significand << (64 - by)) != 0);
}

/* Shift left until bit 63 is set. */
static Number normalised(Number number) {
  int by = __builtin_clzll(number.significand);
  number.significand <<= by;
  number.exponent -= by;
  return number;
}

static uint32_t overflow(Core *core, bool sign, Format format, enum Rounding mode) {
  uint32_t beyond = (uint32_t)(format.highest_exponent + 1) << format.fraction_bits;
  if (format.highest_exponent == ALTERNATIVE_HALF.highest_exponent) { /* this format has no infinity */
    raise_flag(core, FPSCR_IOC);
    return beyond - 1;
  }
  raise_flag(core, FPSCR_OFC | FPSCR_IXC);
  bool to_infinity = mode == TO_NEAREST || mode == (sign ? DOWNWARD : UPWARD);
  return to_infinity ? beyond : beyond - 1;
}

static bool rounds_away(uint64_t lost, uint64_t half, bool is_odd, bool sign, enum Rounding mode) {
  switch (mode) {
  case TO_NEAREST: return lost > half || (lost == half && is_odd);
  case UPWARD: return lost && !sign;
  case DOWNWARD: return lost && sign;
  default: return false;
  }
}

/* The sign is bit 31, also for half precision. */
uint32_t rounded(Core *core, Number number, Format format, enum Rounding mode) {
  uint32_t sign = zero(number.sign);
  if (!number.significand) {
    return sign;
  }
  number = normalised(number);
  bool is_single = format.fraction_bits == SINGLE.fraction_bits;
  int biased = number.exponent + 63 + (is_single ? 127 : 15);
  bool tiny = biased <= 0; /* before rounding */
  if (tiny) {
    if (is_single && core->fpscr & FPSCR_FZ) {
      raise_flag(core, FPSCR_UFC);
      return sign;
    }
    number.significand = shifted_right(number.significand, 1 - biased);
    biased = 1;
  }
  int spare = 63 - format.fraction_bits;
  uint64_t kept = number.significand >> spare, lost = number.significand & ((1ull << spare) - 1);
  kept += rounds_away(lost, 1ull << (spare - 1), kept & 1, number.sign, mode);
  /* The leading bit, and a carry of rounding, add 1 to the exponent. */
  uint64_t result = ((uint64_t)(biased - 1) << format.fraction_bits) + kept;
  if (result >> format.fraction_bits > (uint64_t)format.highest_exponent) {
    return sign | overflow(core, number.sign, format, mode);
  }
  if (lost) {
    raise_flag(core, FPSCR_IXC | (tiny ? FPSCR_UFC : 0));
  }
  return sign | (uint32_t)result;
}

static uint32_t rounded_single(Core *core, Number number) {
  return rounded(core, number, SINGLE, rounding_mode(core));
}

static uint32_t sum(Core *core, Number left, Number right) {
  if (!left.significand && !right.significand) {
    return zero(left.sign == right.sign ? left.sign : rounding_mode(core) == DOWNWARD);
  }
  if (!left.significand || !right.significand) {
    return rounded_single(core, left.significand ? left : right);
  }
  left = normalised(left);
  right = normalised(right);
  if (left.exponent < right.exponent) {
    Number larger = right;
    right = left;
    left = larger;
  }
  /* Keep two bits for carry and sign; the bits lost here are 0, because a product has 48 bits at most. */
  int64_t a = (int64_t)(left.significand >> 2);
  int64_t b = (int64_t)shifted_right(right.significand >> 2, left.exponent - right.exponent);
  int64_t total = left.sign == right.sign ? a + b : a - b;
  if (total == 0) {
    return zero(rounding_mode(core) == DOWNWARD);
  }
  uint64_t magnitude = (uint64_t)(total < 0 ? -total : total);
  return rounded_single(core, (Number){left.sign != (total < 0), left.exponent + 2, magnitude});
}

uint32_t exact_add(Core *core, uint32_t left, uint32_t right) {
  Number a = unpacked(core, left), b = unpacked(core, right);
  uint32_t result;
  if (process_nans(core, (uint32_t[]){left, right}, 2, &result)) {
    return result;
  }
  if (is_infinite(left)) {
    return right == negated(left) ? invalid(core) : left;
  }
  return is_infinite(right) ? right : sum(core, a, b);
}

static bool is_zero(uint32_t value, Number number) { return !is_infinite(value) && number.significand == 0; }

static Number product(Number left, Number right) {
  return (Number){
      .sign = left.sign != right.sign,
      .exponent = left.exponent + right.exponent,
      .significand = left.significand * right.significand,
  };
}

uint32_t exact_multiply(Core *core, uint32_t left, uint32_t right) {
  Number a = unpacked(core, left), b = unpacked(core, right);
  uint32_t result;
  if (process_nans(core, (uint32_t[]){left, right}, 2, &result)) {
    return result;
  }
  if (is_infinite(left) || is_infinite(right)) {
    return is_zero(left, a) || is_zero(right, b) ? invalid(core) : infinity(a.sign != b.sign);
  }
  return rounded_single(core, product(a, b));
}

uint32_t exact_multiply_add(Core *core, uint32_t addend, uint32_t left, uint32_t right) {
  Number c = unpacked(core, addend), a = unpacked(core, left), b = unpacked(core, right);
  bool numbers = !is_nan(left) && !is_nan(right);
  bool product_infinite = numbers && (is_infinite(left) || is_infinite(right));
  bool product_invalid = product_infinite && (is_zero(left, a) || is_zero(right, b));
  uint32_t result;
  if (process_nans(core, (uint32_t[]){addend, left, right}, 3, &result)) {
    return product_invalid && !is_signalling(addend) ? invalid(core) : result;
  }
  bool sign = a.sign != b.sign;
  if (product_invalid || (product_infinite && is_infinite(addend) && sign != c.sign)) {
    return invalid(core);
  }
  if (product_infinite || is_infinite(addend)) {
    return product_infinite ? infinity(sign) : addend;
  }
  return sum(core, c, product(a, b));
}

uint32_t exact_divide(Core *core, uint32_t left, uint32_t right) {
  Number a = unpacked(core, left), b = unpacked(core, right);
  uint32_t result;
  if (process_nans(core, (uint32_t[]){left, right}, 2, &result)) {
    return result;
  }
  bool sign = a.sign != b.sign;
  if ((is_infinite(left) && is_infinite(right)) || (is_zero(left, a) && is_zero(right, b))) {
    return invalid(core);
  }
  if (is_infinite(left) || is_zero(right, b)) {
    if (!is_infinite(left)) {
      raise_flag(core, FPSCR_DZC);
    }
    return infinity(sign);
  }
  if (is_infinite(right) || is_zero(left, a)) {
    return zero(sign);
  }
  a = normalised(a);
  uint64_t quotient = a.significand / b.significand | (a.significand % b.significand != 0);
  return rounded_single(core, (Number){sign, a.exponent - b.exponent, quotient});
}

uint32_t exact_square_root(Core *core, uint32_t value) {
  Number number = unpacked(core, value);
  if (is_nan(value)) {
    return quieted(core, value);
  }
  if (is_zero(value, number)) {
    return zero(number.sign);
  }
  if (number.sign) {
    return invalid(core);
  }
  if (is_infinite(value)) {
    return value;
  }
  number = normalised(number);
  if (number.exponent & 1) {
    number.significand >>= 1;
    number.exponent++;
  }
  uint64_t root = 0, rest = number.significand;
  for (uint64_t bit = 1ull << 62; bit; bit >>= 2) {
    bool fits = rest >= root + bit;
    rest -= fits ? root + bit : 0;
    root = root >> 1 | (fits ? bit : 0);
  }
  return rounded_single(core, (Number){false, number.exponent / 2 - 1, root << 1 | (rest != 0)});
}
