/* I2C1 to I2C3 (RM0368 section 18). */
#ifndef FCU_I2C_H
#define FCU_I2C_H

#include "peripherals/sensor_registers.h"

#define I2C_COUNT 3
#define I2C_PINS 2
#define I2C_BYTES 64
#define I2C_RECENT 8 /* as in emulator/buses/i2c.py */

/* A message from start to stop. Python reads this struct. */
typedef struct {
  int64_t open;
  /* Python handles the message. Only the bytes below, which C has read from registers, are still
     unknown to Python. */
  int64_t live;
  int64_t start_ps, end_ps;
  int64_t address, reading, target;
  /* number of written bytes (0, 1, or 2 for two or more), and the first written byte */
  int64_t written, subaddress;
  int64_t count;               /* number of bytes that Python has not received */
  uint8_t bytes[I2C_BYTES];
} I2cMessage;

/* Callbacks into Python at the end of a byte. If message.open is set, Python first takes over the bytes that
 * C has handled.
 */
typedef struct {
  int32_t (*start)(int64_t now_ps, int32_t address, int64_t start_ps); /* returns enum Answer */
  int32_t (*write)(int64_t now_ps, int32_t value);                     /* returns 1 if acknowledged */
  /* Return the byte. If C may read the next bytes, add 256 * (1 + the next sub-address). */
  int32_t (*read)(int64_t now_ps);
  void (*stop)(int64_t now_ps, int64_t end_ps);
  void (*abort)(int64_t now_ps);
  void (*ended)(int64_t now_ps);          /* recent[] has a new message; called only if chip->detailed is set */
  int64_t (*released_ps)(int64_t now_ps); /* 0 if no line is held low */
  void (*set_speed)(int64_t now_ps, int64_t hz);
} I2cCalls;

typedef struct {
  int64_t has_faults; /* Python handles every read */
  int64_t ended;
  I2cMessage message;
  I2cMessage recent[I2C_RECENT];
  int8_t target_index[128]; /* index: address; -1 if Python handles reads */
} I2cWire;

typedef struct {
  Peripheral peripheral;
  uint32_t cr1, cr2, oar1, oar2, sr1, sr2, dr, ccr, trise, fltr;
  int32_t event;
  uint8_t phase, completion;
  uint8_t wants_events; /* an interrupt or DMA waits for flags */
  uint8_t in_dma;       /* a DMA request is being served */
  uint8_t settings_checked;
  uint8_t nack_next;   /* LAST: the next byte ends the DMA transfer, so it is not acknowledged */
  uint8_t dr_full;     /* a byte in DR waits for the shift register */
  uint8_t shift_full;  /* the latest byte arrived while DR was full */
  uint8_t acknowledge; /* value of ACK at the end of the previous byte; applies to the present byte if POS is set */
  uint8_t shift;
  uint8_t reads_registers; /* bytes come from sensor_registers.h if possible */
  uint32_t last_sr1;
  int64_t bit_ps, byte_ps, start_ps;
  int64_t speed_hz, shortest_ps;
  PinFunction pins[I2C_PINS + 1];
  I2cCalls calls;
  I2cWire wire;
} I2c;

void i2c_create(Chip *chip);

/* -- i2c_wire.c ------------------------------------------------------------------------------------------ */

/* Callbacks in the order of peripherals/i2c.py. */
enum Answer { ANSWER_ACK, ANSWER_NACK, ANSWER_BUS_ERROR, ANSWER_ARBITRATION };

/* Send the address byte in the shift register. */
enum Answer i2c_wire_address(I2c *i2c);
/* Send the byte in the shift register; return true if it was acknowledged. */
bool i2c_wire_write(I2c *i2c);
uint8_t i2c_wire_read(I2c *i2c);
/* The message has ended with a stop condition at end_ps, or without a stop condition. */
void i2c_wire_end(I2c *i2c, int64_t end_ps);
void i2c_wire_abort(I2c *i2c);
/* Return the time at which the held line is released, or 0 if no line is held low. */
int64_t i2c_wire_released_ps(const I2c *i2c);

#endif
