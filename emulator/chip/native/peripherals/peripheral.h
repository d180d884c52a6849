/* The interface of a peripheral: its place in the memory map, its clock, events, interrupt and DMA request lines,
 * and its notes about firmware.
 *
 * A peripheral is a struct inside struct Chip; its first member is a Peripheral. Its file contains, in this order: a
 * comment that cites the manual and lists the functions that are NOT MODELLED, register offsets and bits in the
 * manual's spelling, the functions of its PeripheralType, and X_create(). All state is plain data inside the struct:
 * a snapshot of the chip is a copy. The only statics are constants.
 *
 * Time: chip->now_ps is the exact time of the access or event in progress. All events due by then have been carried
 * out before a peripheral is called. A peripheral computes its state from the time when it is read, or schedules an
 * event. A scheduled event ends the current run of instructions. Use it for events that may raise an interrupt, move
 * a pin or start a DMA transfer. A deferred event has an exact time and order too, but is carried out later: at the
 * next access to any register, the next event or the end of a run. It therefore does not end the run of
 * instructions.
 */
#ifndef FCU_PERIPHERAL_H
#define FCU_PERIPHERAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "generated/dma_requests.h"
#include "generated/memory_map.h"

#define NEVER_PS ((int64_t)1 << 62) /* as in emulator/time/clock.py */
#define NOT_CACHEABLE_PS ((int64_t)-1)
#define PS_PER_S INT64_C(1000000000000)
#define WORD 0xFFFFFFFFu

/* The bits of an access of 1, 2 or 4 bytes, at its lowest byte. */
static inline uint32_t size_mask(unsigned size) { return size == 4 ? WORD : (1u << 8 * size) - 1; }

/* The number in a field of several bits, by the names of the chapter's header: FIELD(cr2, CR2_STOP). */
#define FIELD(value, name) (((value) & (name)) >> name##_SHIFT)

int64_t gcd(int64_t a, int64_t b); /* the greatest common divisor */

typedef struct Chip Chip;
typedef struct Peripheral Peripheral;

typedef struct {
  /* Read the word at a word-aligned offset, with side effects. *until_ps is NEVER_PS at first. Set it to the time
   * when the register may next change without an access and without a scheduled event. Set it to ALREADY_PS if the
   * read has a side effect or the value changes continuously. Polling loops are skipped up to this time. */
  uint32_t (*read)(Peripheral *peripheral, uint32_t offset, int64_t *until_ps);
  /* Read the word without side effects. */
  uint32_t (*peek)(const Peripheral *peripheral, uint32_t offset);
  /* Write the bits of mask (of a byte or half-word for such a store). value is already masked. */
  void (*write)(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask);
  /* Restore the state after reset: system reset, or the peripheral's bit in RCC_xxxRSTR. */
  void (*reset)(Peripheral *peripheral);
  /* All members below may be NULL. */
  bool (*is_pure)(const Peripheral *peripheral, uint32_t offset); /* false if read() would give ALREADY_PS now */
  bool (*is_redundant_write)(const Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask);
  void (*clocks_changed)(Peripheral *peripheral); /* a frequency of the clock tree has changed */
  void (*gated)(Peripheral *peripheral);          /* peripheral->clocked has changed */
  /* a stream has begun to serve one of the peripheral's request lines */
  void (*dma_ready)(Peripheral *peripheral);
} PeripheralType;

struct Peripheral {
  const PeripheralType *type;
  Chip *chip;
  uint32_t base, size;
  int32_t index;    /* index among the chip's peripherals; Python finds the name by it */
  uint32_t noted;   /* which notes have been reported: bit = id */
  uint8_t clocked;  /* RCC: a peripheral without clock reads as 0 and ignores writes */
  uint32_t reads_since_write;    /* reads since the last write */
  uint8_t memory_like;    /* registers change only by scheduled events and writes, and reads have no side effect:
                        a peripheral that is polled continuously is read like memory */
  uint32_t implemented[32]; /* bit = offset / 4: registers that exist in the first four kilobytes */
};

/* -- peripherals --------------------------------------------------------------------------------------------- */

/* Add a peripheral to the memory map. offsets: its registers; -1 ends them. */
void peripheral_create(Chip *chip, Peripheral *peripheral, const PeripheralType *type, uint32_t base, uint32_t size,
                  const int16_t *offsets);

/* Pass all offsets to the peripheral, which itself reports the offsets without a register. */
void peripheral_set_all_registers(Peripheral *peripheral);

static inline bool peripheral_has_register(const Peripheral *peripheral, uint32_t address) {
  uint32_t offset = address - peripheral->base;
  return offset < 0x1000 && peripheral->implemented[offset >> 7] >> (offset >> 2 & 31) & 1;
}

/* -- events: chip.c -------------------------------------------------------------------------------------- */

typedef void (*Fire)(Peripheral *peripheral);

/* At creation: add an event of the peripheral, not yet scheduled. fire() is called with chip->now_ps at its time. */
int event_create(Peripheral *peripheral, Fire fire);
/* Schedule the event, or reschedule it. A time in the past means now. */
void event_schedule(Chip *chip, int event, int64_t at_ps);
void event_defer(Chip *chip, int event, int64_t at_ps);
void event_cancel(Chip *chip, int event);
/* Return the event's time; NEVER_PS if it is not scheduled. */
int64_t event_at(const Chip *chip, int event);

/* -- lines ----------------------------------------------------------------------------------------------- */

/* Interrupts: peripheral_set_irq() of chip.h. */

/* At creation: dma_ready() of the peripheral is called when a stream begins to serve the line. */
void dma_connect(Peripheral *peripheral, enum Request line);
/* Request one DMA transfer, which is done at once; false: no stream serves the line now. */
bool dma_request(Chip *chip, enum Request line);
/* Transfers left of the stream that serves the line; 0 if none does. */
uint32_t dma_remaining(const Chip *chip, enum Request line);

/* -- pins ------------------------------------------------------------------------------------------------ */

typedef struct {
  char port; /* 'A' */
  uint8_t pin, function;
} PinFunction;

/* Write the pins of the list that are not switched to their function as text ("PB10 to AF4, PB3 to AF9"), in at most
 * size bytes. True if all are switched. Function 255 ends the list. */
bool pins_connected(const Chip *chip, const PinFunction *pins, char *missing, size_t size);

/* At creation: call changed() after every change of the pin's input level, in the order of registration. */
typedef void (*PinChanged)(Peripheral *peripheral, int pin, bool level);
void pin_listen(Peripheral *peripheral, char port, int pin, PinChanged changed);
/* Return the resulting level; -1 while the pin floats. port: its index. */
int pin_level(const Chip *chip, int port, int pin);

/* -- notes about firmware -------------------------------------------------------------------------------- */

enum NoteKind { NOTE_FORBIDDEN, NOTE_NOT_MODELLED, NOTE_REFUSED };

/* Add a note to the trace. id 0 to 31: this note of this peripheral is reported once only. id -1: Python drops
 * repeated texts. */
void peripheral_note(Peripheral *peripheral, int id, enum NoteKind kind, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

#endif
