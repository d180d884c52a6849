/* NVIC: enabled, pending and active exceptions, and priorities (ARMv7-M ARM B1.5, B3.4).
 *
 * Exceptions are numbered as in the vector table: interrupt n is 16 + n. Lines are level sensitive (PM0214 4.3.9): a
 * rising line makes its interrupt pending. If the line is still active when the handler returns or software clears
 * the pending bit, the interrupt becomes pending again.
 */
#ifndef FCU_NVIC_H
#define FCU_NVIC_H

#include <stdbool.h>
#include <stdint.h>

#define EXCEPTIONS 101 /* 16 + 85 interrupts (RM0368 table 38) */
#define FIRST_INTERRUPT 16
#define THREAD_PRIORITY 256 /* outside of handlers; a smaller number is more urgent */

enum Exception {
  RESET = 1,
  NMI = 2,
  HARD_FAULT = 3,
  MEM_MANAGE = 4,
  BUS_FAULT = 5,
  USAGE_FAULT = 6,
  SV_CALL = 11,
  DEBUG_MONITOR = 12,
  PEND_SV = 14,
  SYS_TICK = 15,
};

typedef struct {
  uint64_t pending[2], enabled[2], active[2], lines[2]; /* bit = exception number */
  int32_t subpriority_bits;
  uint8_t changed;        /* an exception may have become ready */
  uint8_t event_register; /* for WFE (B1.5.18) */
  uint8_t sevonpend;      /* SCR.SEVONPEND (B3.2.7) */
  int16_t priority[EXCEPTIONS];
} Nvic;

/* Reset all state, including the levels of lines. If a line is set afterwards, it counts as a rising line. */
void nvic_reset(Nvic *nvic);
/* Return 0 if no exception is ready. */
int nvic_highest_pending(const Nvic *nvic);
/* Return the group part of a priority, without the subpriority. The group part decides on preemption
 * (B1.5.4). */
int nvic_group_priority(const Nvic *nvic, int priority);
/* ExecutionPriority() (B1.5.4). */
int nvic_execution_priority(const Nvic *nvic, bool primask, uint32_t basepri, bool faultmask);
void nvic_pend(Nvic *nvic, int number);
void nvic_unpend(Nvic *nvic, int number);
void nvic_set_line(Nvic *nvic, int number, bool level);
void nvic_activate(Nvic *nvic, int number);
void nvic_deactivate(Nvic *nvic, int number);

/* Handle the offsets of ICTR, ISER to IPR, and STIR in the system control space (B3.4.3). */
bool nvic_has_register(uint32_t offset);
uint32_t nvic_read(const Nvic *nvic, uint32_t offset);
void nvic_write(Nvic *nvic, uint32_t offset, uint32_t value, uint32_t mask);

static inline bool nvic_is_active(const Nvic *nvic, int number) {
  return nvic->active[number >> 6] >> (number & 63) & 1;
}
static inline bool nvic_is_pending(const Nvic *nvic, int number) {
  return nvic->pending[number >> 6] >> (number & 63) & 1;
}
static inline bool nvic_any_ready(const Nvic *nvic) {
  return (nvic->pending[0] & nvic->enabled[0]) | (nvic->pending[1] & nvic->enabled[1]);
}
static inline int nvic_active_count(const Nvic *nvic) {
  return __builtin_popcountll(nvic->active[0]) + __builtin_popcountll(nvic->active[1]);
}

#endif
