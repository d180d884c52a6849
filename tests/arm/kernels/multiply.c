/* Multiplication and division, with Q where an instruction sets it (ARMv7-M ARM A5.3.16, A5.3.17). */
#include "kernel.h"

#define RUNS 300
#define Q 0x08000000u

#define INTO_ONE(name, instruction)                                                                       \
  static void run_##name(void) {                                                                          \
    for (int n = 0; n < RUNS; n++) {                                                                      \
      uint32_t a = word(), b = word(), c = word(), result, flags;                                         \
      __asm volatile("msr apsr_nzcvq, %5\n\t" instruction "\n\tmrs %1, apsr"                              \
                     : "=&r"(result), "=&r"(flags)                                                        \
                     : "r"(a), "r"(b), "r"(c), "r"(0)                                                     \
                     : "cc");                                                                             \
      add(result);                                                                                        \
      add(flags & Q);                                                                                     \
    }                                                                                                     \
  }
#define OF_TWO(name) INTO_ONE(name, #name " %0, %2, %3")
#define OF_THREE(name) INTO_ONE(name, #name " %0, %2, %3, %4")

#define LONG(name)                                                                                        \
  static void run_##name(void) {                                                                          \
    for (int n = 0; n < RUNS; n++) {                                                                      \
      uint32_t a = word(), b = word(), low = word(), high = word();                                       \
      __asm volatile(#name " %0, %1, %2, %3" : "+r"(low), "+r"(high) : "r"(a), "r"(b));                   \
      add(low);                                                                                           \
      add(high);                                                                                          \
    }                                                                                                     \
  }

#define EACH_OF_TWO(DO)                                                                                   \
  DO(mul) DO(smulbb) DO(smulbt) DO(smultb) DO(smultt) DO(smulwb) DO(smulwt) DO(smuad) DO(smuadx)          \
  DO(smusd) DO(smusdx) DO(smmul) DO(smmulr) DO(sdiv) DO(udiv) DO(qadd) DO(qdadd) DO(qsub) DO(qdsub)
#define EACH_OF_THREE(DO)                                                                                 \
  DO(mla) DO(mls) DO(smlabb) DO(smlabt) DO(smlatb) DO(smlatt) DO(smlawb) DO(smlawt) DO(smlad) DO(smladx)  \
  DO(smlsd) DO(smlsdx) DO(smmla) DO(smmlar) DO(smmls) DO(smmlsr) DO(usada8)
#define EACH_LONG(DO)                                                                                     \
  DO(smull) DO(umull) DO(smlal) DO(umlal) DO(umaal) DO(smlalbb) DO(smlalbt) DO(smlaltb) DO(smlaltt)       \
  DO(smlald) DO(smlaldx) DO(smlsld) DO(smlsldx)
#define ENTRY(name) {#name, run_##name},

EACH_OF_TWO(OF_TWO)
EACH_OF_THREE(OF_THREE)
EACH_LONG(LONG)

const Kernel multiply_kernels[] = {
    EACH_OF_TWO(ENTRY) EACH_OF_THREE(ENTRY) EACH_LONG(ENTRY){NULL, NULL},
};
