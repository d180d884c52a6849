/* Which exceptions are enabled, pending and active: cpu/nvic.py; and what cpu/exceptions.py needs beside. */
#ifndef FCU_NVIC_H
#define FCU_NVIC_H

#include <stdbool.h>
#include <stdint.h>

#define EXCEPTIONS 101 /* 16 of the system, 85 interrupts (RM0368 table 38) */
#define LOWEST 256     /* the priority of code that handles nothing; smaller is more urgent */

/* All of 64 bits but the priorities; what native_nvic.py sees, in this order. */
typedef struct {
  uint64_t pending[2], enabled[2], active[2], lines[2];
  int64_t subpriority_bits;
  int64_t changed, event, event_on_pending;
  int64_t alone;         /* whether exceptions may be entered and left here */
  int64_t vtor, align, may_sleep, base_return; /* VTOR, CCR.STKALIGN, SCR.SLEEPONEXIT, CCR.NONBASETHRDENA */
  int64_t lowest, floating_area, thread_ps;    /* as in frames.py and exceptions.py */
  int16_t priority[EXCEPTIONS];
} Nvic;

/* The pending and enabled exception to be taken first; 0 if there is none. */
int nvic_most_urgent(const Nvic *nvic);
/* The part of a priority that decides on preemption (B1.5.4). */
int nvic_group(const Nvic *nvic, int priority);
/* How urgent the present code is (B1.5.4, ExecutionPriority). */
int nvic_level(const Nvic *nvic, bool primask, uint32_t basepri, bool faultmask);
/* Both by the exception's number. */
void nvic_pend(Nvic *nvic, int number);
void nvic_set_line(Nvic *nvic, int number, bool level);
void nvic_activate(Nvic *nvic, int number);
void nvic_deactivate(Nvic *nvic, int number);

static inline bool nvic_is_active(const Nvic *nvic, int number) {
  return nvic->active[number >> 6] >> (number & 63) & 1;
}
static inline bool nvic_any_ready(const Nvic *nvic) {
  return (nvic->pending[0] & nvic->enabled[0]) | (nvic->pending[1] & nvic->enabled[1]);
}
static inline bool nvic_outermost(const Nvic *nvic) {
  return __builtin_popcountll(nvic->active[0]) + __builtin_popcountll(nvic->active[1]) == 1;
}

#endif
