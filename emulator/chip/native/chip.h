/* The chip: all of its blocks in one struct, and the wiring between them.
 *
 * What Python keeps: rare blocks (RCC, PWR, FLASH, ADC, RTC, CRC, watchdogs, DBGMCU), everything outside of the
 * chip, and its own clock with its own events. C calls it through struct Host.
 */
#ifndef FCU_CHIP_H
#define FCU_CHIP_H

#include "block.h"
#include "bus.h"
#include "core.h"
#include "dma.h"
#include "dwt.h"
#include "exceptions.h"
#include "exti.h"
#include "gpio.h"
#include "i2c.h"
#include "machine.h"
#include "nvic.h"
#include "scb.h"
#include "spi.h"
#include "systick.h"
#include "target.h"
#include "tim.h"
#include "timeline.h"
#include "usart.h"
#include "work.h"

#define EVENTS 64
#define BLOCKS COST_BLOCKS
#define INTERRUPTS 85 /* RM0368 table 38 */
#define PERIPHERALS 0x40000000u
#define PERIPHERALS_SIZE 0x80000u
#define SYSTEM_CONTROL_SPACE 0xE000E000u
#define DATA_WATCHPOINT 0xE0001000u

/* What firmware did to a register that cannot take it. */
enum Touched { READ_UNCLOCKED, WRITE_UNCLOCKED, READ_UNKNOWN, WRITE_UNKNOWN };

/* Callbacks into Python; nothing may be raised into C. Python sets chip->host_next_ps before it returns. */
typedef struct {
  void (*advance)(int64_t now_ps); /* its clock has something due by now */
  uint32_t (*read)(int64_t now_ps, uint32_t address, uint32_t size);
  void (*write)(int64_t now_ps, uint32_t address, uint32_t size, uint32_t value);
  void (*note)(int64_t now_ps, int32_t block, int32_t kind, const char *text);
  void (*touched)(int64_t now_ps, int32_t block, uint32_t offset, int32_t what);
  /* A fault; registers and stack are still those of the instruction. */
  void (*fault)(int64_t now_ps, int32_t exception, uint32_t status, uint32_t hard, uint32_t address);
  void (*locked_up)(int64_t now_ps, uint32_t pc);
  /* The chip is being reset: put all blocks, those in C too, into their state after reset, RCC last. */
  void (*reset)(int64_t now_ps, int32_t reason);
  void (*accessed)(int64_t now_ps, uint32_t address, uint32_t size, int32_t written); /* what is watched */
} Host;

/* Frequencies in Hz as the firmware has set RCC up; Python tells them (RM0368 section 6.2). */
typedef struct {
  int64_t sysclk_hz, hclk_hz, pclk1_hz, pclk2_hz, timer1_hz, timer2_hz;
} Clocks;

struct Chip {
  /* What Python sees, in this order (library.py). */
  int64_t now_ps;       /* of the access or event that is being carried out */
  int64_t host_next_ps; /* the earliest event of Python's clock */
  int64_t until_ps;     /* what a read of a register in Python, or by it, is valid until */
  int64_t must_stop;    /* a callback has failed, or wants the run to end after this instruction */
  int64_t detailed;     /* the trace records everything: each bus transfer, each edge of a chip select */
  int64_t work;         /* that was done since power-on, in units of work.h */
  int64_t work_limit;   /* beyond it the run ends */
  int64_t observed;     /* events of the trace are wanted at once, and not when it is read */

  int32_t bare;         /* every register is Python's: fcu_execute() */
  Host host;
  Clocks clocks;

  /* The processor. */
  Timeline timeline;
  Machine machine;
  Nvic nvic;
  Exceptions exceptions;
  Scb scb;
  SysTick systick;
  Dwt dwt;
  Waiting waiting;
  Idle idle;

  Block *blocks[BLOCKS];
  int32_t block_count;
  Block *pages[PERIPHERALS_SIZE >> 10]; /* the block at each kilobyte; NULL: Python's */
  Remembered remembered;
  Costs costs;

  /* Events. next_ps: the earliest scheduled one; due_ps: the earliest of all. */
  int64_t next_ps, due_ps;
  int64_t event_ps[EVENTS];
  uint64_t event_order[EVENTS], order, deferred; /* deferred: bit = event */
  Fire event_fire[EVENTS];
  Block *event_block[EVENTS];
  int32_t event_count;

  uint64_t irq_sources[INTERRUPTS]; /* which blocks hold it active: bit = index; bit 63 is Python's */
  void (*irq_changed)(int64_t now_ps, int32_t number, int32_t level); /* NULL: nobody watches */
  int8_t alternate[PORTS][16];      /* the alternate function each pin is switched to; -1: none */

  Dma dma;
  Gpio gpio;
  Syscfg syscfg;
  Exti exti;
  Timers timers;
  Usarts usarts;
  I2c i2c[I2C_BLOCKS];
  Targets targets;
  Spi spi[SPIS];

  Core core;
  uint8_t ram[RAM_SIZE], flash[FLASH_SIZE], system_memory[SYSTEM_SIZE];
};

/* Carry out everything due up to to_ps in order of time, Python's events included; then it is to_ps. At the same
 * picosecond the chip's events come before Python's, and the chip's among themselves as they were planned. */
void chip_advance(Chip *chip, int64_t to_ps);
/* The same up to now. */
void chip_settle(Chip *chip);
/* The index of a port's letter. */
int port_index(char port);
/* The block at an address; NULL if it is Python's or there is none. */
static inline Block *chip_block_at(const Chip *chip, uint32_t address) {
  uint32_t offset = address - PERIPHERALS;
  if (UNLIKELY(chip->bare)) {
    return NULL;
  }
  if (LIKELY(offset < PERIPHERALS_SIZE)) {
    return chip->pages[offset >> 10];
  }
  switch (address >> 12) {
  case SYSTEM_CONTROL_SPACE >> 12: return (Block *)&chip->scb.block;
  case DATA_WATCHPOINT >> 12: return (Block *)&chip->dwt.block;
  default: return NULL;
  }
}

/* The block holds NVIC input `number` (RM0368 table 38) active or not; shared inputs are ORed. block_change_irq() is
 * for another level than before; most calls have the same one. */
void block_change_irq(Block *block, int number, bool level);
static inline void block_set_irq(Block *block, int number, bool level) {
  if ((block->chip->irq_sources[number] >> block->index & 1) != level) {
    block_change_irq(block, number, level);
  }
}

/* An access to a register at chip->now_ps by whoever it is; the block is there. *until_ps as in BlockType. */
uint32_t block_read(Block *block, uint32_t offset, unsigned size, int64_t *until_ps);
void block_write(Block *block, uint32_t offset, unsigned size, uint32_t value);

#endif
