/* Work: the cost of a run, which depends on the firmware only, not on the machine.
 *
 * One unit is the time that the host needs for one instruction of the firmware: 2 to 3 ns on a computer
 * of 2020. Skipped loops cost nothing. The weights below are added for slow operations (measured by
 * tests/campaigns/heavy_bench.py); library.py adds the weight of calls of Python.
 *
 * Decision: only slow operations are counted. Instructions need no further counter, because each run counts
 * them already. If a limit on processor time were used instead, verdicts would depend on the machine.
 */
#ifndef FCU_WORK_H
#define FCU_WORK_H

#include <stdint.h>

#include "generated/memory_map.h"

enum {
  WORK_RUN = 20,          /* run between events */
  WORK_ACCESS = 8,        /* register access */
  WORK_EVENT = 60,        /* event of a peripheral */
  WORK_EXCEPTION = 30,    /* exception entry and return */
  WORK_DECODE = 15,       /* decoding an instruction, and discarding it */
  WORK_TIMER = 8,         /* write to a timer */
  WORK_PIN = 8,           /* configuration of a pin */
  WORK_EDGE = 10,         /* edge of an output */
  WORK_EDGE_TRACED = 500, /* recorded edge, converted when the trace is read */
  WORK_RESET = 20000,
};

/* one page per kilobyte of peripherals (0 to 511), one for OTG, one for the core's private peripherals */
enum { PAGES = 514, PAGE_OTG = 512, PAGE_PRIVATE = 513 };

static inline int page_of(uint32_t address) {
  uint32_t offset = address - PERIPHERALS_BASE;
  if (offset < (uint32_t)PAGE_OTG << 10) {
    return (int)(offset >> 10);
  }
  return address < PRIVATE_BASE ? PAGE_OTG : PAGE_PRIVATE;
}

/* times: number of occurrences; work: their total work, including work that they cause. */
typedef struct {
  int64_t times, work;
} Cost;

/* Kinds of cost. Accesses are counted by page, events by peripheral, exceptions by exception number. */
enum CostKind { COST_INSTRUCTIONS, COST_ACCESSES, COST_EVENTS, COST_PYTHON_EVENTS, COST_EXCEPTIONS, COST_RESETS };

#define COST_PERIPHERALS 48
#define COST_EXCEPTIONS_MOST 101

typedef struct {
  Cost instructions, accesses[PAGES], events[COST_PERIPHERALS], python_events, exceptions[COST_EXCEPTIONS_MOST], resets;
} Costs;

#endif
