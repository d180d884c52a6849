/* The C interface for Python; the heading of each section gives the file that implements the section.
 *
 * All functions take the handle that fcu_create() returns. The library has no global state. Only one thread at a time
 * may use a handle. Times are picoseconds since power-on. Inside the library, C code calls functions that are
 * not exported, because a call of an exported function is slower.
 */
#ifndef FCU_H
#define FCU_H

#include "chip.h"
#include "cpu/value_log.h"

/* Only these functions are exported (building/library.py). */
#pragma GCC visibility push(default)

/* -- chip and memories: chip.c ------------------------------------------------------------------------ */

/* Return a new chip with erased flash, which is not powered on, or NULL if the host has no memory. */
Chip *fcu_create(const Host *host);
void fcu_destroy(Chip *chip);
/* Set the cycles per instruction (a fraction). Skip poll and idle loops if `skip` is not 0. Call this
 * before power-on. */
void fcu_configure(Chip *chip, int64_t cycles_num, int64_t cycles_den, int32_t skip);
/* These memories have FLASH_SIZE, RAM_SIZE and SYSTEM_MEMORY_SIZE bytes. Call fcu_invalidate_code() after
 * a change of code. */
uint8_t *fcu_flash(Chip *chip);
uint8_t *fcu_ram(Chip *chip);
uint8_t *fcu_system_memory(Chip *chip);

/* -- core registers: state.c -------------------------------------------------------------------------- */

/* Numbers 0 to 15 are R0 to R15; enum Register (state.c) has the further numbers. Call both functions only
 * between runs. */
void fcu_read_registers(const Chip *chip, const int32_t *numbers, uint32_t *values, int32_t count);
void fcu_write_registers(Chip *chip, const int32_t *numbers, const uint32_t *values, int32_t count);
int32_t fcu_thumb(const Chip *chip);
void fcu_set_thumb(Chip *chip, int32_t thumb);

/* -- running: run_loop.c ----------------------------------------------------------------------------------- */

/* Switch the chip on (ARMv7-M ARM B1.5.5): reset all except RAM, then load SP and PC from the vector table. */
void fcu_start(Chip *chip);
/* Run up to and including at_ps; return enum Ended. */
int32_t fcu_run_until(Chip *chip, int64_t at_ps);
/* Execute at most `instructions` instructions, without virtual time and exceptions, and with all
 * peripherals in Python. Return enum Stop. step_over: ignore a breakpoint on the first instruction. */
int32_t fcu_execute(Chip *chip, int64_t instructions, int32_t step_over);
/* End fcu_execute() after the current instruction. Call this in a callback. */
void fcu_end_run(Chip *chip);
/* fcu_executed() returns the number of instructions of the latest fcu_execute(), including one that
 * faulted. fcu_fault_address() returns the address of a refused access. */
int64_t fcu_executed(const Chip *chip);
uint32_t fcu_fault_address(const Chip *chip);
/* fcu_request_reset() resets the chip after the current instruction; fcu_reset_now() resets a halted chip
 * immediately. */
void fcu_request_reset(Chip *chip, int32_t reason);
void fcu_reset_now(Chip *chip, int32_t reason);
/* Enter an exception regardless of priorities, for fcu_execute(). Return 0 if the stack or the vector
 * table is not in memory (exceptions.c). */
int32_t fcu_enter_exception(Chip *chip, int32_t number, uint32_t vectors);

/* -- debugging: run_loop.c --------------------------------------------------------------------------------- */

/* Halt before the next instruction. If an exception entry has begun, it is finished first. */
void fcu_halt(Chip *chip);
/* If step is set, halt again after one instruction or exception entry. */
void fcu_resume(Chip *chip, int32_t step);
/* fcu_run_until() returns immediately while the core is halted. */
int32_t fcu_is_halted(const Chip *chip);
void fcu_wake(Chip *chip);
/* Select whether BKPT halts the core. fcu_halted_on_bkpt() returns whether BKPT has halted the core since the
 * previous call of fcu_halted_on_bkpt(). */
void fcu_debug(Chip *chip, int32_t on);
int32_t fcu_halted_on_bkpt(Chip *chip);

void fcu_invalidate_code(Chip *chip);
/* Call this after a change of at most 8 bytes of the flash. */
void fcu_flash_programmed(Chip *chip, uint32_t offset, uint32_t size);
/* Add or remove a breakpoint (STOP_BREAKPOINT). */
void fcu_set_breakpoint(Chip *chip, uint32_t address, int32_t on);

/* -- computed values: value_log.c ------------------------------------------------------------------------- */

/* Log into `log` from now on, or stop logging if `log` is NULL. */
void fcu_log_values(Chip *chip, ValueLog *log);
/* Watch the instructions from begin to end (excluded), or stop watching them. Watched instructions are executed
 * one by one. */
void fcu_watch_values(Chip *chip, uint32_t begin, uint32_t end, int32_t on);

/* -- status: chip.c, nvic.c --------------------------------------------------------------------------- */

typedef struct {
  int64_t now_ps;
  int64_t retired;
  int64_t skipped;
  /* accesses to registers; fast reads of memory-like peripherals (bus.c) and redundant writes are not
     counted */
  int64_t accesses;
  int64_t thread_ps;
  int64_t switched_ps;
  uint64_t pending[2], enabled[2], active[2]; /* bit = exception number */
  int64_t execution_priority;                 /* ARMv7-M ARM B1.5.4; 256: no active exception */
  uint32_t lowest_msp;                        /* lowest main stack pointer after an exception entry */
  uint32_t locked_up, locked_up_pc;
  uint32_t asleep;
  uint32_t thread_frame;
} Status;
void fcu_status(const Chip *chip, Status *status);
/* Return the most expensive kind of work since power-on. */
typedef struct {
  int64_t times;
  int32_t kind, index;
} Costliest;
void fcu_costliest(const Chip *chip, Costliest *found);
int32_t fcu_priority(const Chip *chip, int32_t exception);
int32_t fcu_priority_group(const Chip *chip, int32_t priority);
int32_t fcu_execution_priority(const Chip *chip, int32_t primask, int32_t basepri, int32_t faultmask);

/* -- accesses by debuggers and DMA: bus.c ------------------------------------------------------------- */

/* Call host.accessed() when the core accesses a byte from begin to end (included). This slows down all
 * accesses. */
void fcu_watch_memory(Chip *chip, int32_t on, uint32_t begin, uint32_t end);
/* Access an address with all side effects. Return 0 if the address has no memory or register. */
int32_t fcu_load(Chip *chip, uint32_t address, uint32_t size, uint32_t *value);
int32_t fcu_store(Chip *chip, uint32_t address, uint32_t size, uint32_t value);

/* -- snapshots: chip.c ------------------------------------------------------------------------------------ */

/* Save and restore the whole chip as bytes. The bytes are valid only for the same chip. Call these
 * functions between runs only. */
int64_t fcu_snapshot_size(void);
void fcu_save(const Chip *chip, void *snapshot);
void fcu_restore(Chip *chip, const void *snapshot);

/* -- time: chip.c ----------------------------------------------------------------------------------------- */

void fcu_advance(Chip *chip, int64_t to_ps);
void fcu_settle(Chip *chip);
/* Return the time of the chip's earliest event that ends a run. */
int64_t fcu_next_event(const Chip *chip);
void fcu_set_clocks(Chip *chip, const Clocks *clocks);

/* -- peripherals by index: chip.c --------------------------------------------------------------------- */

int32_t fcu_peripheral_count(const Chip *chip);
uint32_t fcu_peripheral_base(const Chip *chip, int32_t index);
/* Return -1 for an address without a peripheral in C. */
int32_t fcu_peripheral_at(const Chip *chip, uint32_t address);
/* RCC calls this function to switch the clock of the peripheral in Python at this address. */
void fcu_gate_python(Chip *chip, uint32_t address, int32_t clocked);
/* RCC calls these functions to switch clocks and to reset peripherals. Bit n is the peripheral with index n. */
void fcu_gate(Chip *chip, uint64_t peripherals, uint64_t clocked);
int32_t fcu_is_clocked(const Chip *chip, int32_t index);
void fcu_reset_peripherals(Chip *chip, uint64_t peripherals);
/* Read a word, even if the peripheral's clock is off. fcu_read_peripheral() has side effects, and sets
 * chip->until_ps to the time until which the value is valid. fcu_peek_peripheral() has no side effects. */
uint32_t fcu_read_peripheral(Chip *chip, int32_t index, uint32_t offset);
uint32_t fcu_peek_peripheral(Chip *chip, int32_t index, uint32_t offset);
/* Return 1 if a read has no side effect and the value does not change continuously. */
int32_t fcu_is_pure(Chip *chip, int32_t index, uint32_t offset);
void fcu_write_peripheral(Chip *chip, int32_t index, uint32_t offset, uint32_t value, uint32_t mask);

/* -- interrupt lines, alternate functions: chip.c ----------------------------------------------------- */

/* Python's peripherals set NVIC input `number`; level 1 is active. */
void fcu_set_irq(Chip *chip, int32_t number, int32_t level);
int32_t fcu_irq_level(const Chip *chip, int32_t number);
void fcu_watch_irqs(Chip *chip, void (*changed)(int64_t now_ps, int32_t number, int32_t level));
/* Set the alternate function of a pin; -1: none. */
void fcu_set_alternate(Chip *chip, int32_t port, int32_t pin, int32_t function);

/* -- pins: gpio.c, exti.c -------------------------------------------------------------------------------- */

/* port is an index in "ABCDEH". */
void fcu_connect_pins(Chip *chip, const PinCalls *calls);
/* Return the number of recorded output edges that Python has not taken. Edges are recorded while the trace
 * is not observed. */
int64_t fcu_pending_edges(const Chip *chip);
/* Copy the latest `size` edges in order of time; *lost is the number of dropped edges. */
int64_t fcu_take_edges(Chip *chip, Edge *edges, int64_t size, int64_t *lost);
/* Call changed() when the pin's input level changes. */
void fcu_watch_pin(Chip *chip, int32_t port, int32_t pin);
/* Report edges of this pin only while chip->detailed is set. */
void fcu_frequent_pin(Chip *chip, int32_t port, int32_t pin);
/* Set the combined level of all external drivers; -1 if none drives the pin. */
void fcu_drive_pin(Chip *chip, int32_t port, int32_t pin, int32_t level);
/* These functions return the pin's output level, pull resistor and alternate function; -1: none. */
int32_t fcu_pin_output(const Chip *chip, int32_t port, int32_t pin);
int32_t fcu_pin_pull(const Chip *chip, int32_t port, int32_t pin);
int32_t fcu_pin_alternate(const Chip *chip, int32_t port, int32_t pin);
/* Set the level of an internal signal; its line number is 16 or above. */
void fcu_set_exti_line(Chip *chip, int32_t line, int32_t level);

/* -- timers by index: tim.c, tim_outputs.c ------------------------------------------------------------ */

void fcu_connect_timers(Chip *chip, const TimCalls *calls);
const TickCounts *fcu_timer_counts(const Chip *chip, int32_t index);
/* Return the update rate in Hz; 0 while ARR is 0. */
double fcu_timer_rate(const Chip *chip, int32_t index);
/* Return the next time at which a flag of SR may become set. */
int64_t fcu_timer_next_change(const Chip *chip, int32_t index);
/* Set *frequency_hz and *duty of channel 1 to 4. Return 1 if the channel has a PWM output, 0 if it has none,
 * -1 if the channel does not exist. */
int32_t fcu_timer_pwm(const Chip *chip, int32_t index, int32_t channel, double *frequency_hz, double *duty);

/* -- USARTs by index: usart.c ------------------------------------------------------------------------- */

void fcu_connect_usarts(Chip *chip, const UsartCalls *calls);
/* Connect a terminal to the transmitter at this pin. */
void fcu_usart_wire(Chip *chip, int32_t index, int32_t port, int32_t pin, int32_t function, int32_t baud);
/* Pass all bytes that the USART has sent so far to the callback sent(). */
void fcu_usart_flush(Chip *chip, int32_t index);
/* Set *num / *den to the duration of a frame in ps. Return 0 if the bit clock is off. */
int32_t fcu_usart_frame(const Chip *chip, int32_t index, int64_t *num, int64_t *den);
/* Return the next time at which TXE or TC is set. */
int64_t fcu_usart_next_change(Chip *chip, int32_t index);
/* Return 0 if the byte is lost by overrun. */
int32_t fcu_usart_receive(Chip *chip, int32_t index, int32_t value);
void fcu_usart_line_idle(Chip *chip, int32_t index);

/* -- ADC1: adc.c --------------------------------------------------------------------------------------- */

/* Return the voltages of the channels, which the caller may change between runs and in callbacks. */
AdcInputs *fcu_connect_adc(Chip *chip, const AdcCalls *calls);

/* -- DMA request lines (enum Request): dma.c ---------------------------------------------------------- */

/* fcu_dma_request() returns 1 if a stream has made the transfer; fcu_dma_remaining() returns NDTR of the
 * stream. */
int32_t fcu_dma_request(Chip *chip, int32_t line);
uint32_t fcu_dma_remaining(const Chip *chip, int32_t line);

/* -- registers of the sensors: sensor_registers.c; I2C: i2c.c, i2c_wire.c ----------------------------------------- */

SensorRegisters *fcu_connect_targets(Chip *chip, const TargetCalls *calls);
/* version: address of the sensor's version counter; the address must stay valid. increment_bit: the bit of a
 * sub-address that enables its increment, or 0. Return -1 if there are too many targets; Python then handles
 * the reads. */
int32_t fcu_add_target(Chip *chip, const uint64_t *version, int32_t increment_bit);
/* number: 0 for I2C1. speed_hz: the initial speed. shortest_ps: the shortest period of the bus. */
void fcu_connect_i2c(Chip *chip, int32_t number, const I2cCalls *calls, int64_t speed_hz, int64_t shortest_ps);
/* which: 0 for SCL, 1 for SDA. An I2C without pins is always connected. */
void fcu_i2c_pin(Chip *chip, int32_t number, int32_t which, int32_t port, int32_t pin, int32_t function);
I2cWire *fcu_i2c_wire(Chip *chip, int32_t number);

/* -- SPI: spi_line.c; spi: 0 for SPI1 -------------------------------------------------------------------- */

/* Connect an SPI to the sensors' bus in Python. */
/* index: of the peripheral. Return the end of the present frame, or NEVER_PS, and the time of the latest write or end
 * of a frame. */
int64_t fcu_spi_next_change(const Chip *chip, int32_t index);
int64_t fcu_spi_active_ps(const Chip *chip, int32_t index);
void fcu_connect_spi(Chip *chip, int32_t spi, const SpiCalls *calls);
/* Add a sensor, at most SPI_SENSORS. target: a result of fcu_add_target(). */
void fcu_add_spi_sensor(Chip *chip, int32_t spi, int32_t port, int32_t pin, int32_t target);
/* Add a module that is not fitted. on_access() is called when firmware sends to the module for the first time. */
void fcu_add_absent_spi_device(Chip *chip, int32_t spi, int32_t port, int32_t pin, void (*on_access)(int64_t now_ps));
/* fcu_take_spi_message() takes the oldest recorded message; fcu_take_spi_unaddressed() takes the oldest
 * byte that was sent while no chip select was low. Both functions return 0 if nothing is recorded. Only the latest
 * SPI_RECENT messages and bytes are recorded. */
int32_t fcu_take_spi_message(Chip *chip, int32_t spi, SpiMessage *message);
int32_t fcu_take_spi_unaddressed(Chip *chip, int32_t spi, SpiUnaddressed *unaddressed);

#pragma GCC visibility pop

#endif
