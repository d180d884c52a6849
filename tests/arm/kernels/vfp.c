/* Floating-point arithmetic in each rounding mode, with and without flush-to-zero and default NaN: results as
 * bits, and the cumulative flags in FPSCR (ARMv7-M ARM A2.5, A6.4).
 */
#include "floating.h"

#define RUNS 1200

static const uint32_t special[] = {
    0,          1,          0x007FFFFF, 0x00800000, 0x00800001, 0x00FFFFFF, /* zero, denormal, smallest normal */
    0x3F800000, 0x3F800001, 0x3F7FFFFF, 0x3F000000, 0x40200000, 0x3EFFFFFF, /* about 1, and halves */
    0x4EFFFFFF, 0x4F000000, 0x4F7FFFFF, 0x4F800000, 0x46FFFE00, 0x477FFF00, /* ends of integers */
    0x477FE000, 0x477FEFFF, 0x477FF000, 0x38800000, 0x387FC000, 0x33000001, /* ends of half precision */
    0x7F7FFFFF, 0x7F800000, 0x7FC00000, 0x7FC12345, 0x7F800001, 0x7FA00000, /* largest, infinite, NaNs */
};

uint32_t single(void) {
  uint32_t choice = any(), sign = choice & 0x80000000u;
  switch (choice >> 28 & 7) {
  case 0:
  case 1: return special[choice % LENGTH(special)] | sign;
  case 2: return ((special[choice % LENGTH(special)] + (choice >> 24 & 7) - 3) & 0x7FFFFFFF) | sign;
  case 3: return any() >> (choice & 31);
  case 4: return sign | (124 + (choice & 31)) << 23 | (any() & 0x780000);
  case 5: return sign | (124 + (choice & 7)) << 23 | (any() & 0x7FFFFF);
  default: return any();
  }
}

uint32_t mode(unsigned n) { return (n & 15) << 22; }

/* One result from d, n and m; FPSCR is set before and added after. */
#define ARITHMETIC(name, text)                                                                            \
  static void run_##name(void) {                                                                          \
    for (unsigned n = 0; n < RUNS; n++) {                                                                 \
      uint32_t d = single(), a = single(), b = single(), fpscr = mode(n);                                 \
      __asm volatile("vmsr fpscr, %1\n\tvmov s0, %0\n\tvmov s1, %2\n\tvmov s2, %3\n\t" text               \
                     "\n\tvmov %0, s0\n\tvmrs %1, fpscr"                                                  \
                     : "+r"(d), "+r"(fpscr)                                                               \
                     : "r"(a), "r"(b)                                                                     \
                     : "s0", "s1", "s2");                                                                 \
      add(d);                                                                                             \
      add(fpscr);                                                                                         \
    }                                                                                                     \
    plain();                                                                                              \
  }
#define OF_THREE(name) ARITHMETIC(name, #name ".f32 s0, s1, s2")
#define OF_TWO(name) ARITHMETIC(name, #name ".f32 s0, s1")

#define EACH_OF_THREE(DO)                                                                                 \
  DO(vadd) DO(vsub) DO(vmul) DO(vnmul) DO(vdiv) DO(vmla) DO(vmls) DO(vnmla) DO(vnmls) DO(vfma) DO(vfms)   \
  DO(vfnma) DO(vfnms)
#define EACH_OF_TWO(DO) DO(vsqrt) DO(vabs) DO(vneg) DO(vcmp) DO(vcmpe)
#define ENTRY(name) {#name, run_##name},

EACH_OF_THREE(OF_THREE)
OF_TWO(vsqrt)
OF_TWO(vabs)
OF_TWO(vneg)
OF_TWO(vcmp)
OF_TWO(vcmpe)
ARITHMETIC(vcmp_zero, "vcmp.f32 s1, #0.0")
ARITHMETIC(vcmpe_zero, "vcmpe.f32 s1, #0.0")

/* Flags once set remain, and what APSR takes of a comparison. */
static void run_cumulative(void) {
  uint32_t total = 0;
  __asm volatile("vmsr fpscr, %0" : : "r"(0));
  for (unsigned n = 0; n < RUNS; n++) {
    uint32_t a = single(), b = single(), flags;
    __asm volatile("vmov s1, %2\n\tvmov s2, %3\n\tvdiv.f32 s0, s1, s2\n\tvcmp.f32 s1, s2\n\t"
                   "vmrs apsr_nzcv, fpscr\n\tmrs %1, apsr\n\tvmrs %0, fpscr"
                   : "=r"(total), "=&r"(flags)
                   : "r"(a), "r"(b)
                   : "s0", "s1", "s2", "cc");
    add(flags & 0xF0000000u);
    add(total);
    if (n % 16 == 15) {
      __asm volatile("vmsr fpscr, %0" : : "r"(0));
    }
  }
  plain();
}

/* What the compiler makes of C: no NaN's payload reaches the checksum. */
static void run_expressions(void) {
  for (unsigned n = 0; n < RUNS; n++) {
    float a = of_bits(single()), b = of_bits(single()), c = of_bits(single());
    add_float(a * b + c);
    add_float((a - b) / c);
    add_float(a < b ? a : b);
    add((uint32_t)(a < b) | (uint32_t)(a <= b) << 1 | (uint32_t)(a == b) << 2 | (uint32_t)(a != b) << 3 |
        (uint32_t)(a > b) << 4 | (uint32_t)(a >= b) << 5);
  }
}

/* A filter, a sum that cancels, and a matrix: what firmware does with floats. */
static void run_numeric(void) {
  float matrix[4][4], filtered = 0, sum = 0, lost = 0;
  for (int n = 0; n < 4096; n++) {
    float sample = (float)(int16_t)any() * 0.061f;
    filtered += 0.05f * (sample - filtered);
    float corrected = sample - lost, next = sum + corrected;
    lost = (next - sum) - corrected;
    sum = next;
    matrix[n / 4 % 4][n % 4] = sample;
    if (n % 64 == 63) {
      for (int row = 1; row < 4; row++) {
        for (int column = 0; column < 4; column++) {
          matrix[row][column] -= matrix[0][column] * (matrix[row][0] / (matrix[0][0] + 1000.5f));
          add_float(matrix[row][column]);
        }
      }
      add_float(filtered);
      add_float(sum);
    }
  }
}

const Kernel vfp_kernels[] = {
    EACH_OF_THREE(ENTRY) EACH_OF_TWO(ENTRY){"vcmp-zero", run_vcmp_zero},
    {"vcmpe-zero", run_vcmpe_zero},
    {"cumulative", run_cumulative},
    {"expressions", run_expressions},
    {"numeric", run_numeric},
    {NULL, NULL},
};
