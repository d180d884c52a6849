/* Registers of the I2C block that polled transfers need (RM0368 section 18.6): peripherals/i2c.py in C. */
#include "i2c.h"
#include "i2c_bits.h"

bool i2c_readable(uint32_t offset) {
  return offset == I2C_SR1 || offset == I2C_SR2 || offset == I2C_DR || offset == I2C_CR1;
}

uint32_t i2c_read(I2c *i2c, uint32_t offset, int64_t now_ps, int64_t *until_ps) {
  *until_ps = i2c->due_ps;
  if (offset == I2C_SR1) {
    i2c->seen = i2c->status1;
    return (uint32_t)i2c->status1;
  }
  if (offset == I2C_CR1) {
    return (uint32_t)i2c->control;
  }
  if (offset == I2C_DR) {
    *until_ps = -1;
    return (uint32_t)i2c_read_data(i2c, now_ps);
  }
  uint32_t status = (uint32_t)i2c->status2;
  if (i2c->status1 & ADDR) {
    *until_ps = -1;
    if (i2c->seen & ADDR) { /* SR1, then SR2 clears it */
      i2c->seen = 0;
      i2c_clear_addr(i2c, now_ps);
    }
  }
  return status;
}

bool i2c_writable(const I2c *i2c, uint32_t offset, uint32_t value) {
  if (offset != I2C_CR1) {
    return offset == I2C_DR || offset == I2C_SR1;
  }
  bool stays_on = i2c->control & PE && value & PE && !(value & SWRST);
  return stays_on && !(value & CR1_NOT_MODELLED) && (i2c->checked || !(value & START));
}

void i2c_write(I2c *i2c, uint32_t offset, uint32_t value, int64_t now_ps) {
  if (offset == I2C_DR) {
    i2c_write_data(i2c, value & 0xFF, now_ps);
  } else if (offset == I2C_SR1) {
    i2c->status1 &= value | ~ERRORS;
  } else {
    i2c_request(i2c, value & CR1_WRITABLE, now_ps);
  }
}
