/* The chip as a library: what Python calls. All functions take the handle that fcu_create() gives.
 *
 * A section's functions are in the file that it names. What C calls often has a name of its own there, which is
 * hidden: a call of what is exported goes by a table.
 *
 * The library has no state of its own and calls nobody but the callbacks it is given; a handle is used by one
 * thread at a time. Times are picoseconds since power-on.
 */
#ifndef FCU_H
#define FCU_H

#include "chip.h"

/* These functions are what the library exports; all others are hidden (building/library.py). */
#pragma GCC visibility push(default)

/* -- the chip and its memories: chip.c ------------------------------------------------------------------ */

/* The chip before power-on: its flash is erased; NULL if there is no memory for it. */
Chip *fcu_create(const Host *host);
void fcu_destroy(Chip *chip);
/* Before power-on: cycles that an instruction takes, as a fraction; whether waiting loops are skipped. */
void fcu_configure(Chip *chip, int64_t cycles_num, int64_t cycles_den, int32_t skip);
/* FLASH_SIZE, RAM_SIZE and SYSTEM_MEMORY_SIZE bytes; whoever changes what may have been executed calls
 * fcu_forget_code(). */
uint8_t *fcu_flash(Chip *chip);
uint8_t *fcu_ram(Chip *chip);
uint8_t *fcu_system_memory(Chip *chip);

/* -- the processor's registers: state.c ------------------------------------------------------------------ */

/* By number: 0 to 15, then enum Register in state.c. Between runs. */
void fcu_read_registers(const Chip *chip, const int32_t *numbers, uint32_t *values, int32_t count);
void fcu_write_registers(Chip *chip, const int32_t *numbers, const uint32_t *values, int32_t count);
/* EPSR.T, which PC does not show. */
int32_t fcu_thumb(const Chip *chip);
void fcu_set_thumb(Chip *chip, int32_t thumb);

/* -- running: run_loop.c ----------------------------------------------------------------------------------- */

/* Power-on, and the state after reset (ARMv7-M ARM B1.5.5): registers, peripherals, SP and PC from the vector table.
 * RAM stays. */
void fcu_start(Chip *chip);
/* Run up to and including at_ps: enum Ended. */
int32_t fcu_run_until(Chip *chip, int64_t at_ps);
/* Execute so many instructions without time, exceptions and peripherals, every register being Python's: enum Stop.
 * past: also if there is a breakpoint on the first one. */
int32_t fcu_execute(Chip *chip, int64_t instructions, int32_t past);
/* In an access: end that after the instruction in flight. */
void fcu_cut(Chip *chip);
/* What fcu_execute() has executed, the one in flight or one that has met a fault included. Where an access was
 * refused. */
int64_t fcu_executed(const Chip *chip);
uint32_t fcu_fault_address(const Chip *chip);
/* Reset the chip after the instruction in flight; the halted chip at once. */
void fcu_request_reset(Chip *chip, int32_t reason);
void fcu_reset_now(Chip *chip, int32_t reason);
/* As if an exception had come: save the context and go to its handler at once, whatever the priorities, by the vector
 * table at an address; 0 if the stack or the table is no memory. For fcu_execute(). In exceptions.c. */
int32_t fcu_enter_exception(Chip *chip, int32_t number, uint32_t vectors);

/* -- debugging: run_loop.c --------------------------------------------------------------------------------- */

/* Stand still before the next instruction; an exception being entered is entered first. */
void fcu_halt(Chip *chip);
/* Go on; step: for one instruction, or into the exception that comes instead of it. */
void fcu_resume(Chip *chip, int32_t step);
/* Whether the core stands still: fcu_run_until() returns at once and no time passes. */
int32_t fcu_is_halted(const Chip *chip);
/* End WFI, WFE or sleep on exit. */
void fcu_wake(Chip *chip);
/* Whether BKPT halts the core; whether it has, since this was last asked. */
void fcu_debug(Chip *chip, int32_t on);
int32_t fcu_met_breakpoint_instruction(Chip *chip);

/* -- code: decode_cache.c --------------------------------------------------------------------------------------- */

/* Everything is decoded anew. */
void fcu_forget_code(Chip *chip);
/* Halt before the instruction at an address (STOP_BREAKPOINT), or no more. */
void fcu_set_breakpoint(Chip *chip, uint32_t address, int32_t on);

/* -- what it is doing: chip.c, nvic.c --------------------------------------------------------------------- */

typedef struct {
  int64_t now_ps;    /* the time when the next instruction begins */
  int64_t retired;   /* instructions since power-on */
  int64_t skipped;   /* of these, how many were counted instead of being executed */
  int64_t accesses;  /* to registers that were no mere memory */
  int64_t thread_ps; /* when Thread mode was last returned to */
  uint64_t pending[2], enabled[2], active[2]; /* exceptions: bit = number */
  int64_t level;     /* the execution priority (ARMv7-M ARM B1.5.4); 256: none */
  uint32_t lowest;   /* the lowest address that the main stack has had at an exception entry */
  uint32_t locked_up, locked_up_pc;
  uint32_t asleep;   /* enum Sleep */
} Status;
void fcu_status(const Chip *chip, Status *status);
/* What has cost most work since power-on. */
typedef struct {
  int64_t times;       /* how often it was */
  int32_t kind, index; /* enum CostKind of work.h */
} Costliest;
void fcu_costliest(const Chip *chip, Costliest *found);
/* An exception's priority; the part of a priority that decides on preemption. */
int32_t fcu_priority(const Chip *chip, int32_t exception);
int32_t fcu_priority_group(const Chip *chip, int32_t priority);

/* -- accesses by debuggers and DMA in Python: bus.c ------------------------------------------------------- */

/* host.accessed() is called at the core's loads and stores from begin to end, the last one included, or no more: all
 * of them are slower meanwhile. */
void fcu_watch_memory(Chip *chip, int32_t on, uint32_t begin, uint32_t end);
/* With all side effects, now; 0 where nothing answers. */
int32_t fcu_load(Chip *chip, uint32_t address, uint32_t size, uint32_t *value);
int32_t fcu_store(Chip *chip, uint32_t address, uint32_t size, uint32_t value);

/* -- snapshots: chip.c ------------------------------------------------------------------------------------ */

/* The whole chip as so many bytes, which mean something to the same chip only. Between runs. */
int64_t fcu_snapshot_size(void);
void fcu_save(const Chip *chip, void *snapshot);
void fcu_restore(Chip *chip, const void *snapshot);

/* -- time: chip.c ----------------------------------------------------------------------------------------- */

/* Let time pass until to_ps without executing instructions. */
void fcu_advance(Chip *chip, int64_t to_ps);
/* Carry out everything due by now. */
void fcu_settle(Chip *chip);
/* When the earliest event of the chip happens that ends a run. */
int64_t fcu_next_event(const Chip *chip);
void fcu_set_clocks(Chip *chip, const Clocks *clocks);

/* -- peripherals, by index: chip.c ---------------------------------------------------------------------------- */

int32_t fcu_peripheral_count(const Chip *chip);
uint32_t fcu_peripheral_base(const Chip *chip, int32_t index);
/* The index of the peripheral in C at an address; -1 if it is Python's or nobody's. */
int32_t fcu_peripheral_at(const Chip *chip, uint32_t address);
/* RCC switches the clock of the peripheral in Python at an address on or off. */
void fcu_gate_python(Chip *chip, uint32_t address, int32_t clocked);
/* RCC switches the clocks of some peripherals (bit = index) on or off; whether a peripheral has one; resets some
 * peripherals. */
void fcu_gate(Chip *chip, uint64_t peripherals, uint64_t clocked);
int32_t fcu_is_clocked(const Chip *chip, int32_t index);
void fcu_reset_peripherals(Chip *chip, uint64_t peripherals);
/* The word at an offset, clock or not: with side effects, chip->until_ps then says until when it is valid; and
 * without. */
uint32_t fcu_read_peripheral(Chip *chip, int32_t index, uint32_t offset);
uint32_t fcu_peek_peripheral(Chip *chip, int32_t index, uint32_t offset);
/* Whether a read there has no side effect, and its value does not run with time. */
int32_t fcu_is_pure(Chip *chip, int32_t index, uint32_t offset);
void fcu_write_peripheral(Chip *chip, int32_t index, uint32_t offset, uint32_t value, uint32_t mask);

/* -- lines: chip.c --------------------------------------------------------------------------------------- */

/* Python's peripherals hold NVIC input `number` active or not; whether any peripheral does. */
void fcu_set_irq(Chip *chip, int32_t number, int32_t level);
int32_t fcu_irq_level(const Chip *chip, int32_t number);
/* From now on changed(now_ps, number, level) is called when an NVIC input becomes active or not; NULL: no more. */
void fcu_watch_irqs(Chip *chip, void (*changed)(int64_t now_ps, int32_t number, int32_t level));
/* The pin is switched to an alternate function; -1: to none. */
void fcu_set_alternate(Chip *chip, int32_t port, int32_t pin, int32_t function);

/* -- pins: gpio.c, exti.c -------------------------------------------------------------------------------- */

/* Pins by the index of their port ("ABCDEH") and their number. */
void fcu_connect_pins(Chip *chip, const PinCalls *calls);
/* Edges of outputs that Python has not taken, while the trace is not observed; take them, at most the latest `size`,
 * the oldest first: how many, and how many more there were. */
int64_t fcu_edges_waiting(const Chip *chip);
int64_t fcu_take_edges(Chip *chip, Edge *edges, int64_t size, int64_t *lost);
/* From now on changed() is called after every change of what the pin reads. */
void fcu_watch_pin(Chip *chip, int32_t port, int32_t pin);
/* From now on edge() is called for this pin while chip->detailed is set only. */
void fcu_frequent_pin(Chip *chip, int32_t port, int32_t pin);
/* All parties outside of the chip together drive the pin to a level; -1: nobody drives it. */
void fcu_drive_pin(Chip *chip, int32_t port, int32_t pin, int32_t level);
/* The chip's side of a pin, -1 for none: its output stage, its pull resistor, its alternate function. */
int32_t fcu_pin_output(const Chip *chip, int32_t port, int32_t pin);
int32_t fcu_pin_pull(const Chip *chip, int32_t port, int32_t pin);
int32_t fcu_pin_alternate(const Chip *chip, int32_t port, int32_t pin);
/* An inner signal of EXTI, line 16 or up. */
void fcu_set_exti_line(Chip *chip, int32_t line, int32_t level);

/* -- timers, by index of their peripheral: tim.c -------------------------------------------------------------- */

/* A timer's handler came late, or after lost ticks; either may be NULL. */
void fcu_connect_timers(Chip *chip, const TimCalls *calls);
/* Its account of update interrupts; the same address as long as the chip lives. */
const TickCounts *fcu_timer_counts(const Chip *chip, int32_t index);
/* Update rate as configured; 0 while ARR is 0. */
double fcu_timer_rate(const Chip *chip, int32_t index);
/* When a flag of SR may next rise. */
int64_t fcu_timer_next_change(const Chip *chip, int32_t index);
/* What channel 1 to 4 puts out: 1; 0 while it puts out no PWM or the timer stands; -1 if the timer lacks it. */
int32_t fcu_timer_pwm(const Chip *chip, int32_t index, int32_t channel, double *frequency_hz, double *duty);

/* -- USARTs, by index of their peripheral: usart.c ------------------------------------------------------------- */

void fcu_connect_usarts(Chip *chip, const UsartCalls *calls);
/* A terminal at this rate is connected to the transmitter at this pin. */
void fcu_usart_wire(Chip *chip, int32_t index, int32_t port, int32_t pin, int32_t function, int32_t baud);
/* Call sent() with what it has not had yet. */
void fcu_usart_hand_over(Chip *chip, int32_t index);
/* The length of its frames, num / den ps; 0 while it has no bit clock. */
int32_t fcu_usart_frame(const Chip *chip, int32_t index, int64_t *num, int64_t *den);
/* When TXE or TC comes next. */
int64_t fcu_usart_next_change(Chip *chip, int32_t index);
/* A byte has arrived: 0 if it is lost, because the one before was not read. */
int32_t fcu_usart_receive(Chip *chip, int32_t index, int32_t value);
/* The line was idle for a frame's time after a byte. */
void fcu_usart_line_idle(Chip *chip, int32_t index);

/* -- DMA request lines (enum Request of peripheral.h): dma.c -------------------------------------------------- */

/* The caller's peripheral asks for a transfer: whether a stream serves the line, then it is done; transfers left. */
int32_t fcu_dma_request(Chip *chip, int32_t line);
uint32_t fcu_dma_remaining(const Chip *chip, int32_t line);

/* -- sensors' bytes in C: read_cache.c; I2C: i2c.c ----------------------------------------------------------- */

ReadCache *fcu_connect_targets(Chip *chip, const TargetCalls *calls);
/* Another part at a bus; version is the part's own counter, at an address that does not change. Its index, or -1
 * if there are too many: nothing is kept of it then. */
int32_t fcu_add_target(Chip *chip, const uint64_t *version);
/* The bus behind I2C<number + 1>. speed_hz is what it runs at, shortest_ps the shortest period it can do. */
void fcu_connect_i2c(Chip *chip, int32_t number, const I2cCalls *calls, int64_t speed_hz, int64_t shortest_ps);
/* Its pin number 0 or 1 is that pin of the chip as that alternate function; without pins it is connected. */
void fcu_i2c_pin(Chip *chip, int32_t number, int32_t which, int32_t port, int32_t pin, int32_t function);
I2cWire *fcu_i2c_wire(Chip *chip, int32_t number);

/* -- SPI: spi_line.c; spi: 0 for SPI1 -------------------------------------------------------------------- */

/* A bus begins at its pins; fcu_add_spi_part() adds parts to it: at most SPI_PARTS. target: as fcu_add_target()
 * gives it. */
void fcu_connect_spi(Chip *chip, int32_t spi, const SpiCalls *calls);
void fcu_add_spi_part(Chip *chip, int32_t spi, int32_t port, int32_t pin, int32_t target);
/* At its pins there is a module that is absent: tried() is called once, when firmware first sends it a byte. */
void fcu_absent_spi(Chip *chip, int32_t spi, int32_t port, int32_t pin, void (*tried)(int64_t now_ps));
/* Messages that C has answered, and bytes that nobody has heard, the oldest first, at most SPI_RECENT; true: one
 * was taken. */
int32_t fcu_take_spi_message(Chip *chip, int32_t spi, SpiMessage *message);
int32_t fcu_take_spi_unheard(Chip *chip, int32_t spi, SpiUnheard *unheard);

#pragma GCC visibility pop

#endif
