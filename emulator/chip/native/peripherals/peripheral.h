/* What every peripheral of the chip has in common: its place in the memory map, its clock, its events, its interrupt
 * and DMA request lines, and what it says about firmware.
 *
 * A peripheral is a struct whose first member is a Peripheral, inside of struct Chip; its file has, in this order, a
 * comment that cites the manual and lists what is NOT MODELLED, register offsets and bits in the manual's
 * spelling, the functions of its PeripheralType, and X_create(). All state is plain data inside the struct: a
 * snapshot of the chip is a copy. There are no statics but constants.
 *
 * Time: chip->now_ps is the exact time of the access or event that is being carried out. Everything due by then
 * has been carried out before a peripheral is called. A peripheral either computes its state from the time when it is
 * looked at, or plans an event. A scheduled event ends the run of instructions under way and is for what may
 * raise an interrupt, move a pin or start a transfer by DMA; a deferred one happens at its time as well, and in
 * order with all others, but is carried out only when something looks (the next access to any register, the
 * next event, the end of a run), so that it costs no run its end.
 */
#ifndef FCU_PERIPHERAL_H
#define FCU_PERIPHERAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "generated/dma_requests.h"
#include "generated/memory_map.h"

#define NEVER_PS ((int64_t)1 << 62) /* as in emulator/time/clock.py */
#define ALREADY_PS ((int64_t)-1)
#define PS_PER_S INT64_C(1000000000000)
#define WORD 0xFFFFFFFFu

/* The bits of an access of 1, 2 or 4 bytes, at its lowest byte. */
static inline uint32_t mask_of(unsigned size) { return size == 4 ? WORD : (1u << 8 * size) - 1; }

/* The number in a field of several bits, by the names of the chapter's header: FIELD(cr2, CR2_STOP). */
#define FIELD(value, name) (((value) & (name)) >> name##_SHIFT)

int64_t common_divisor(int64_t a, int64_t b); /* the greatest one */

typedef struct Chip Chip;
typedef struct Peripheral Peripheral;

typedef struct {
  /* The word at a word-aligned offset, side effects included. *until_ps arrives as NEVER_PS: make it the time
   * when the register may next read differently without an access and without a scheduled event, or ALREADY_PS
   * where the read has a side effect or the value runs with time. Loops that poll are skipped by it. */
  uint32_t (*read)(Peripheral *peripheral, uint32_t offset, int64_t *until_ps);
  /* The same without any side effect. */
  uint32_t (*peek)(const Peripheral *peripheral, uint32_t offset);
  /* Write the bits of mask (bytes or half-words where firmware stores those). value is already masked. */
  void (*write)(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask);
  /* Back to the state after reset: system reset, or the peripheral's bit in RCC_xxxRSTR. */
  void (*reset)(Peripheral *peripheral);
  /* All below may be NULL. */
  bool (*is_pure)(const Peripheral *peripheral, uint32_t offset); /* false where read() would give ALREADY_PS now */
  bool (*changes_nothing)(const Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask);
  void (*clocks_changed)(Peripheral *peripheral); /* a frequency of the clock tree is another one */
  void (*gated)(Peripheral *peripheral);          /* peripheral->clocked has changed */
  /* a stream has begun to serve one of the peripheral's request lines */
  void (*dma_ready)(Peripheral *peripheral);
} PeripheralType;

struct Peripheral {
  const PeripheralType *type;
  Chip *chip;
  uint32_t base, size;
  int32_t index;    /* among the chip's peripherals; Python knows the name by it */
  uint32_t noted;   /* which notes have been reported: bit = id */
  uint8_t clocked;  /* RCC: a peripheral without clock reads as 0 and forgets writes */
  uint32_t looks;    /* reads since the last write */
  uint8_t steady;    /* registers change by scheduled events and writes only, and reads do nothing: one that is
                        polled all the time is read like memory */
  uint32_t known[32]; /* bit = offset / 4: registers that exist in the first four kilobytes */
};

/* -- peripherals --------------------------------------------------------------------------------------------- */

/* Put a peripheral into the memory map. offsets: its registers; -1 ends them. */
void peripheral_create(Chip *chip, Peripheral *peripheral, const PeripheralType *type, uint32_t base, uint32_t size,
                  const int16_t *offsets);

/* All of its offsets reach the peripheral, which reports by itself those that are no register. */
void peripheral_knows_all(Peripheral *peripheral);

static inline bool peripheral_knows(const Peripheral *peripheral, uint32_t address) {
  uint32_t offset = address - peripheral->base;
  return offset < 0x1000 && peripheral->known[offset >> 7] >> (offset >> 2 & 31) & 1;
}

/* -- events: chip.c -------------------------------------------------------------------------------------- */

typedef void (*Fire)(Peripheral *peripheral);

/* At creation: an event of the peripheral, not planned yet. fire() is called with chip->now_ps at its time. */
int event_create(Peripheral *peripheral, Fire fire);
/* Plan it (anew). A time that has passed already means now. */
void event_schedule(Chip *chip, int event, int64_t at_ps);
void event_defer(Chip *chip, int event, int64_t at_ps);
void event_cancel(Chip *chip, int event);
/* NEVER_PS if it is not planned. */
int64_t event_at(const Chip *chip, int event);

/* -- lines ----------------------------------------------------------------------------------------------- */

/* Interrupts: peripheral_set_irq() of chip.h. */

/* At creation: dma_ready() of the peripheral is called when a stream begins to serve the line. */
void dma_connect(Peripheral *peripheral, enum Request line);
/* The line asks for one transfer, which is done at once; false: no stream serves it now. */
bool dma_request(Chip *chip, enum Request line);
/* Transfers left of the stream that serves the line; 0 if none does. */
uint32_t dma_remaining(const Chip *chip, enum Request line);

/* -- pins ------------------------------------------------------------------------------------------------ */

typedef struct {
  char port; /* 'A' */
  uint8_t pin, function;
} PinFunction;

/* The pins of the list that are not switched to their function, as text ("PB10 to AF4, PB3 to AF9") in at most
 * size bytes; whether all are. function 255 ends the list. */
bool pins_connected(const Chip *chip, const PinFunction *pins, char *missing, size_t size);

/* At creation: call changed() after every change of what the pin reads, in the order of listening. */
typedef void (*PinChanged)(Peripheral *peripheral, int pin, bool level);
void pin_listen(Peripheral *peripheral, char port, int pin, PinChanged changed);
/* The level that results; -1 while the pin floats. port: its index. */
int pin_level(const Chip *chip, int port, int pin);

/* -- what firmware should know --------------------------------------------------------------------------- */

enum NoteKind { NOTE_FORBIDDEN, NOTE_NOT_MODELLED, NOTE_REFUSED };

/* Put a note into the trace. id: 0 to 31, this note of this peripheral is reported once only; -1: Python leaves out
 * texts that it has had. */
void peripheral_note(Peripheral *peripheral, int id, enum NoteKind kind, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

#endif
