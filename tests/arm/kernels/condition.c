/* Every condition with every combination of N, Z, C and V, in branches and in IT blocks of each shape; and C that
 * compilers turn into IT blocks (ARMv7-M ARM A7.3).
 */
#include "kernel.h"

/* What is done where a condition holds and where not, all flags being set before. */
#define BLOCK(condition, inverse)                                                                         \
  {                                                                                                       \
    uint32_t a = 1, b = 2, c = 3, d = 4;                                                                  \
    __asm volatile("msr apsr_nzcvq, %4\n\t"                                                               \
                   "ite " #condition "\n\tadd" #condition " %0, #16\n\tsub" #inverse " %0, #32\n\t"       \
                   "ittet " #condition "\n\tmul" #condition " %1, %1, %0\n\tadd" #condition " %2, %1\n\t" \
                   "eor" #inverse " %2, %0\n\tmvn" #condition " %3, %2\n\t"                               \
                   "it " #inverse "\n\trsb" #inverse " %3, %3, #5\n\t"                                    \
                   "itete " #inverse "\n\tlsl" #inverse " %0, %0, #3\n\tasr" #condition " %1, %1, #1\n\t" \
                   "uxtb" #inverse " %2, %2\n\tbfi" #condition " %2, %3, #4, #9\n\t"                      \
                   "b" #condition " 1f\n\tadd %3, #77\n1:\tb" #inverse ".w 2f\n\tadd %3, #777\n2:"         \
                   : "+l"(a), "+l"(b), "+l"(c), "+l"(d)                                                   \
                   : "r"(flags)                                                                           \
                   : "cc");                                                                               \
    add(a);                                                                                               \
    add(b);                                                                                               \
    add(c);                                                                                               \
    add(d);                                                                                               \
  }

static void run_blocks(void) {
  for (uint32_t nzcv = 0; nzcv < 16; nzcv++) {
    uint32_t flags = nzcv << 28;
    BLOCK(eq, ne)
    BLOCK(cs, cc)
    BLOCK(mi, pl)
    BLOCK(vs, vc)
    BLOCK(hi, ls)
    BLOCK(ge, lt)
    BLOCK(gt, le)
  }
}

/* Instructions of 16 bits leave the flags alone in a block, comparisons do not; they decide about the rest. */
static void run_flags_in_blocks(void) {
  for (int n = 0; n < 300; n++) {
    uint32_t a = word(), b = word(), c = any() & 3, flags;
    __asm volatile("cmp %0, %1\n\titttt hi\n\taddhi %0, %1\n\tlslhi %1, %2\n\tcmphi %1, #9\n\tmovhi %1, #200\n\t"
                   "itee vc\n\tcmpvc %0, %2\n\ttstvs %0, %1\n\tcmnvs %0, %2\n\tmrs %3, apsr"
                   : "+l"(a), "+l"(b), "+l"(c), "=l"(flags)
                   :
                   : "cc");
    add(a);
    add(b);
    add(flags & 0xF0000000u);
  }
}

/* Memory, floating point, a branch and a return at the end of a block. */
static void run_others_in_blocks(void) {
  static uint32_t words[8];
  for (int n = 0; n < 300; n++) {
    uint32_t *at = words + (any() & 3), a = any(), b = any(), number;
    __asm volatile("vmov s0, %1\n\tcmp %1, %2\n\tittte mi\n\tldrmi %1, [%0], #4\n\tstrmi %2, [%0]\n\t"
                   "vaddmi.f32 s0, s0, s0\n\tstrpl %1, [%0, #4]\n\titt cs\n\tpushcs {r4}\n\tpopcs {r4}\n\t"
                   "ite ne\n\tldrbne %2, [%0, #1]\n\tbeq 1f\n\tadd %2, #1\n1:\tvcmp.f32 s0, #0.0\n\t"
                   "vmrs apsr_nzcv, fpscr\n\tite gt\n\tvmovgt %3, s0\n\tmovle %3, #3"
                   : "+r"(at), "+r"(a), "+r"(b), "=&r"(number)
                   :
                   : "r4", "s0", "cc", "memory");
    add((uint32_t)(at - words));
    add(a);
    add(b);
    add((number & 0x7FFFFFFF) > 0x7F800000 ? 1 : number); /* every NaN is one */
    add_bytes(words, sizeof words);
  }
}

static int32_t clamped(int32_t value, int32_t low, int32_t high) {
  return value < low ? low : value > high ? high : value;
}

static int32_t middle(int32_t a, int32_t b, int32_t c) {
  return a < b ? (b < c ? b : a < c ? c : a) : (a < c ? a : b < c ? c : b);
}

static void run_choices(void) {
  int32_t best = 0, worst = 0;
  uint32_t counted = 0;
  for (int n = 0; n < 3000; n++) {
    int32_t a = (int32_t)word(), b = (int32_t)word(), c = (int32_t)any() >> 8;
    best = a > best ? a : best;
    worst = b < worst ? b : worst;
    counted += (a > 0) + (b >= 0 && a != b) * 2 + (a == b || c < 0) * 3;
    add((uint32_t)clamped(a, -1000, c < 0 ? -c : c));
    add((uint32_t)middle(a, b, c));
    add((uint32_t)(a > 0 ? 1 : a < 0 ? -1 : 0));
    add(a < 0 ? 0u - (uint32_t)a : (uint32_t)a);
    add((uint32_t)(b ? c : a ? 3 : 5));
    add((uint32_t)a < (uint32_t)b ? (uint32_t)b - (uint32_t)a : (uint32_t)a - (uint32_t)b);
  }
  add((uint32_t)best);
  add((uint32_t)worst);
  add(counted);
}

const Kernel condition_kernels[] = {
    {"it-blocks", run_blocks}, {"flags-in-it", run_flags_in_blocks}, {"others-in-it", run_others_in_blocks},
    {"choices", run_choices}, {NULL, NULL},
};
