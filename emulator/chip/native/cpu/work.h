/* Work: the cost of a run, in a measure that depends only on the firmware and not on the machine.
 *
 * One unit is an executed instruction, some 2 to 3 ns on a computer of 2020; skipped waiting costs nothing. The
 * other weights are the additional times of other kinds of work, measured by tests/campaigns/heavy_bench.py: its
 * last column shows that none takes much longer than its units say. Calls of Python are added by library.py.
 *
 * Decision: only slow operations are counted. No counter runs per instruction, because a run knows how many it has
 * executed. A limit on processor time was rejected: it differs between machines, so that verdicts would differ, too.
 */
#ifndef FCU_WORK_H
#define FCU_WORK_H

#include <stdint.h>

#include "generated/memory_map.h"

enum {
  WORK_RUN = 20,       /* a run of instructions between events */
  WORK_ACCESS = 8,     /* an access to a register */
  WORK_EVENT = 60,     /* an event scheduled by a peripheral */
  WORK_EXCEPTION = 30, /* an exception entry and its return */
  WORK_DECODE = 15,    /* an instruction decoded, and later discarded */
  WORK_TIMER = 8,      /* a write to a register of a timer, which changes its next event */
  WORK_PIN = 8,        /* a pin configured by a write to a register */
  WORK_EDGE = 10,      /* an edge of an output */
  WORK_EDGE_TRACED = 500, /* an edge that Python builds when the trace is read: of many, only the latest */
  WORK_RESET = 20000,
};

enum { PAGES = 514, PAGE_OTG = 512, PAGE_PRIVATE = 513 }; /* kilobytes of the peripherals; OTG; the core's own */

/* The page of a register's address. */
static inline int page_of(uint32_t address) {
  uint32_t offset = address - PERIPHERALS_BASE;
  if (offset < (uint32_t)PAGE_OTG << 10) {
    return (int)(offset >> 10);
  }
  return address < PRIVATE_BASE ? PAGE_OTG : PAGE_PRIVATE;
}

/* The cost of one kind of work: its number of occurrences, and its work, including the work that it caused. */
typedef struct {
  int64_t times, work;
} Cost;

/* Kinds; with an index: page, peripheral in C, exception. */
enum CostKind { COST_INSTRUCTIONS, COST_ACCESSES, COST_EVENTS, COST_PYTHON_EVENTS, COST_EXCEPTIONS, COST_RESETS };

#define COST_PERIPHERALS 48
#define COST_EXCEPTIONS_MOST 101 /* EXCEPTIONS of nvic.h */

typedef struct {
  Cost instructions, accesses[PAGES], events[COST_PERIPHERALS], python_events, exceptions[COST_EXCEPTIONS_MOST], resets;
} Costs;

#endif
