/* Double precision, which this core has no instructions for: the compiler's library computes it with integers.
 * And functions of the C library in both precisions.
 */
#include <math.h>

#include "floating.h"

#define RUNS 600

static double real(void) {
  static const uint64_t special[] = {
      0,
      1,
      0x000FFFFFFFFFFFFF,
      0x0010000000000000,
      0x3FF0000000000000,
      0x3FEFFFFFFFFFFFFF,
      0x41DFFFFFFFC00000,
      0x41E0000000000000,
      0x43DFFFFFFFFFFFFF,
      0x43E0000000000000,
      0x43F0000000000000,
      0x7FEFFFFFFFFFFFFF,
      0x7FF0000000000000,
      0x7FF8000000000000,
      0x47EFFFFFF0000000,
      0x36A0000000000000,
  };
  uint32_t choice = any();
  uint64_t bits = any64();
  switch (choice & 3) {
  case 0: bits = special[choice >> 8 & 15] | (bits & 1ull << 63); break;
  case 1: bits = (bits & 0x800FFFFFFFFFFFFFull) | (uint64_t)(1000 + (choice >> 8 & 63)) << 52; break;
  case 2: bits = (bits & 0x800FFF0000000000ull) | (uint64_t)(1015 + (choice >> 8 & 15)) << 52; break;
  default: break;
  }
  double value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

static void add_double(double value) {
  uint64_t bits;
  memcpy(&bits, &value, sizeof bits);
  add64(value != value ? 0x7FF8000000000000ull : bits);
}

static void run_arithmetic(void) {
  for (int n = 0; n < RUNS; n++) {
    double a = real(), b = real();
    add_double(a + b);
    add_double(a - b);
    add_double(a * b);
    add_double(a / b);
  }
}

static void run_comparisons(void) {
  for (int n = 0; n < RUNS; n++) {
    double a = real(), b = n % 3 ? real() : a;
    add((uint32_t)(a < b) | (uint32_t)(a <= b) << 1 | (uint32_t)(a == b) << 2 | (uint32_t)(a != b) << 3 |
        (uint32_t)(a > b) << 4 | (uint32_t)(a >= b) << 5 | (uint32_t)(isunordered(a, b) != 0) << 6);
  }
}

/* Only what the target can hold: all else is undefined in C. */
static void run_conversions(void) {
  for (int n = 0; n < RUNS; n++) {
    double value = real();
    uint64_t integer = any64() >> (any() & 63);
    add_double((double)(int32_t)integer);
    add_double((double)(uint32_t)integer);
    add_double((double)(int64_t)integer);
    add_double((double)integer);
    add_float((float)(int64_t)integer);
    add_float((float)integer);
    add_float((float)value);
    add_double((double)of_bits(single()));
    if (fabs(value) < 2147483647.0) {
      add((uint32_t)(int32_t)value);
    }
    if (fabs(value) < 9.2e18) {
      add64((uint64_t)(int64_t)value);
    }
    if (value >= 0 && value < 1.8e19) {
      add64((uint64_t)value);
    }
  }
}

static void run_functions(void) {
  for (int n = 0; n < 60; n++) {
    double x = (double)(int32_t)any() / 65536.0 / 1024.0, y = (double)(int32_t)any() / 65536.0;
    add_double(sqrt(fabs(y)));
    add_double(sin(x));
    add_double(cos(y));
    add_double(exp(x));
    add_double(log(fabs(y) + 1e-9));
    add_double(pow(fabs(x), 0.190284));
    add_double(atan2(y, x));
    add_double(fmod(y, x));
    add_double(floor(y));
    add_double(ldexp(x, (int)(any() & 63) - 32));
  }
}

static void run_float_functions(void) {
  for (int n = 0; n < 200; n++) {
    float x = (float)(int32_t)any() / 67108864.0f, y = (float)(int32_t)any() / 65536.0f;
    add_float(sqrtf(fabsf(y)));
    add_float(sinf(x));
    add_float(cosf(y));
    add_float(tanf(x));
    add_float(expf(x));
    add_float(logf(fabsf(y)));
    add_float(powf(fabsf(x), 0.190284f));
    add_float(atan2f(y, x));
    add_float(asinf(x / 64));
    add_float(fmodf(y, x));
    add_float(roundf(y));
    add((uint32_t)lrintf(x));
  }
}

const Kernel double_kernels[] = {
    {"double-arithmetic", run_arithmetic}, {"double-comparisons", run_comparisons},
    {"double-conversions", run_conversions}, {"double-functions", run_functions},
    {"float-functions", run_float_functions}, {NULL, NULL},
};
