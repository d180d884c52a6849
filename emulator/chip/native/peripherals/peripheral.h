/* The interface of a peripheral: memory map, clock, events, interrupt and DMA lines, notes about firmware.
 *
 * A peripheral is a struct whose first member is a Peripheral; struct Chip contains it. The file of a peripheral
 * has a comment, a PeripheralType, and X_create(). The comment cites the manual and lists functions that are NOT
 * MODELLED. All state is plain data in the struct, because a snapshot is a copy of the chip.
 *
 * chip->now_ps is the exact time of the current access or event. State is either computed when it is read, or
 * changed by an event. A scheduled event ends the run of instructions; schedule the event if it may change an
 * interrupt line, a pin or a DMA request. A deferred event is executed later, but with its exact time and order: at
 * the next access to a register, at the next event, or at the end of a run.
 */
#ifndef FCU_PERIPHERAL_H
#define FCU_PERIPHERAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "generated/dma_requests.h"
#include "generated/memory_map.h"

#define NEVER_PS ((int64_t)1 << 62) /* as in emulator/clock.py */
#define NOT_CACHEABLE_PS ((int64_t)-1)
#define PS_PER_S INT64_C(1000000000000)
#define WORD 0xFFFFFFFFu

/* Return the mask of the lowest `size` bytes. */
static inline uint32_t size_mask(unsigned size) { return size == 4 ? WORD : (1u << 8 * size) - 1; }

/* Write the bits that are set in mask and that the register stores. */
static inline void write_bits(uint32_t *word, uint32_t value, uint32_t mask, uint32_t stored) {
  mask &= stored;
  *word = (*word & ~mask) | (value & mask);
}

/* Example: FIELD(cr2, CR2_STOP). The generated header defines the names. */
#define FIELD(value, name) (((value) & (name)) >> name##_SHIFT)

int64_t gcd(int64_t a, int64_t b);

typedef struct Chip Chip;
typedef struct Peripheral Peripheral;

typedef struct {
  /* Read the word at a word-aligned offset, with side effects. *until_ps is NEVER_PS at first. Set it to the
   * time at which the register may change without an access or a scheduled event; polling loops are skipped
   * until that time. Set it to NOT_CACHEABLE_PS if the read has a side effect or the value changes
   * continuously. */
  uint32_t (*read)(Peripheral *peripheral, uint32_t offset, int64_t *until_ps);
  /* Read the word without side effects. */
  uint32_t (*peek)(const Peripheral *peripheral, uint32_t offset);
  /* Write the bits that are set in mask: all bits for a word, or those of the stored byte or half-word. The other
   * bits of value are 0. */
  void (*write)(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask);
  /* Restore the state after reset: system reset, or RCC_xxxRSTR. */
  void (*reset)(Peripheral *peripheral);
  /* The following may be NULL. */
  bool (*is_pure)(const Peripheral *peripheral, uint32_t offset); /* false if read() would give
                                                                     NOT_CACHEABLE_PS */
  bool (*is_redundant_write)(const Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask);
  void (*clocks_changed)(Peripheral *peripheral); /* a frequency has changed */
  void (*gated)(Peripheral *peripheral);          /* peripheral->clocked has changed */
  /* Called when a DMA stream starts to serve a request line. */
  void (*dma_ready)(Peripheral *peripheral);
} PeripheralType;

struct Peripheral {
  const PeripheralType *type;
  Chip *chip;
  uint32_t base, size;
  int32_t index;
  uint32_t noted;  /* reported notes: bit n is the note with id n */
  uint8_t clocked; /* set by RCC; without a clock, a peripheral reads as 0 and ignores writes */
  uint32_t reads_since_write;
  uint8_t memory_like;      /* reads have no side effect; only events and writes change registers */
  uint32_t implemented[32]; /* bit n: a register exists at offset 4 * n, in the first 4 KB */
};

/* offsets: the offsets of its registers; -1 ends the list. */
void peripheral_create(Chip *chip, Peripheral *peripheral, const PeripheralType *type, uint32_t base, uint32_t size,
                       const int16_t *offsets);

/* Pass accesses to all offsets to the peripheral, which reports unknown offsets itself. */
void peripheral_set_all_registers(Peripheral *peripheral);

static inline bool peripheral_has_register(const Peripheral *peripheral, uint32_t address) {
  uint32_t offset = address - peripheral->base;
  return offset < 0x1000 && peripheral->implemented[offset >> 7] >> (offset >> 2 & 31) & 1;
}

/* A read() without side effects, for registers that only events and writes change. */
uint32_t peripheral_read_as_peek(Peripheral *peripheral, uint32_t offset, int64_t *until_ps);

/* -- events: chip.c -------------------------------------------------------------------------------------- */

typedef void (*Fire)(Peripheral *peripheral);

/* Call this when the peripheral is created. Then fire() is called whenever the event is due. */
int event_create(Peripheral *peripheral, Fire fire);
/* A time in the past means now. */
void event_schedule(Chip *chip, int event, int64_t at_ps);
void event_defer(Chip *chip, int event, int64_t at_ps);
void event_cancel(Chip *chip, int event);
/* Return NEVER_PS if the event is not scheduled. */
int64_t event_at(const Chip *chip, int event);

/* -- DMA lines; interrupts: peripheral_set_irq() of chip.h -------------------------------------------- */

/* Call this when the peripheral is created. Then dma_ready() is called when a stream begins to serve the
 * line. */
void dma_connect(Peripheral *peripheral, enum Request line);
/* Make one transfer immediately. Return false if no stream serves the line. */
bool dma_request(Chip *chip, enum Request line);
/* Return 0 if no stream serves the line. */
uint32_t dma_remaining(const Chip *chip, enum Request line);

typedef struct {
  char port;
  uint8_t pin, function;
} PinFunction;

/* Write to `missing` the pins that are not switched to their function, such as "PB10 to AF4, PB3 to AF9".
 * Return true if all pins are switched. Function 255 ends `pins`. */
bool pins_connected(const Chip *chip, const PinFunction *pins, char *missing, size_t size);

/* Call this when the peripheral is created. Then changed() is called at every change of the input level. */
typedef void (*PinChanged)(Peripheral *peripheral, int pin, bool level);
void pin_listen(Peripheral *peripheral, char port, int pin, PinChanged changed);
/* Return -1 if the pin floats. port is an index. */
int pin_level(const Chip *chip, int port, int pin);

/* -- notes about firmware -------------------------------------------------------------------------------- */

enum NoteKind { NOTE_FORBIDDEN, NOTE_NOT_MODELLED, NOTE_REFUSED };

/* Report an access that the firmware should not make. The format begins with the problem's stable name and
 * its values, as in "scl-too-fast scl_khz=%.0f | SCL runs at ...". A note with an id of 0 to 31 is
 * reported only once. For id -1, Python drops repeated texts. */
void peripheral_note(Peripheral *peripheral, int id, enum NoteKind kind, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

#endif
