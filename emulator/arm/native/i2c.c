/* What an I2C block does on the wire as bus master (RM0368 section 18.3.3): peripherals/i2c_sequence.py in C,
 * which explains it. Each function here has its name there. */
#include "i2c.h"

#include <stdlib.h>

#include "i2c_bits.h"

I2c *i2c_create(Wire wire) {
  I2c *i2c = calloc(1, sizeof(I2c));
  if (i2c) {
    i2c->wire = wire;
    i2c->bit_ps = i2c->byte_ps = i2c->due_ps = NEVER_PS;
  }
  return i2c;
}

void i2c_destroy(I2c *i2c) { free(i2c); }

void i2c_reset(I2c *i2c) {
  i2c->wire.abort();
  i2c->control = i2c->status1 = i2c->status2 = i2c->data = 0;
  i2c->due_ps = NEVER_PS;
  i2c->nack_next = 0;
  i2c->then = THEN_GO_ON;
  i2c->phase = IDLE;
  i2c->shift = i2c->waiting = i2c->shift_full = i2c->acknowledge = i2c->start_ps = 0;
}

/* -- operations ----------------------------------------------------------------------------------------- */

static void plan(I2c *i2c, int64_t at_ps, enum Then then) {
  i2c->due_ps = at_ps;
  i2c->then = then;
}

static void begin(I2c *i2c, int64_t duration_ps, enum Then then, int64_t now_ps) {
  i2c->phase = BUSY_NOW;
  if (duration_ps < NEVER_PS) {
    plan(i2c, now_ps + duration_ps, then);
  }
}

static void start(I2c *i2c, int64_t now_ps) {
  i2c->start_ps = now_ps;
  i2c->status2 |= BUSY;
  begin(i2c, i2c->bit_ps, THEN_STARTED, now_ps);
}

static void start_when_free(I2c *i2c, int64_t now_ps) {
  int64_t released_ps = i2c->may_be_held ? i2c->wire.released_ps(now_ps) : 0;
  if (released_ps) {
    i2c->phase = BUSY_NOW;
    plan(i2c, released_ps, THEN_RELEASED);
  } else {
    start(i2c, now_ps);
  }
}

/* Obey STOP or START between two bytes; false if neither is asked for. */
static bool stop_or_start(I2c *i2c, int64_t now_ps) {
  if (!(i2c->control & (START | STOP))) {
    return false;
  }
  if (i2c->waiting && !(i2c->status1 & AF)) {
    i2c->wire.note(now_ps, WRONG_STOP_EARLY);
  }
  if (i2c->control & STOP) {
    begin(i2c, i2c->bit_ps, THEN_STOPPED, now_ps);
  } else {
    start(i2c, now_ps);
  }
  return true;
}

static void go_on(I2c *i2c, int64_t now_ps) {
  switch (i2c->phase) {
  case IDLE:
    i2c->control &= ~STOP;
    if (i2c->control & START) {
      start_when_free(i2c, now_ps);
    }
    break;
  case ADDRESS:
  case SEND:
  case FULL:
  case ENDED:
    stop_or_start(i2c, now_ps);
    break;
  }
}

/* A start or stop condition leaves nothing of a transmission; received bytes stay. */
static void end_of_sending(I2c *i2c) {
  if (i2c->status2 & TRA) {
    i2c->status1 &= ~(TXE | BTF);
  }
  i2c->waiting = 0;
}

static void started(I2c *i2c) {
  i2c->control &= ~START;
  end_of_sending(i2c);
  i2c->status1 |= SB;
  i2c->status2 = MSL | BUSY;
  i2c->phase = ADDRESS;
}

static void stopped(I2c *i2c, int64_t now_ps) {
  i2c->wire.stop(now_ps);
  i2c->control &= ~STOP;
  end_of_sending(i2c);
  i2c->status1 &= ~SB;
  i2c->status2 = 0;
  i2c->phase = IDLE;
  go_on(i2c, now_ps);
}

static void failed(I2c *i2c, int64_t flag, int64_t now_ps) {
  i2c->status1 |= flag;
  i2c->phase = ENDED;
  stop_or_start(i2c, now_ps);
}

static void address_sent(I2c *i2c, int64_t now_ps) {
  switch (i2c->wire.address(now_ps, (int32_t)i2c->shift, i2c->start_ps)) {
  case ANSWER_ACK:
    i2c->status1 |= ADDR;
    i2c->status2 |= i2c->shift & 1 ? 0 : TRA;
    i2c->acknowledge = (i2c->control & ACK) != 0;
    i2c->phase = ADDRESSED;
    break;
  case ANSWER_ARBITRATION:
    i2c->wire.abort();
    i2c->status1 |= ARLO;
    i2c->status2 = 0;
    i2c->phase = IDLE;
    break;
  case ANSWER_BUS_ERROR:
    failed(i2c, BERR, now_ps);
    break;
  default:
    failed(i2c, AF, now_ps);
  }
}

static void send(I2c *i2c, int64_t now_ps) {
  i2c->shift = i2c->data;
  i2c->waiting = 0;
  i2c->status1 |= TXE;
  begin(i2c, i2c->byte_ps, THEN_SENT, now_ps);
}

static void sent(I2c *i2c, int64_t now_ps) {
  if (!i2c->wire.write(now_ps, (int32_t)i2c->shift)) {
    failed(i2c, AF, now_ps);
  } else if (stop_or_start(i2c, now_ps)) {
    return;
  } else if (i2c->waiting) {
    send(i2c, now_ps);
  } else {
    i2c->status1 |= BTF;
    i2c->phase = SEND;
  }
}

/* Whether the byte just received is acknowledged (ACK, POS, and LAST with DMA). */
static bool answer(I2c *i2c) {
  bool now = (i2c->control & ACK) != 0;
  bool acknowledged = i2c->control & POS ? i2c->acknowledge != 0 : now;
  i2c->acknowledge = now;
  if (i2c->nack_next) {
    i2c->nack_next = 0;
    return false;
  }
  return acknowledged;
}

static void received(I2c *i2c, int64_t now_ps) {
  bool is_told = i2c->taken < i2c->told && now_ps < i2c->told_until_ps;
  int64_t value = is_told ? i2c->ahead[i2c->taken++] : i2c->wire.read(now_ps);
  bool acknowledged = answer(i2c);
  if (i2c->status1 & RXNE) {
    i2c->shift = value;
    i2c->shift_full = 1;
    i2c->status1 |= BTF;
  } else {
    i2c->data = value;
    i2c->status1 |= RXNE;
  }
  if (stop_or_start(i2c, now_ps)) {
    return;
  }
  if (!acknowledged) {
    i2c->phase = ENDED;
  } else if (i2c->shift_full) {
    i2c->phase = FULL;
  } else {
    begin(i2c, i2c->byte_ps, THEN_RECEIVED, now_ps);
  }
}

void i2c_settle(I2c *i2c, int64_t now_ps) {
  while (i2c->due_ps <= now_ps) {
    int64_t at_ps = i2c->due_ps;
    i2c->due_ps = NEVER_PS;
    switch (i2c->then) {
    case THEN_STARTED: started(i2c); break;
    case THEN_STOPPED: stopped(i2c, at_ps); break;
    case THEN_ADDRESS_SENT: address_sent(i2c, at_ps); break;
    case THEN_SENT: sent(i2c, at_ps); break;
    case THEN_RECEIVED: received(i2c, at_ps); break;
    case THEN_RELEASED:
      i2c->phase = IDLE;
      go_on(i2c, at_ps);
      break;
    default: go_on(i2c, at_ps);
    }
  }
}

/* -- what software does --------------------------------------------------------------------------------- */

void i2c_request(I2c *i2c, int64_t control, int64_t now_ps) {
  i2c->control = control;
  go_on(i2c, now_ps);
}

void i2c_clear_addr(I2c *i2c, int64_t now_ps) {
  i2c->status1 &= ~ADDR;
  if (!(i2c->status2 & TRA)) {
    begin(i2c, i2c->byte_ps, THEN_RECEIVED, now_ps);
    return;
  }
  i2c->phase = SEND;
  if (i2c->waiting) {
    send(i2c, now_ps);
  } else {
    i2c->status1 |= TXE;
    stop_or_start(i2c, now_ps);
  }
}

void i2c_write_data(I2c *i2c, int64_t value, int64_t now_ps) {
  if (i2c->phase == ADDRESS) {
    i2c->status1 &= ~SB;
    i2c->shift = value;
    begin(i2c, i2c->byte_ps, THEN_ADDRESS_SENT, now_ps);
  } else if (i2c->status2 & TRA) {
    if (i2c->waiting) {
      i2c->wire.note(now_ps, WRONG_DATA_LOST);
    }
    i2c->status1 &= ~BTF;
    i2c->data = value;
    if (i2c->phase == SEND) {
      send(i2c, now_ps);
    } else {
      i2c->waiting = 1;
      i2c->status1 &= ~TXE;
    }
  }
}

int64_t i2c_read_data(I2c *i2c, int64_t now_ps) {
  int64_t value = i2c->data;
  if (i2c->shift_full) {
    i2c->data = i2c->shift;
    i2c->shift_full = 0;
    i2c->status1 &= ~BTF;
    if (i2c->phase == FULL) {
      begin(i2c, i2c->byte_ps, THEN_RECEIVED, now_ps);
    }
  } else {
    i2c->status1 &= ~RXNE;
  }
  return value;
}
