/* The vector table; SVC, PendSV, faults, threads on the process stack, frames with floating point (ARMv7-M ARM
 * B1.5).
 *
 * Values are added that a program can rely on: what the frame holds, what is pending and active, why a fault
 * happened. How long anything takes is no part of it.
 */
#include "kernel.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define ICSR REGISTER(0xE000ED04)
#define CCR REGISTER(0xE000ED14)
#define SHPR(n) REGISTER(0xE000ED14 + 4 * (n))
#define SHCSR REGISTER(0xE000ED24)
#define CFSR REGISTER(0xE000ED28)
#define HFSR REGISTER(0xE000ED2C)
#define BFAR REGISTER(0xE000ED38)
#define CPACR REGISTER(0xE000ED88)
#define NVIC_ISER0 REGISTER(0xE000E100)
#define NVIC_ICER0 REGISTER(0xE000E180)
#define NVIC_ISPR0 REGISTER(0xE000E200)
#define NVIC_ICPR0 REGISTER(0xE000E280)
#define NVIC_IPR0 REGISTER(0xE000E400)

#define PENDSVSET (1u << 28)
#define UNALIGN_TRP (1u << 3)
#define DIV_0_TRP (1u << 4)
#define FLAGS 0xF8000000u
#define IT_BITS 0x0600FC00u
#define ANY_FRAME (1u << 4) /* whether the compiler has used floating point before is its own affair */

extern uint32_t stack_top;
void reset(void);

typedef struct {
  uint32_t r0, r1, r2, r3, r12, lr, pc, xpsr;
} Frame;

static volatile uint32_t skipped; /* bytes of the instruction that a fault handler goes past */

static uint32_t exception_number(void) {
  uint32_t number;
  __asm volatile("mrs %0, ipsr" : "=r"(number));
  return number;
}

static uint32_t control(void) {
  uint32_t value;
  __asm volatile("mrs %0, control" : "=r"(value));
  return value;
}

/* Called with the frame and EXC_RETURN, whichever stack the frame is on. */
#define HANDLER(name)                                                                                     \
  void name##_body(Frame *frame, uint32_t exc_return);                                                    \
  __attribute__((naked)) static void name(void) {                                                         \
    __asm volatile("tst lr, #4\n\tite eq\n\tmrseq r0, msp\n\tmrsne r0, psp\n\tmov r1, lr\n\t"              \
                   "b " #name "_body");                                                                   \
  }                                                                                                       \
  __attribute__((used)) void name##_body(Frame *frame, uint32_t exc_return)

HANDLER(on_svc) {
  uint8_t number = *(const uint8_t *)(frame->pc - 2);
  add(number);
  add(exc_return | ANY_FRAME);
  add(exception_number());
  add(frame->xpsr & FLAGS);
  frame->r0 += frame->r1 * number;
  if (number == 9) {
    ICSR = PENDSVSET; /* not before this handler ends */
    add(ICSR & PENDSVSET);
  }
}

HANDLER(on_pend_sv) {
  (void)frame;
  float sum = (float)(exc_return & 0xFF) * 0.5f; /* the context's floating-point registers are saved first */
  add((uint32_t)(int32_t)sum);
  add(exception_number());
}

HANDLER(on_fault) {
  add(exception_number());
  add(CFSR);
  add(HFSR);
  add(CFSR & 1u << 15 ? BFAR : 0); /* BFARVALID */
  add(exc_return | ANY_FRAME);
  add(frame->xpsr & (FLAGS | IT_BITS));
  CFSR = CFSR;
  HFSR = HFSR;
  CPACR |= 0xFu << 20;
  frame->pc += skipped;
  frame->xpsr = (frame->xpsr & ~IT_BITS) | 1u << 24;
}

static uint32_t nested;

HANDLER(on_interrupt_0) {
  (void)frame;
  add(exc_return | ANY_FRAME);
  add(nested++);
  NVIC_ISPR0 = 1u << 1 | 1u << 2; /* the first is more urgent and comes now, the second less and comes later */
  __asm volatile("dsb\n\tisb");
  add(nested++);
}

HANDLER(on_interrupt_1) {
  (void)frame;
  add(exc_return | ANY_FRAME);
  add(100 + nested++);
}

HANDLER(on_interrupt_2) {
  (void)frame;
  add(exc_return | ANY_FRAME);
  add(200 + nested++);
}

static void unexpected(void) {
  for (;;) {
  }
}

__attribute__((section(".vectors"), used)) static void *const vectors[16 + 85] = {
    &stack_top, (void *)reset,    (void *)unexpected, (void *)on_fault, (void *)on_fault, (void *)on_fault,
    (void *)on_fault, 0, 0, 0, 0, (void *)on_svc, (void *)unexpected, 0, (void *)on_pend_sv, (void *)unexpected,
    (void *)on_interrupt_0, (void *)on_interrupt_1, (void *)on_interrupt_2,
};

#define SVC(number, a, b)                                                                                 \
  {                                                                                                       \
    register uint32_t r0 __asm("r0") = a;                                                                 \
    register uint32_t r1 __asm("r1") = b;                                                                 \
    __asm volatile("cmp r0, r1\n\tsvc #" #number : "+r"(r0) : "r"(r1) : "memory", "cc");                  \
    add(r0);                                                                                              \
  }

static void run_svc(void) {
  for (int n = 0; n < 50; n++) {
    uint32_t a = word(), b = word();
    SVC(0, a, b)
    SVC(7, a, b)
    SVC(255, b, a)
  }
}

/* PendSV and a handler of its own, between two halves of a computation with floats. */
static void run_float_context(void) {
  SHPR(3) |= 0xF0u << 16;
  for (int n = 0; n < 50; n++) {
    uint32_t a = any(), b = any(), fpscr;
    __asm volatile("vmsr fpscr, %2\n\tvmov s0, %0\n\tvmov s17, %1\n\tvcmp.f32 s0, #0.0"
                   :
                   : "r"(a), "r"(b), "r"(0)
                   : "s0", "s17");
    SVC(9, a, b)
    __asm volatile("dsb\n\tisb\n\tvmov %0, s0\n\tvmov %1, s17\n\tvmrs %2, fpscr\n\tvmsr fpscr, %3"
                   : "=r"(a), "=r"(b), "=r"(fpscr)
                   : "r"(0)
                   : "s0", "s17");
    add(a);
    add(b);
    add(fpscr);
    add(control());
  }
}

/* Each instruction that cannot be executed is gone past. BKPT is not among them: QEMU sets HFSR.FORCED where
 * the architecture has DEBUGEVT (B3.2.16).
 */
#define FAULTS(size, text, ...)                                                                           \
  {                                                                                                       \
    uint32_t a = 3, b = 0, odd = 0x20000002;                                                              \
    skipped = size;                                                                                       \
    __asm volatile("msr apsr_nzcvq, %0\n\t" text "\n\tadd %0, #1" : "+l"(a), "+l"(b), "+l"(odd) : : "memory", "cc", "r4", "r5");   \
    add(a);                                                                                               \
    add(b);                                                                                               \
  }

static void try_faults(void) {
  FAULTS(2, "udf #3")
  FAULTS(4, "udf.w #1000")
  FAULTS(4, "mov %1, #5\n\tcmp %1, #5\n\titt eq\n\tmoveq %1, #6\n\tudfeq.w #7")
  FAULTS(4, "udiv %0, %0, %1")
  FAULTS(4, "sdiv %0, %0, %1")
  FAULTS(2, "ldr %1, [%2]")
  FAULTS(2, "strh %1, [%2, #1]")
  FAULTS(4, "ldrex %1, [%2]")
  FAULTS(2, "mov %2, #0x60000000\n\tldr %1, [%2]")
  FAULTS(2, "mov %2, #0x60000000\n\tstrb %1, [%2]")
  FAULTS(4, "mcr p5, 0, %1, c0, c0, 0")
}

static void run_faults(void) {
  uint32_t before = CCR;
  SHCSR |= 7u << 16; /* each kind has its own handler */
  CCR = before | DIV_0_TRP;
  try_faults();
  SHCSR &= ~(7u << 16); /* all of them become a HardFault */
  CCR = before;
  try_faults();
}

/* Several words and exclusive ones have to be aligned whatever CCR says (A3.2.1); all others if it says so. */
static void run_alignment(void) {
  uint32_t before = CCR;
  SHCSR |= 7u << 16;
  for (int trapped = 0; trapped < 2; trapped++) {
    FAULTS(4, "ldmia.w %2, {r4, r5}")
    FAULTS(4, "stmia.w %2!, {r4, r5}")
    FAULTS(4, "ldmdb.w %2!, {r4, r5}")
    FAULTS(4, "stmdb.w %2, {r4, r5}")
    FAULTS(4, "ldrd r4, r5, [%2]")
    FAULTS(4, "strd r4, r5, [%2, #4]!")
    FAULTS(4, "vldr s0, [%2]")
    FAULTS(4, "vstr s0, [%2, #8]")
    FAULTS(4, "vldmia %2, {s0, s1}")
    FAULTS(4, "ldrexh %1, [%2]\n\tadd %2, #1\n\tldrexh %1, [%2]")
    FAULTS(2, "ldrh %1, [%2]\n\tadd %2, #1\n\tldrh %1, [%2]")
    FAULTS(2, "add %2, #2\n\tldr %1, [%2]\n\tadd %2, #2\n\tldr %1, [%2]")
    FAULTS(4, "ldrsh.w %1, [%2, #5]")
    FAULTS(4, "ldr.w %1, [%2], #3")
    CCR = before | UNALIGN_TRP;
  }
  CCR = before;
  SHCSR &= ~(7u << 16);
}

/* An interrupt that PRIMASK holds back ends a sleep all the same (B1.5.19); an event that is there ends WFE. */
static void run_sleep(void) {
  NVIC_ISER0 = 1;
  for (int n = 0; n < 10; n++) {
    __asm volatile("cpsid i");
    NVIC_ISPR0 = 1;
    __asm volatile("dsb\n\twfi\n\tsev\n\twfe\n\tyield" ::: "memory");
    add(ICSR >> 12 & 0x3FF);
    NVIC_ICPR0 = 1;
    __asm volatile("dsb\n\tcpsie i\n\tisb" ::: "memory");
    add(ICSR >> 12 & 0x3FF);
  }
  NVIC_ICER0 = 1;
}

static void run_no_coprocessor(void) {
  uint32_t a = any(), b = any();
  CPACR &= ~(0xFu << 20);
  __asm volatile("dsb\n\tisb");
  skipped = 0; /* the handler allows it, and it is executed again */
  __asm volatile("msr apsr_nzcvq, %1\n\tvmov s3, %1\n\tvmov %0, s3" : "=r"(b) : "r"(a) : "s3");
  add(b == a);
}

static void run_nesting(void) {
  NVIC_IPR0 = 0xC0u << 16 | 0x40u << 8 | 0x80u;
  NVIC_ISER0 = 7;
  nested = 0;
  for (int n = 0; n < 10; n++) {
    NVIC_ISPR0 = 1;
    __asm volatile("dsb\n\tisb");
    add(ICSR & 0x1FF);
    __asm volatile("cpsid i");
    NVIC_ISPR0 = 2;
    __asm volatile("dsb\n\tisb");
    add(1000 + nested);
    add(ICSR >> 12 & 0x3FF);
    __asm volatile("cpsie i\n\tisb");
    add(nested);
    __asm volatile("msr basepri, %0" : : "r"(0x80));
    NVIC_ISPR0 = 4;
    __asm volatile("dsb\n\tisb");
    add(2000 + nested);
    __asm volatile("msr basepri, %0\n\tisb" : : "r"(0));
    add(nested);
  }
  NVIC_ICER0 = 7;
}

/* A thread of its own on the process stack, without privilege, which comes back by SVC. */
static void run_thread(void) {
  static uint64_t stack[64];
  uint32_t a = any(), b = any(), before = control(), result;
  for (int n = 0; n < 10; n++) {
    __asm volatile("msr psp, %3\n\tmov r4, #2\n\tmsr control, r4\n\tisb\n\tmov r0, %1\n\tmov r1, %2\n\tpush {r0, r1}\n\t"
                   "cmp r0, r1\n\t"
                   "svc #4\n\tpop {r1, r2}\n\teor %0, r0, r1\n\tmrs r4, psp\n\tadd %0, r4\n\tmrs r4, control\n\t"
                   "and r4, #3\n\tadd %0, r4\n\tmov r4, #0\n\tmsr control, r4\n\tisb"
                   : "=&r"(result)
                   : "r"(a), "r"(b), "r"(stack + 62 - n % 2)
                   : "r0", "r1", "r2", "r4", "memory", "cc");
    add(result - (uint32_t)stack);
  }
  add(before & 3);
}

const Kernel exception_kernels[] = {
    {"svc", run_svc},         {"float-context", run_float_context}, {"faults", run_faults},
    {"alignment", run_alignment}, {"sleep", run_sleep},
    {"no-coprocessor", run_no_coprocessor}, {"nesting", run_nesting}, {"thread", run_thread}, {NULL, NULL},
};
