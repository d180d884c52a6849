/* An I2C block as bus master: peripherals/i2c_sequence.py, and of peripherals/i2c.py what is polled. */
#ifndef FCU_I2C_H
#define FCU_I2C_H

#include "bus.h"

enum { I2C_CR1 = 0x00, I2C_DR = 0x10, I2C_SR1 = 0x14, I2C_SR2 = 0x18 };

/* What an address is answered with. */
enum Answer { ANSWER_ACK, ANSWER_NACK, ANSWER_BUS_ERROR, ANSWER_ARBITRATION };

/* What firmware did wrong. */
enum Wrong { WRONG_DATA_LOST, WRONG_STOP_EARLY };

/* The bytes on the wire, each called at its end (emulator/i2c_wire.py). */
typedef struct {
  int32_t (*address)(int64_t now_ps, int32_t address, int64_t start_ps);
  int32_t (*write)(int64_t now_ps, int32_t value); /* whether it was acknowledged */
  int32_t (*read)(int64_t now_ps);
  void (*stop)(int64_t now_ps);
  void (*abort)(void);
  int64_t (*released_ps)(int64_t now_ps); /* when a line that is held low is let go; 0 if none is */
  void (*note)(int64_t now_ps, int32_t wrong);
} Wire;

/* What happens when the operation under way ends. */
enum Then {
  THEN_GO_ON,
  THEN_STARTED,
  THEN_STOPPED,
  THEN_RELEASED,
  THEN_ADDRESS_SENT,
  THEN_SENT,
  THEN_RECEIVED,
};

/* What happens on the wire, or what the block waits for while it holds SCL low. */
enum Phase { IDLE, BUSY_NOW, ADDRESS, ADDRESSED, SEND, FULL, ENDED };

#define AHEAD 16

/* Numbers are of 64 bits, so that native_i2c.py can see it without a thought to padding. */
struct I2c {
  int64_t control, status1, status2, data; /* CR1, SR1, SR2, DR */
  int64_t due_ps;                          /* when the operation under way ends */
  int64_t nack_next;                       /* DMA has announced the last byte */
  int64_t seen;                            /* SR1 as last read */
  int64_t alone;                           /* whether neither interrupts nor DMA nor faults need Python */
  int64_t checked;                         /* whether the settings have been looked at since they changed */
  int64_t may_be_held;                     /* whether released_ps is worth asking */
  int64_t bit_ps, byte_ps;                 /* one period of SCL, and the nine of a byte */
  int64_t told, taken;                     /* how many bytes Python has told ahead, how many were read, */
  int64_t told_until_ps;                   /* and until when the device will send these */
  uint8_t ahead[AHEAD];
  int64_t then, phase;
  int64_t shift, waiting, shift_full, acknowledge, start_ps;
  Wire wire;
};

I2c *i2c_create(Wire wire);
void i2c_reset(I2c *i2c);
/* Carry out what was due by now. */
void i2c_settle(I2c *i2c, int64_t now_ps);
void i2c_request(I2c *i2c, int64_t control, int64_t now_ps);
void i2c_clear_addr(I2c *i2c, int64_t now_ps);
void i2c_write_data(I2c *i2c, int64_t value, int64_t now_ps);
int64_t i2c_read_data(I2c *i2c, int64_t now_ps);

/* -- i2c_registers.c: what can be done without Python --------------------------------------------------- */

bool i2c_readable(uint32_t offset);
/* *until_ps is when the register may read differently next; -1 if the read has a side effect. */
uint32_t i2c_read(I2c *i2c, uint32_t offset, int64_t now_ps, int64_t *until_ps);
bool i2c_writable(const I2c *i2c, uint32_t offset, uint32_t value);
void i2c_write(I2c *i2c, uint32_t offset, uint32_t value, int64_t now_ps);

#endif
