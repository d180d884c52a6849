/* The C interface that Python calls. All functions take the handle that fcu_create() returns.
 *
 * Each section names the file with its functions. Internal callers in C use a separate hidden function for frequent
 * calls, because a call of an exported function goes through a table.
 *
 * The library has no global state and calls only the callbacks it is given. One thread at a time uses a handle.
 * Times are picoseconds since power-on.
 */
#ifndef FCU_H
#define FCU_H

#include "chip.h"

/* The library exports only these functions; the rest are hidden (building/library.py). */
#pragma GCC visibility push(default)

/* -- the chip and its memories: chip.c ------------------------------------------------------------------ */

/* Create a chip before power-on, with erased flash; NULL if the host has no memory for it. */
Chip *fcu_create(const Host *host);
void fcu_destroy(Chip *chip);
/* Before power-on: set the cycles per instruction, as a fraction, and if waiting loops are skipped. */
void fcu_configure(Chip *chip, int64_t cycles_num, int64_t cycles_den, int32_t skip);
/* FLASH_SIZE, RAM_SIZE and SYSTEM_MEMORY_SIZE bytes. A caller that changes code which may have been executed must
 * call fcu_forget_code(). */
uint8_t *fcu_flash(Chip *chip);
uint8_t *fcu_ram(Chip *chip);
uint8_t *fcu_system_memory(Chip *chip);

/* -- the processor's registers: state.c ------------------------------------------------------------------ */

/* Registers by number: 0 to 15, then enum Register in state.c. Between runs only. */
void fcu_read_registers(const Chip *chip, const int32_t *numbers, uint32_t *values, int32_t count);
void fcu_write_registers(Chip *chip, const int32_t *numbers, const uint32_t *values, int32_t count);
/* EPSR.T, which is not visible in PC. */
int32_t fcu_thumb(const Chip *chip);
void fcu_set_thumb(Chip *chip, int32_t thumb);

/* -- running: run_loop.c ----------------------------------------------------------------------------------- */

/* Power-on and the state after reset (ARMv7-M ARM B1.5.5): registers, peripherals, SP and PC from the vector table.
 * RAM keeps its contents. */
void fcu_start(Chip *chip);
/* Run up to and including at_ps; return enum Ended. */
int32_t fcu_run_until(Chip *chip, int64_t at_ps);
/* Execute at most `instructions` without time, exceptions and peripherals; all registers are Python's. Return enum
 * Stop. past: ignore a breakpoint on the first instruction. */
int32_t fcu_execute(Chip *chip, int64_t instructions, int32_t step_over);
/* In an access: end fcu_execute() after the current instruction. */
void fcu_end_run(Chip *chip);
/* The number of instructions that fcu_execute() executed, including the current or the faulting one; and the address
 * of the refused access. */
int64_t fcu_executed(const Chip *chip);
uint32_t fcu_fault_address(const Chip *chip);
/* Reset the chip after the current instruction; fcu_reset_now() resets a halted chip at once. */
void fcu_request_reset(Chip *chip, int32_t reason);
void fcu_reset_now(Chip *chip, int32_t reason);
/* Enter an exception at once, regardless of the priorities: save the context and continue at the handler from the
 * vector table at `vectors`. 0 if the stack or the table is not in memory. For fcu_execute(). In exceptions.c. */
int32_t fcu_enter_exception(Chip *chip, int32_t number, uint32_t vectors);

/* -- debugging: run_loop.c --------------------------------------------------------------------------------- */

/* Halt before the next instruction; an exception entry in progress is completed first. */
void fcu_halt(Chip *chip);
/* Resume execution; step: for one instruction, or for the exception entry that comes instead of it. */
void fcu_resume(Chip *chip, int32_t step);
/* Return 1 if the core is halted: fcu_run_until() then returns at once and no time passes. */
int32_t fcu_is_halted(const Chip *chip);
/* End WFI, WFE or sleep on exit. */
void fcu_wake(Chip *chip);
/* Select if BKPT halts the core; return 1 if it has halted the core since the last call. */
void fcu_debug(Chip *chip, int32_t on);
int32_t fcu_halted_on_bkpt(Chip *chip);

/* -- code: decode_cache.c --------------------------------------------------------------------------------------- */

/* Decode all code again. */
void fcu_invalidate_code(Chip *chip);
/* Halt before the instruction at an address (STOP_BREAKPOINT), or remove the breakpoint. */
void fcu_set_breakpoint(Chip *chip, uint32_t address, int32_t on);

/* -- the present state: chip.c, nvic.c -------------------------------------------------------------------- */

typedef struct {
  int64_t now_ps;    /* the time when the next instruction begins */
  int64_t retired;   /* instructions executed since power-on */
  int64_t skipped;   /* of these, instructions counted without execution */
  int64_t accesses;  /* to registers with side effects or changing values */
  int64_t thread_ps; /* the time of the last return to Thread mode */
  uint64_t pending[2], enabled[2], active[2]; /* exceptions: bit = number */
  int64_t execution_priority;    /* the execution priority (ARMv7-M ARM B1.5.4); 256: none */
  uint32_t lowest_msp;   /* the lowest address of the main stack at an exception entry */
  uint32_t locked_up, locked_up_pc;
  uint32_t asleep;   /* enum Sleep */
} Status;
void fcu_status(const Chip *chip, Status *status);
/* The most frequent kind of work since power-on. */
typedef struct {
  int64_t times;       /* the number of occurrences */
  int32_t kind, index; /* enum CostKind of work.h */
} Costliest;
void fcu_costliest(const Chip *chip, Costliest *found);
/* An exception's priority; the preemption part of a priority. */
int32_t fcu_priority(const Chip *chip, int32_t exception);
int32_t fcu_priority_group(const Chip *chip, int32_t priority);

/* -- accesses by debuggers and DMA in Python: bus.c ------------------------------------------------------- */

/* Call host.accessed() at the core's loads and stores from begin to end, both included, or stop that. All loads and
 * stores are slower meanwhile. */
void fcu_watch_memory(Chip *chip, int32_t on, uint32_t begin, uint32_t end);
/* Access an address now, with all side effects; 0 if no memory or register is there. */
int32_t fcu_load(Chip *chip, uint32_t address, uint32_t size, uint32_t *value);
int32_t fcu_store(Chip *chip, uint32_t address, uint32_t size, uint32_t value);

/* -- snapshots: chip.c ------------------------------------------------------------------------------------ */

/* A snapshot is the whole chip as an array of bytes, valid for the same chip only. Between runs only. */
int64_t fcu_snapshot_size(void);
void fcu_save(const Chip *chip, void *snapshot);
void fcu_restore(Chip *chip, const void *snapshot);

/* -- time: chip.c ----------------------------------------------------------------------------------------- */

/* Let time pass until to_ps without executing instructions. */
void fcu_advance(Chip *chip, int64_t to_ps);
/* Carry out everything due by now. */
void fcu_settle(Chip *chip);
/* Return the time of the earliest event of the chip that ends a run. */
int64_t fcu_next_event(const Chip *chip);
void fcu_set_clocks(Chip *chip, const Clocks *clocks);

/* -- peripherals, by index: chip.c ---------------------------------------------------------------------------- */

int32_t fcu_peripheral_count(const Chip *chip);
uint32_t fcu_peripheral_base(const Chip *chip, int32_t index);
/* Return the index of the peripheral in C at an address; -1 if it is Python's or no peripheral. */
int32_t fcu_peripheral_at(const Chip *chip, uint32_t address);
/* RCC switches the clock of the peripheral in Python at an address on or off. */
void fcu_gate_python(Chip *chip, uint32_t address, int32_t clocked);
/* RCC switches the clocks of some peripherals (bit = index) on or off; the clock state of one; RCC resets some
 * peripherals. */
void fcu_gate(Chip *chip, uint64_t peripherals, uint64_t clocked);
int32_t fcu_is_clocked(const Chip *chip, int32_t index);
void fcu_reset_peripherals(Chip *chip, uint64_t peripherals);
/* Read the word at an offset, with or without clock. fcu_read_peripheral() has side effects and sets chip->until_ps
 * to the end of the value's validity; fcu_peek_peripheral() has no side effects. */
uint32_t fcu_read_peripheral(Chip *chip, int32_t index, uint32_t offset);
uint32_t fcu_peek_peripheral(Chip *chip, int32_t index, uint32_t offset);
/* Return 1 if a read there has no side effect and its value does not change continuously. */
int32_t fcu_is_pure(Chip *chip, int32_t index, uint32_t offset);
void fcu_write_peripheral(Chip *chip, int32_t index, uint32_t offset, uint32_t value, uint32_t mask);

/* -- lines: chip.c --------------------------------------------------------------------------------------- */

/* Python's peripherals set or clear NVIC input `number`; return 1 if any peripheral sets it. */
void fcu_set_irq(Chip *chip, int32_t number, int32_t level);
int32_t fcu_irq_level(const Chip *chip, int32_t number);
/* Call changed(now_ps, number, level) when an NVIC input changes; NULL: stop that. */
void fcu_watch_irqs(Chip *chip, void (*changed)(int64_t now_ps, int32_t number, int32_t level));
/* Switch the pin to an alternate function; -1: to none. */
void fcu_set_alternate(Chip *chip, int32_t port, int32_t pin, int32_t function);

/* -- pins: gpio.c, exti.c -------------------------------------------------------------------------------- */

/* Pins by the index of their port ("ABCDEH") and their number. */
void fcu_connect_pins(Chip *chip, const PinCalls *calls);
/* Edges of outputs that Python has not taken, while the trace is not observed. Take the latest, at most `size`,
 * oldest first. Return their number; *lost is the number of earlier edges that were dropped. */
int64_t fcu_pending_edges(const Chip *chip);
int64_t fcu_take_edges(Chip *chip, Edge *edges, int64_t size, int64_t *lost);
/* Call changed() after every change of the pin's input level. */
void fcu_watch_pin(Chip *chip, int32_t port, int32_t pin);
/* Call edge() for this pin only while chip->detailed is set. */
void fcu_frequent_pin(Chip *chip, int32_t port, int32_t pin);
/* All devices outside of the chip together drive the pin to a level; -1: it is not driven. */
void fcu_drive_pin(Chip *chip, int32_t port, int32_t pin, int32_t level);
/* The chip's side of a pin, -1 for none: its output stage, its pull resistor, its alternate function. */
int32_t fcu_pin_output(const Chip *chip, int32_t port, int32_t pin);
int32_t fcu_pin_pull(const Chip *chip, int32_t port, int32_t pin);
int32_t fcu_pin_alternate(const Chip *chip, int32_t port, int32_t pin);
/* Set an internal signal of EXTI, line 16 or higher. */
void fcu_set_exti_line(Chip *chip, int32_t line, int32_t level);

/* -- timers, by index of their peripheral: tim.c -------------------------------------------------------------- */

/* Callbacks for a late timer handler and for one that ran after lost ticks; either may be NULL. */
void fcu_connect_timers(Chip *chip, const TimCalls *calls);
/* The timer's counts of update interrupts; the address is the same as long as the chip exists. */
const TickCounts *fcu_timer_counts(const Chip *chip, int32_t index);
/* The configured update rate; 0 while ARR is 0. */
double fcu_timer_rate(const Chip *chip, int32_t index);
/* The next time when a flag of SR may be set. */
int64_t fcu_timer_next_change(const Chip *chip, int32_t index);
/* The PWM output of channel 1 to 4: 1 with frequency and duty; 0 while it outputs no PWM or the timer is stopped; -1
 * if the timer does not have the channel. */
int32_t fcu_timer_pwm(const Chip *chip, int32_t index, int32_t channel, double *frequency_hz, double *duty);

/* -- USARTs, by index of their peripheral: usart.c ------------------------------------------------------------- */

void fcu_connect_usarts(Chip *chip, const UsartCalls *calls);
/* A terminal at this rate is connected to the transmitter at this pin. */
void fcu_usart_wire(Chip *chip, int32_t index, int32_t port, int32_t pin, int32_t function, int32_t baud);
/* Call sent() with the bytes that it has not received yet. */
void fcu_usart_flush(Chip *chip, int32_t index);
/* The length of a frame, num / den ps; 0 while it has no bit clock. */
int32_t fcu_usart_frame(const Chip *chip, int32_t index, int64_t *num, int64_t *den);
/* The next time when TXE or TC is set. */
int64_t fcu_usart_next_change(Chip *chip, int32_t index);
/* A byte has arrived: 0 if it is lost because the previous byte was not read. */
int32_t fcu_usart_receive(Chip *chip, int32_t index, int32_t value);
/* The line was idle for the time of one frame after a byte. */
void fcu_usart_line_idle(Chip *chip, int32_t index);

/* -- DMA request lines (enum Request of peripheral.h): dma.c -------------------------------------------------- */

/* Request a transfer for the caller's peripheral, which is done at once if a stream serves the line: 1. The second
 * function returns the transfers left. */
int32_t fcu_dma_request(Chip *chip, int32_t line);
uint32_t fcu_dma_remaining(const Chip *chip, int32_t line);

/* -- sensors' bytes in C: read_cache.c; I2C: i2c.c ----------------------------------------------------------- */

ReadCache *fcu_connect_targets(Chip *chip, const TargetCalls *calls);
/* Add a sensor at a bus. version points to the sensor's version counter and must stay valid. Return its index, or -1
 * if there are too many: its bytes are then not cached. */
int32_t fcu_add_target(Chip *chip, const uint64_t *version);
/* Connect the bus of I2C<number + 1>. speed_hz is its bus frequency, shortest_ps the shortest period that it
 * supports. */
void fcu_connect_i2c(Chip *chip, int32_t number, const I2cCalls *calls, int64_t speed_hz, int64_t shortest_ps);
/* Assign bus pin 0 or 1 to a pin of the chip as that alternate function. Without pins the bus is always connected. */
void fcu_i2c_pin(Chip *chip, int32_t number, int32_t which, int32_t port, int32_t pin, int32_t function);
I2cWire *fcu_i2c_wire(Chip *chip, int32_t number);

/* -- SPI: spi_line.c; spi: 0 for SPI1 -------------------------------------------------------------------- */

/* Connect a bus at its pins; fcu_add_spi_part() adds sensors to it: at most SPI_PARTS. target: the value that
 * fcu_add_target() returned. */
void fcu_connect_spi(Chip *chip, int32_t spi, const SpiCalls *calls);
void fcu_add_spi_sensor(Chip *chip, int32_t spi, int32_t port, int32_t pin, int32_t target);
/* An absent module at these pins: tried() is called once, when firmware first sends it a byte. */
void fcu_add_absent_spi_device(Chip *chip, int32_t spi, int32_t port, int32_t pin, void (*on_access)(int64_t now_ps));
/* Take the oldest message that C has answered, or the oldest byte that no sensor received; at most SPI_RECENT are
 * kept. 1: one was taken. */
int32_t fcu_take_spi_message(Chip *chip, int32_t spi, SpiMessage *message);
int32_t fcu_take_spi_unaddressed(Chip *chip, int32_t spi, SpiUnaddressed *unaddressed);

#pragma GCC visibility pop

#endif
