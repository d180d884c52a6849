/* Integers of 64 bits, division by what the compiler knows and does not know, and tricks with bits. */
#include "kernel.h"

#define RUNS 1500

static uint64_t wide(void) {
  uint32_t shift = any() & 63;
  return any() & 1 ? any64() >> shift : (uint64_t)word() << 32 | word();
}

static void run_wide(void) {
  for (int n = 0; n < RUNS; n++) {
    uint64_t a = wide(), b = wide();
    add64(a + b);
    add64(a - b);
    add64(a * b);
    add64(a & ~b);
    add64(a ^ b << 3);
    add64(a << (b & 63));
    add64(a >> (b & 63));
    add64((uint64_t)((int64_t)a >> (b & 63)));
    add((uint32_t)(a < b) | (uint32_t)((int64_t)a < (int64_t)b) << 1 | (uint32_t)(a == b) << 2);
  }
}

static void run_wide_division(void) {
  for (int n = 0; n < RUNS; n++) {
    uint64_t a = wide(), b = wide() | 1;
    int64_t signed_a = (int64_t)(a >> 1) - (int64_t)(b >> 2), signed_b = (int64_t)b;
    add64(a / b);
    add64(a % b);
    add64((uint64_t)(signed_a / signed_b));
    add64((uint64_t)(signed_a % signed_b));
    add64(a / 1000000007u);
    add64(a % 10);
  }
}

static void run_division(void) {
  for (int n = 0; n < RUNS; n++) {
    uint32_t a = word(), b = word() | 1;
    int32_t signed_a = (int32_t)(a >> 1) - 12345, signed_b = (int32_t)b;
    add(a / b);
    add(a % b);
    add((uint32_t)(signed_a / signed_b));
    add((uint32_t)(signed_a % signed_b));
    add(a / 3);
    add(a / 7);
    add(a % 641);
    add((uint32_t)(signed_a / -5));
    add((uint32_t)(signed_a / 1000));
    add((uint32_t)(signed_a % 4096));
  }
}

static uint32_t ones_counted(uint32_t value) {
  uint32_t count = 0;
  for (; value; value &= value - 1) {
    count++;
  }
  return count;
}

static uint32_t root(uint32_t value) {
  uint32_t result = 0;
  for (uint32_t bit = 1u << 30; bit; bit >>= 2) {
    if (value >= result + bit) {
      value -= result + bit;
      result = result / 2 + bit;
    } else {
      result /= 2;
    }
  }
  return result;
}

static void run_bits(void) {
  for (int n = 0; n < RUNS; n++) {
    uint32_t a = word(), by = any() & 31, low = a & -a, carried = a + low;
    add((uint32_t)__builtin_popcount(a));
    add(ones_counted(a));
    add((uint32_t)__builtin_parity(a));
    add(a ? (uint32_t)__builtin_clz(a) : 99);
    add(a ? (uint32_t)__builtin_ctz(a) : 99);
    add(__builtin_bswap32(a));
    add((uint32_t)__builtin_bswap16((uint16_t)a));
    add(a << by | a >> (-by & 31));
    add(a ^ a >> 1);
    add(root(a));
    add(low ? ((carried ^ a) >> 2) / low | carried : 0); /* the next number with as many ones */
    add((a & 0x55555555) << 1 | (a >> 1 & 0x55555555));
  }
}

static void run_overflow(void) {
  for (int n = 0; n < RUNS; n++) {
    int32_t a = (int32_t)word(), b = (int32_t)word(), result;
    uint32_t sum;
    add((uint32_t)__builtin_add_overflow(a, b, &result));
    add((uint32_t)result);
    add((uint32_t)__builtin_sub_overflow(a, b, &result));
    add((uint32_t)result);
    add((uint32_t)__builtin_mul_overflow(a, b, &result));
    add((uint32_t)result);
    add((uint32_t)__builtin_add_overflow((uint32_t)a, (uint32_t)b, &sum));
    add(sum);
  }
}

/* Constants in halves, addresses of code, rotation through the carry. */
static void run_moves(void) {
  for (int n = 0; n < 300; n++) {
    uint32_t value = word(), half = any(), rotated, code, flags;
    __asm volatile("movw %1, #0xBEEF\n\tmovt %1, #0xDEAD\n\tmovt %0, #0x1234\n\tlsrs %1, %1, #3\n\t"
                   "rrx %2, %0\n\trrxs %0, %2\n\tmrs %3, apsr\n\tadr %4, 1f\n\tb 2f\n\t"
                   ".balign 4\n1:\t.word 0x600DF00D\n2:\tldr %4, [%4]"
                   : "+r"(value), "+r"(half), "=&r"(rotated), "=&r"(flags), "=&r"(code)
                   :
                   : "cc");
    add(value);
    add(half);
    add(rotated);
    add(flags & 0xF8000000u);
    add(code);
  }
}

const Kernel integer_kernels[] = {
    {"int64", run_wide}, {"int64-division", run_wide_division}, {"division", run_division},
    {"bit-tricks", run_bits}, {"overflow", run_overflow}, {"moves", run_moves}, {NULL, NULL},
};
