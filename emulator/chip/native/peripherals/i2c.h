/* I2C1 to I2C3 (RM0368 section 18); i2c.c explains it. */
#ifndef FCU_I2C_H
#define FCU_I2C_H

#include "peripherals/read_cache.h"

#define I2C_COUNT 3
#define I2C_PINS 2
#define I2C_BYTES 64
#define I2C_RECENT 8 /* as many as emulator/buses/i2c.py keeps */

/* A message: the bytes between a start and a stop on the wire; Python reads this struct. */
typedef struct {
  int64_t open;
  int64_t live; /* Python's side of the bus takes part: it has the message except for the bytes below */
  int64_t start_ps, end_ps;
  int64_t address, reading, target; /* target: its index, or -1 */
  int64_t written, subaddress;      /* the number of bytes written, and the first of them */
  int64_t count;                    /* received and not reported to Python yet */
  uint8_t bytes[I2C_BYTES];
} I2cMessage;

/* Callbacks into Python: a byte on the wire, each at its end. While message.open is set, each callback first
 * processes the bytes that C has handled alone. */
typedef struct {
  int32_t (*start)(int64_t now_ps, int32_t address, int64_t start_ps); /* the address byte; enum Answer */
  int32_t (*write)(int64_t now_ps, int32_t value);                    /* returns 1 if it was acknowledged */
  /* Returns the byte, plus 256 times the number of bytes in chip->read_cache.prefetched. */
  int32_t (*read)(int64_t now_ps);
  void (*stop)(int64_t now_ps, int64_t end_ps); /* the message ended at end_ps */
  void (*abort)(int64_t now_ps);                /* the master releases the bus without a stop */
  void (*ended)(int64_t now_ps); /* a message that C handled alone is in recent[]; while chip->detailed */
  int64_t (*released_ps)(int64_t now_ps);       /* the time when a line held low is released; 0 if none is */
  void (*set_speed)(int64_t now_ps, int64_t hz);
} I2cCalls;

/* The state of a bus that Python reads and writes. */
typedef struct {
  int64_t has_faults; /* faults: nothing is cached */
  int64_t ended;    /* messages so far that C handled alone */
  I2cMessage message; /* in progress */
  I2cMessage recent[I2C_RECENT];
  int8_t target_index[128]; /* by address; -1: no device, or one without a cache */
} I2cWire;

typedef struct {
  Peripheral peripheral;
  uint32_t cr1, cr2, oar1, oar2, sr1, sr2, dr, ccr, trise, fltr;
  int32_t event;
  uint8_t phase, completion;
  uint8_t wants_events;     /* an interrupt or DMA waits for flags */
  uint8_t in_dma;     /* DMA requests are being made */
  uint8_t settings_checked;     /* the settings have been checked since their last change */
  uint8_t nack_next;   /* DMA has announced the last byte */
  uint8_t dr_full;     /* to be sent: DR contains a byte that the shift register has not taken yet */
  uint8_t shift_full;  /* received: DR was full when the byte arrived */
  uint8_t acknowledge; /* with POS: the answer to the next byte */
  uint8_t shift;
  uint8_t from_cache;        /* received bytes come from the read cache */
  uint32_t last_sr1;       /* SR1 as last read */
  int64_t bit_ps, byte_ps, start_ps;
  int64_t speed_hz, shortest_ps;
  PinFunction pins[I2C_PINS + 1];
  I2cCalls calls;
  I2cWire wire;
} I2c;

void i2c_create(Chip *chip);

#endif
