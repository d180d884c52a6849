/* What every block of the chip has in common: its place in the memory map, its clock, its events, its interrupt
 * and DMA request lines, and what it says about firmware.
 *
 * A block is a struct whose first member is a Block, inside of struct Chip; its file has, in this order, a
 * comment that cites the manual and lists what is NOT MODELLED, register offsets and bits in the manual's
 * spelling, the functions of its BlockType, and X_create(). All state is plain data inside the struct: a
 * snapshot of the chip is a copy. There are no statics but constants.
 *
 * Time: chip->now_ps is the exact time of the access or event that is being carried out. Everything due by then
 * has been carried out before a block is called. A block either computes its state from the time when it is
 * looked at, or plans an event. A scheduled event ends the run of instructions under way and is for what may
 * raise an interrupt, move a pin or start a transfer by DMA; a deferred one happens at its time as well, and in
 * order with all others, but is carried out only when something looks (the next access to any register, the
 * next event, the end of a run), so that it costs no run its end.
 */
#ifndef FCU_BLOCK_H
#define FCU_BLOCK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

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
typedef struct Block Block;

typedef struct {
  /* The word at a word-aligned offset, side effects included. *until_ps arrives as NEVER_PS: make it the time
   * when the register may next read differently without an access and without a scheduled event, or ALREADY_PS
   * where the read has a side effect or the value runs with time. Loops that poll are skipped by it. */
  uint32_t (*read)(Block *block, uint32_t offset, int64_t *until_ps);
  /* The same without any side effect. */
  uint32_t (*peek)(const Block *block, uint32_t offset);
  /* Write the bits of mask (bytes or half-words where firmware stores those). value is already masked. */
  void (*write)(Block *block, uint32_t offset, uint32_t value, uint32_t mask);
  /* Back to the state after reset: system reset, or the block's bit in RCC_xxxRSTR. */
  void (*reset)(Block *block);
  /* All below may be NULL. */
  bool (*is_pure)(const Block *block, uint32_t offset); /* false where read() would give ALREADY_PS now */
  bool (*changes_nothing)(const Block *block, uint32_t offset, uint32_t value, uint32_t mask);
  void (*clocks_changed)(Block *block); /* a frequency of the clock tree is another one */
  void (*gated)(Block *block);          /* block->clocked has changed */
  void (*dma_ready)(Block *block);      /* a stream has begun to serve one of the block's request lines */
} BlockType;

struct Block {
  const BlockType *type;
  Chip *chip;
  uint32_t base, size;
  int32_t index;    /* among the chip's blocks; Python knows the name by it */
  uint32_t noted;   /* which notes have been reported: bit = id */
  uint8_t clocked;  /* RCC: a block without clock reads as 0 and forgets writes */
  uint32_t looks;    /* reads since the last write */
  uint8_t steady;    /* registers change by scheduled events and writes only, and reads do nothing: one that is
                        polled all the time is read like memory */
  uint32_t known[32]; /* bit = offset / 4: registers that exist in the first four kilobytes */
};

/* -- blocks --------------------------------------------------------------------------------------------- */

/* Put a block into the memory map. offsets: its registers; -1 ends them. */
void block_create(Chip *chip, Block *block, const BlockType *type, uint32_t base, uint32_t size,
                  const int16_t *offsets);

/* All of its offsets reach the block, which reports by itself those that are no register. */
void block_knows_all(Block *block);

static inline bool block_knows(const Block *block, uint32_t address) {
  uint32_t offset = address - block->base;
  return offset < 0x1000 && block->known[offset >> 7] >> (offset >> 2 & 31) & 1;
}

/* -- events: chip.c -------------------------------------------------------------------------------------- */

typedef void (*Fire)(Block *block);

/* At creation: an event of the block, not planned yet. fire() is called with chip->now_ps at its time. */
int event_create(Block *block, Fire fire);
/* Plan it (anew). A time that has passed already means now. */
void event_schedule(Chip *chip, int event, int64_t at_ps);
void event_defer(Chip *chip, int event, int64_t at_ps);
void event_cancel(Chip *chip, int event);
/* NEVER_PS if it is not planned. */
int64_t event_at(const Chip *chip, int event);

/* -- lines ----------------------------------------------------------------------------------------------- */

/* Interrupts: block_set_irq() of chip.h. */

/* DMA request lines (RM0368 tables 28 and 29), in the order of their names in peripherals/dma.py. */
enum Request {
  REQUEST_NONE,
  REQUEST_ADC1,
  REQUEST_I2C1_RX, REQUEST_I2C1_TX, REQUEST_I2C2_RX, REQUEST_I2C2_TX, REQUEST_I2C3_RX, REQUEST_I2C3_TX,
  REQUEST_SPI1_RX, REQUEST_SPI1_TX, REQUEST_SPI2_RX, REQUEST_SPI2_TX, REQUEST_SPI3_RX, REQUEST_SPI3_TX,
  REQUEST_USART1_RX, REQUEST_USART1_TX, REQUEST_USART2_RX, REQUEST_USART2_TX,
  REQUEST_USART6_RX, REQUEST_USART6_TX,
  REQUEST_TIM1_UP, REQUEST_TIM2_UP, REQUEST_TIM3_UP, REQUEST_TIM4_UP, REQUEST_TIM5_UP,
  REQUESTS
};
/* At creation: dma_ready() of the block is called when a stream begins to serve the line. */
void dma_connect(Block *block, enum Request line);
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
typedef void (*PinChanged)(Block *block, int pin, bool level);
void pin_listen(Block *block, char port, int pin, PinChanged changed);
/* The level that results; -1 while the pin floats. port: its index. */
int pin_level(const Chip *chip, int port, int pin);

/* -- what firmware should know --------------------------------------------------------------------------- */

enum NoteKind { NOTE_FORBIDDEN, NOTE_NOT_MODELLED, NOTE_REFUSED };

/* Put a note into the trace. id: 0 to 31, this note of this block is reported once only; -1: Python leaves out
 * texts that it has had. */
void block_note(Block *block, int id, enum NoteKind kind, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

#endif
