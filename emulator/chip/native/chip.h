/* The chip: all peripherals in one struct, and the connections between them.
 *
 * Python models the rarely used peripherals (RCC, PWR, FLASH, RTC, watchdogs, DBGMCU) and the devices
 * outside the chip, and has a clock with its own events. C calls Python through struct Host.
 */
#ifndef FCU_CHIP_H
#define FCU_CHIP_H

#include "peripherals/peripheral.h"
#include "bus.h"
#include "cpu/core.h"
#include "cpu/exceptions.h"
#include "cpu/run_loop.h"
#include "peripherals/list.h"
#include "peripherals/nvic.h"
#include "peripherals/sensor_registers.h"
#include "cpu/cycle_clock.h"
#include "cpu/work.h"

#define EVENTS 64
#define MAX_PERIPHERALS COST_PERIPHERALS
#define INTERRUPTS 85 /* RM0368 table 38 */

enum IgnoredAccess { READ_UNCLOCKED, WRITE_UNCLOCKED, READ_UNKNOWN, WRITE_UNKNOWN };

/* Callbacks into Python. The callbacks set chip->host_next_ps and never raise an exception. */
typedef struct {
  void (*advance)(int64_t now_ps); /* an event of Python's clock is due */
  uint32_t (*read)(int64_t now_ps, uint32_t address, uint32_t size);
  void (*write)(int64_t now_ps, uint32_t address, uint32_t size, uint32_t value);
  void (*note)(int64_t now_ps, int32_t peripheral, int32_t kind, const char *text);
  /* Return 0 if the access was harmless and was not reported. A later access to this register may still
   * be reported. */
  int32_t (*ignored_access)(int64_t now_ps, int32_t peripheral, uint32_t offset, int32_t what, uint32_t value);
  /* The core registers still have their values at the faulting instruction. */
  void (*fault)(int64_t now_ps, int32_t exception, uint32_t cfsr, uint32_t hfsr, uint32_t address);
  void (*locked_up)(int64_t now_ps, uint32_t pc);
  /* Reset all peripherals, RCC after the others. */
  void (*reset)(int64_t now_ps, int32_t reason);
  void (*accessed)(int64_t now_ps, uint32_t address, uint32_t size, int32_t written);
  /* The core sleeps with SLEEPDEEP set. Return the wake-up time of Stop in ps, or a value of enum DeepSleep. */
  int64_t (*deep_sleep)(int64_t now_ps);
  void (*stop_ended)(int64_t now_ps); /* Switch the clocks on again. */
} Host;

/* Frequencies in Hz that RCC sets (RM0368 section 6.2). The nominal frequencies assume oscillators without
 * error. */
typedef struct {
  int64_t sysclk_hz, hclk_hz, pclk1_hz, pclk2_hz, timer1_hz, timer2_hz, nominal_pclk1_hz;
  int64_t lsi_hz, lse_hz; /* 0: not ready */
} Clocks;

struct Chip {
  /* Read by Python, in this order (library.py). */
  int64_t now_ps;       /* time of the current access or event */
  int64_t host_next_ps; /* earliest event of Python's clock */
  /* time until which a value is valid: the latest value that Python returned, or that was read from a
     peripheral in C */
  int64_t until_ps;
  int64_t must_stop;    /* end the run after this instruction, because of an error or request in a callback */
  int64_t detailed;     /* the trace records bus transfers and chip-select edges */
  int64_t work;         /* since power-on, in units of work.h */
  int64_t work_limit;
  int64_t observed; /* the trace needs events immediately; otherwise output edges are only recorded (gpio.c) */

  int32_t bare; /* no peripherals in C: Python handles all registers (fcu_execute()) */
  Host host;
  Clocks clocks;

  CycleClock cycle_clock;
  RunLoop run_loop;
  Nvic nvic;
  Exceptions exceptions;
  PollSkip poll_skip;
  IdleSkip idle_skip;

  Peripheral *peripherals[MAX_PERIPHERALS];
  int32_t peripheral_count;
  Peripheral *pages[PERIPHERALS_SIZE >> 10];
  PythonRegisters python_registers;
  Costs costs;

  /* next_ps: earliest event that is not deferred; due_ps: earliest event, deferred or not. */
  int64_t next_ps, due_ps;
  int64_t event_ps[EVENTS];
  uint64_t event_order[EVENTS], order;
  uint64_t scheduled, deferred; /* bit = event */
  Fire event_fire[EVENTS];
  Peripheral *event_peripheral[EVENTS];
  int32_t event_count;

  uint64_t irq_sources[INTERRUPTS]; /* bit n: line set by the peripheral with index n; bit 63: by Python */
  void (*irq_changed)(int64_t now_ps, int32_t number, int32_t level); /* NULL: not watched */
  int8_t alternate[PORTS][16]; /* function of each pin; -1: none */

#define MEMBER(type, member, create) type member;
  EACH_PERIPHERAL(MEMBER)
#undef MEMBER
  SensorRegisters sensor_registers;

  Core core;
  uint8_t ram[RAM_SIZE], flash[FLASH_SIZE], system_memory[SYSTEM_MEMORY_SIZE];
};

/* Execute all events up to to_ps. If events are simultaneous, the chip's events come before Python's; in
 * each group the event that was scheduled first comes first.
 */
void chip_advance(Chip *chip, int64_t to_ps);
void chip_settle(Chip *chip);
int port_index(char port);
static inline Peripheral *chip_peripheral_at(const Chip *chip, uint32_t address) {
  uint32_t offset = address - PERIPHERALS_BASE;
  if (UNLIKELY(chip->bare)) {
    return NULL;
  }
  if (LIKELY(offset < PERIPHERALS_SIZE)) {
    return chip->pages[offset >> 10];
  }
  switch (address >> 12) {
  case SCS_BASE >> 12: return (Peripheral *)&chip->scb.peripheral;
  case DWT_BASE >> 12: return (Peripheral *)&chip->dwt.peripheral;
  default: return NULL;
  }
}

/* Set NVIC input `number` (RM0368 table 38) for a peripheral; shared inputs are ORed. */
void peripheral_change_irq(Peripheral *peripheral, int number, bool level);
static inline void peripheral_set_irq(Peripheral *peripheral, int number, bool level) {
  if ((peripheral->chip->irq_sources[number] >> peripheral->index & 1) != level) {
    peripheral_change_irq(peripheral, number, level);
  }
}

/* Access a register at chip->now_ps; PeripheralType explains *until_ps. */
uint32_t peripheral_read(Peripheral *peripheral, uint32_t offset, unsigned size, int64_t *until_ps);
void peripheral_write(Peripheral *peripheral, uint32_t offset, unsigned size, uint32_t value);

#endif
