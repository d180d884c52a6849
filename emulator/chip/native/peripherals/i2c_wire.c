/* Messages on an I2C bus. C answers reads from the sensors' registers if possible.
 *
 * The bus is in Python (emulator/buses/i2c_wire.py), which is called at the end of each byte. A message "sub-address,
 * repeated start, read" of registers that C reads (sensor_registers.h) needs no call; Python fetches this message
 * later, when Python needs it.
 */
#include "fcu.h"

static int64_t now_ps(const I2c *i2c) { return i2c->peripheral.chip->now_ps; }

static Target *target_of(I2c *i2c) {
  int64_t target = i2c->wire.message.target;
  return target < 0 ? NULL : &i2c->peripheral.chip->sensor_registers.target[target];
}

/* Return true if C, without Python, can answer the address and read the target's registers. */
static bool is_readable(I2c *i2c) {
  return !i2c->wire.has_faults && i2c->wire.message.target >= 0 &&
         target_answers(i2c->peripheral.chip, target_of(i2c));
}

void i2c_wire_end(I2c *i2c, int64_t end_ps) {
  I2cWire *wire = &i2c->wire;
  if (!wire->message.open) {
    return;
  }
  i2c->reads_registers = 0;
  if (wire->message.live) {
    i2c->calls.stop(now_ps(i2c), end_ps);
    wire->message.open = 0;
    return;
  }
  wire->message.open = 0;
  wire->message.end_ps = end_ps;
  wire->recent[wire->ended++ % I2C_RECENT] = wire->message;
  if (i2c->peripheral.chip->detailed) {
    i2c->calls.ended(now_ps(i2c));
  }
}

void i2c_wire_abort(I2c *i2c) {
  if (i2c->wire.message.open) {
    i2c->reads_registers = 0;
    i2c->calls.abort(now_ps(i2c));
    i2c->wire.message.open = 0;
  }
}

static enum Answer begin_message(I2c *i2c) {
  I2cMessage *message = &i2c->wire.message;
  bool reading = i2c->shift & 1;
  i2c_wire_end(i2c, i2c->start_ps);
  message->target = i2c->wire.target_index[i2c->shift >> 1];
  message->start_ps = i2c->start_ps;
  message->address = i2c->shift >> 1;
  message->reading = message->written = message->count = 0;
  if (is_readable(i2c) && (!reading || target_is_readable(i2c->peripheral.chip, target_of(i2c)))) {
    message->live = 0;
    message->open = 1;
    message->reading = i2c->reads_registers = reading;
    return ANSWER_ACK;
  }
  message->live = 1;
  int32_t answer = i2c->calls.start(now_ps(i2c), i2c->shift, i2c->start_ps);
  message->open = 1;
  message->reading = reading;
  return (enum Answer)answer;
}

enum Answer i2c_wire_address(I2c *i2c) {
  I2cMessage *message = &i2c->wire.message;
  bool is_same = message->open && message->address == i2c->shift >> 1;
  i2c->reads_registers = 0;
  if (!is_same || !(i2c->shift & 1) || message->reading) {
    return begin_message(i2c);
  }
  Chip *chip = i2c->peripheral.chip;
  if (!message->live && message->written && is_readable(i2c) && target_is_readable(chip, target_of(i2c))) {
    message->reading = i2c->reads_registers = 1;
    return ANSWER_ACK;
  }
  int32_t answer = i2c->calls.start(now_ps(i2c), i2c->shift, i2c->start_ps);
  message->reading = 1;
  if (answer == ANSWER_ACK && message->written == 1 && is_readable(i2c)) {
    target_set_position(chip, target_of(i2c), (uint8_t)message->subaddress);
    i2c->reads_registers = 1;
  }
  return (enum Answer)answer;
}

bool i2c_wire_write(I2c *i2c) {
  I2cMessage *message = &i2c->wire.message;
  bool is_first = message->written == 0;
  message->written += message->written < 2;
  if (is_first) {
    message->subaddress = i2c->shift;
    if (!message->live) {
      target_set_position(i2c->peripheral.chip, target_of(i2c), i2c->shift);
      return true;
    }
  }
  return i2c->calls.write(now_ps(i2c), i2c->shift);
}

uint8_t i2c_wire_read(I2c *i2c) {
  I2cMessage *message = &i2c->wire.message;
  Chip *chip = i2c->peripheral.chip;
  uint8_t byte;
  if (i2c->reads_registers && message->count < I2C_BYTES && target_read(chip, target_of(i2c), &byte)) {
    message->bytes[message->count++] = byte;
    return byte;
  }
  int32_t answer = i2c->calls.read(now_ps(i2c));
  i2c->reads_registers = answer >> 8 != 0;
  if (i2c->reads_registers) {
    target_set_position(chip, target_of(i2c), (uint8_t)((answer >> 8) - 1));
  }
  return (uint8_t)answer;
}

int64_t i2c_wire_released_ps(const I2c *i2c) {
  return i2c->wire.has_faults ? i2c->calls.released_ps(now_ps(i2c)) : 0;
}

I2cWire *fcu_i2c_wire(Chip *chip, int32_t number) { return &chip->i2c[number].wire; }
