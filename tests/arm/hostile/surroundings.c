/* What Python is to the library, in C: rare blocks that are mere memory, parts at the buses that answer anything, a
 * world in which something happens every few microseconds. It does what the callbacks' comments allow, and no more.
 */
#include <string.h>

#include "hostile.h"

#define PORT_B 1
#define PARTS 3
#define LAST_USART 2

static uint32_t registers[1024]; /* of blocks in Python */
static uint64_t versions[TARGETS];
static int32_t usarts[USARTS];

/* As Python does at the beginning of each callback. */
static void settle(void) {
  if (any(8) == 0) {
    versions[any(TARGETS)]++;
  }
}

void set_some_clocks(Chip *chip) {
  static const int64_t usual[] = {0, 32768, 1000000, 16000000, 16000000, 84000000, 84000000, 25000000};
  int64_t sysclk = any(8) ? usual[any(8)] : any(0), hclk = sysclk >> (any(3) ? 0 : 1 + any(9));
  int64_t pclk1 = hclk >> any(5), pclk2 = hclk >> any(5);
  Clocks clocks = {sysclk, hclk, pclk1, pclk2, pclk1 == hclk ? pclk1 : 2 * pclk1, pclk2 == hclk ? pclk2 : 2 * pclk2};
  fcu_set_clocks(chip, &clocks);
}

/* What comes from outside of the chip. */
static void happen(Chip *chip) {
  int32_t port = (int32_t)any(PORTS), pin = (int32_t)any(16), block = usarts[any(USARTS)];
  switch (any(8)) {
  case 0: fcu_usart_receive(chip, block, (int32_t)any(256)); break;
  case 1: fcu_usart_line_idle(chip, block); break;
  case 2: fcu_set_irq(chip, (int32_t)any(INTERRUPTS), (int32_t)any(2)); break;
  case 3: fcu_set_exti_line(chip, 16 + (int32_t)any(7), (int32_t)any(2)); break;
  case 4: fcu_dma_request(chip, REQUEST_ADC1); break;
  default: fcu_drive_pin(chip, port, pin, (int32_t)any(3) - 1); break;
  }
}

/* What a write to RCC or another rare block may mean. */
static void obey(Chip *chip) {
  int32_t block = (int32_t)any((uint32_t)fcu_peripheral_count(chip));
  switch (any(13)) {
  case 0:
  case 1: set_some_clocks(chip); break;
  case 2: fcu_gate(chip, UINT64_C(1) << block, 0); break;
  case 3: fcu_gate(chip, UINT64_C(1) << block, UINT64_MAX); break;
  case 4: fcu_reset_peripherals(chip, UINT64_C(1) << block); break;
  case 8: fcu_gate_python(chip, PERIPHERALS_BASE + any(PERIPHERALS_SIZE), any(2)); break;
  case 5: fcu_request_reset(chip, 1 + (int32_t)any(5)); break;
  case 6: fcu_set_irq(chip, (int32_t)any(INTERRUPTS), (int32_t)any(2)); break;
  case 7: chip->must_stop = any(16) == 0; break;
  default: break;
  }
}

/* -- struct Host ---------------------------------------------------------------------------------------------- */

static void advance(int64_t now_ps) {
  settle();
  happen(hostile.chip);
  hostile.chip->host_next_ps = now_ps + ((int64_t)(1 + any(1000)) << any(31));
}

static uint32_t read_register(int64_t now_ps, uint32_t address, uint32_t size) {
  settle();
  uint32_t word = registers[address >> 2 & 1023];
  hostile.chip->until_ps = any(2) ? NEVER_PS : now_ps + any(5000000);
  if (any(3) == 0) { /* flags that firmware waits for come and go */
    word ^= any(0);
    hostile.chip->until_ps = NOT_CACHEABLE_PS - (int64_t)any(64) / 62; /* NO_REGISTER_PS sometimes */
  }
  word >>= 8 * (address & 3);
  return size == 4 ? word : word & ((1u << 8 * size) - 1);
}

static void write_register(int64_t now_ps, uint32_t address, uint32_t size, uint32_t value) {
  (void)now_ps, (void)size;
  settle();
  registers[address >> 2 & 1023] = value;
  obey(hostile.chip);
}

static void note(int64_t now_ps, int32_t block, int32_t kind, const char *text) {
  (void)now_ps, (void)block, (void)kind;
  hostile.notes += strlen(text) > 0;
}

static int32_t ignored_access(int64_t now_ps, int32_t block, uint32_t offset, int32_t what, uint32_t value) {
  (void)now_ps, (void)block, (void)offset, (void)what, (void)value;
  settle();
  return 1;
}

static void fault(int64_t now_ps, int32_t exception, uint32_t cfsr, uint32_t hfsr, uint32_t address) {
  (void)now_ps, (void)exception, (void)cfsr, (void)hfsr, (void)address;
  hostile.faults++;
}

static void locked_up(int64_t now_ps, uint32_t pc) {
  (void)now_ps, (void)pc;
  hostile.lock_ups++;
  if (any(2)) {
    fcu_request_reset(hostile.chip, 2); /* a watchdog's */
  }
}

static void reset(int64_t now_ps, int32_t reason) {
  Chip *chip = hostile.chip;
  (void)now_ps, (void)reason;
  settle();
  hostile.resets++;
  for (int32_t index = 0; index < fcu_peripheral_count(chip); index++) {
    fcu_reset_peripherals(chip, UINT64_C(1) << index);
    fcu_gate(chip, UINT64_C(1) << index, any(16) != 0 ? UINT64_MAX : 0);
  }
  set_some_clocks(chip);
}

static void accessed(int64_t now_ps, uint32_t address, uint32_t size, int32_t written) {
  (void)now_ps, (void)address, (void)size, (void)written;
  if (any(16) == 0) {
    fcu_halt(hostile.chip);
  }
}

static int64_t deep_sleep(int64_t now_ps) {
  static const int64_t results[] = {DEEP_REFUSED, DEEP_WITH_CLOCKS, DEEP_STANDBY};
  (void)now_ps;
  settle();
  return any(2) ? results[any(3)] : (int64_t)any(1u << 30);
}

static void stop_ended(int64_t now_ps) {
  (void)now_ps;
  settle();
  set_some_clocks(hostile.chip);
}

const Host host_calls = {.advance = advance, .read = read_register, .write = write_register, .note = note,
                         .ignored_access = ignored_access, .fault = fault, .locked_up = locked_up, .reset = reset,
                         .accessed = accessed, .deep_sleep = deep_sleep, .stop_ended = stop_ended};

/* -- parts at the buses ---------------------------------------------------------------------------------------- */

static uint8_t memories[TARGETS][SUBADDRESSES];
static Train trains[TARGETS][OUTPUTS];
static Bank banks[TARGETS];

static int64_t bank(int64_t now_ps, int32_t target) {
  (void)now_ps;
  settle();
  Bank *bank = &banks[target];
  bank->memory = (uint64_t)(uintptr_t)memories[target];
  for (int n = 0; n < SUBADDRESSES; n++) {
    bank->next[n] = (uint8_t)(any(16) ? (n + 1) % SUBADDRESSES : (int)any(SUBADDRESSES));
    bank->access[n] = (uint8_t)(any(4) ? ACCESS_MEMORY : any(3));
  }
  for (int n = 0; n < OUTPUTS; n++) {
    Train *train = &trains[target][n];
    bank->trains[n] = (uint64_t)(uintptr_t)train;
    train->first = (uint8_t)any(SUBADDRESSES - OUTPUT_WIDTH);
    train->width = (uint8_t)(1 + any(OUTPUT_WIDTH));
    memset(bank->access + train->first, ACCESS_OUTPUT + n, train->width);
  }
  for (int n = OUTPUTS; n-- > 0;) { /* where they overlap, the first one is read */
    memset(bank->access + trains[target][n].first, ACCESS_OUTPUT + n, trains[target][n].width);
  }
  return any(4) ? (int64_t)(uintptr_t)bank : -(int64_t)any(2);
}

static void fill(int64_t now_ps, int32_t target, int32_t number) {
  settle();
  Train *train = &trains[target][number];
  train->version = versions[target];
  train->at = train->taken = 0;
  train->count = any(TRAIN_AHEAD + 1);
  for (int64_t n = 0; n <= train->count; n++) {
    train->times[n] = now_ps + 1 + (n + 1) * any(8000000);
  }
  for (int n = 0; n < OUTPUT_WIDTH; n++) {
    train->holds[n] = any(2) ? UINT64_C(1) << any(64) : 0;
    train->releases[n] = any(2) ? UINT64_C(1) << any(64) : 0;
    train->keep[n] = (uint8_t)any(256);
  }
  for (unsigned n = 0; n < sizeof train->samples; n++) {
    train->samples[n] = (uint8_t)n;
  }
  train->status = (uint8_t)any(SUBADDRESSES);
  train->flags = (uint8_t)any(16);
  train->overrun_shift = any(2) ? 4 : 0;
  train->is_stale = (uint8_t)any(2);
  train->is_live = any(8) == 0;
}

/* Python's side of an I2C bus learns what C has had alone. */
static I2cMessage *catch_up(void) {
  Chip *chip = hostile.chip;
  settle();
  I2cMessage *found = NULL;
  for (int32_t number = 0; number < I2C_COUNT; number++) {
    I2cMessage *message = &fcu_i2c_wire(chip, number)->message;
    if (message->open && number == 1) {
      message->live = 1;
      message->count = 0;
      found = message;
    }
  }
  hostile.on_buses++;
  return found;
}

static int32_t i2c_start(int64_t now_ps, int32_t address, int64_t start_ps) {
  (void)now_ps, (void)address, (void)start_ps;
  catch_up();
  return any(4) ? 0 : (int32_t)any(4);
}

static int32_t i2c_write(int64_t now_ps, int32_t value) {
  (void)now_ps, (void)value;
  catch_up();
  return any(8) != 0;
}

static int32_t i2c_read(int64_t now_ps) {
  (void)now_ps;
  const I2cMessage *message = catch_up();
  bool keeps = message && message->target >= 0 && any(2);
  return (int32_t)any(256) | (keeps ? (1 + (int32_t)any(256)) << 8 : 0);
}

static void i2c_stop(int64_t now_ps, int64_t end_ps) {
  (void)now_ps, (void)end_ps;
  catch_up();
}

static void i2c_abort(int64_t now_ps) {
  (void)now_ps;
  catch_up();
}

static void ended(int64_t now_ps) {
  (void)now_ps;
  settle();
  hostile.on_buses++;
}

static int64_t i2c_released(int64_t now_ps) {
  settle();
  return any(4) ? 0 : now_ps + any(3000000);
}

static void i2c_speed(int64_t now_ps, int64_t hz) {
  (void)now_ps, (void)hz;
  settle();
}

static void spi_configure(int64_t now_ps, int32_t speed_hz, int32_t mode, int32_t wires) {
  (void)now_ps, (void)speed_hz, (void)mode, (void)wires;
  settle();
}

static int32_t spi_open(int64_t now_ps, const SpiMessage *message) {
  (void)now_ps;
  settle();
  for (int n = 0; n < message->count; n++) {
    hostile.digest += message->received[n];
  }
  hostile.on_buses++;
  return any(2) != 0;
}

static void spi_send(int64_t now_ps, int32_t part, int32_t byte) {
  (void)now_ps, (void)part, (void)byte;
  settle();
  hostile.on_buses++;
}

static int32_t spi_receive(int64_t now_ps, int32_t part, int32_t wires) {
  (void)now_ps, (void)part, (void)wires;
  settle();
  hostile.on_buses++;
  return (int32_t)any(256);
}

static void spi_close(int64_t now_ps, int32_t part) {
  SpiMessage message;
  SpiUnaddressed unaddressed;
  (void)now_ps, (void)part;
  settle();
  while (fcu_take_spi_message(hostile.chip, 1, &message) || fcu_take_spi_unaddressed(hostile.chip, 1, &unaddressed)) {
  }
}

static void tried(int64_t now_ps) {
  (void)now_ps;
  settle();
}

/* -- others ------------------------------------------------------------------------------------------------------ */

static void sent(int64_t now_ps, int32_t block, int64_t start_ps, int64_t num, int64_t den, int32_t connected,
                 int64_t first, const uint8_t *bytes, int32_t count, int32_t detailed) {
  (void)now_ps, (void)block, (void)start_ps, (void)num, (void)den, (void)connected, (void)first, (void)detailed;
  settle();
  for (int32_t n = 0; n < count; n++) {
    hostile.digest += bytes[n];
  }
  hostile.sent += (uint64_t)count;
}

static void replaced(int64_t now_ps, int32_t block, int32_t value) {
  (void)now_ps, (void)block, (void)value;
  settle();
}

static void counted(int64_t now_ps, int32_t block, int64_t number) {
  (void)now_ps, (void)block, (void)number;
  settle();
}

static void pin_changed(int64_t now_ps, int32_t port, int32_t pin, int32_t level) {
  (void)now_ps, (void)port, (void)pin, (void)level;
  settle();
}

/* Voltages outside of the range, and infinite ones, occur, too. */
static double volts(int64_t now_ps, int32_t channel) {
  (void)now_ps, (void)channel;
  settle();
  return any(8) ? any(600) / 100.0 - 1 : 1.0 / any(2);
}

static void connect_adc(Chip *chip) {
  static const AdcCalls calls = {.volts = volts};
  fcu_connect_adc(chip, &calls)->called = any(2) ? 0xFFFF : 0;
}

static void connect_buses(Chip *chip) {
  static const I2cCalls i2c = {.start = i2c_start, .write = i2c_write, .read = i2c_read, .stop = i2c_stop,
                               .abort = i2c_abort, .ended = ended, .released_ps = i2c_released,
                               .set_speed = i2c_speed};
  static const SpiCalls spi = {.configure = spi_configure, .open = spi_open, .send = spi_send,
                               .receive = spi_receive, .close = spi_close, .ended = ended};
  static const TargetCalls targets = {.bank = bank, .fill = fill};
  fcu_connect_targets(chip, &targets);
  for (int32_t number = 0; number < I2C_COUNT; number++) {
    fcu_connect_i2c(chip, number, &i2c, 400000, 2500000);
    memset(fcu_i2c_wire(chip, number)->target_index, -1, 128);
  }
  fcu_connect_spi(chip, 1, &spi);
  for (int32_t part = 0; part < PARTS; part++) {
    int32_t target = fcu_add_target(chip, &versions[part], any(2) ? 0x80 : 0);
    memset(fcu_i2c_wire(chip, 1)->target_index + 40 * part, target, 40);
    fcu_add_spi_sensor(chip, 1, PORT_B, 12 + part, any(4) ? target : -1);
  }
  fcu_add_absent_spi_device(chip, 0, PORT_B, 0, tried);
}

void connect_surroundings(Chip *chip) {
  static const UsartCalls usart = {.sent = sent, .replaced = replaced};
  static const TimCalls tim = {.late = counted, .lost = counted};
  static const PinCalls pins = {.edge = pin_changed, .changed = pin_changed};
  static const uint32_t bases[USARTS] = {0x40011000, 0x40004400, 0x40011400};
  for (int n = 0; n < USARTS; n++) {
    usarts[n] = fcu_peripheral_at(chip, bases[n]);
  }
  fcu_connect_usarts(chip, &usart);
  fcu_usart_wire(chip, usarts[0], 0, 9, 7, 115200);
  fcu_connect_timers(chip, &tim);
  connect_adc(chip);
  fcu_connect_pins(chip, &pins);
  for (int32_t pin = 0; pin < 16; pin++) {
    fcu_watch_pin(chip, (int32_t)any(PORTS), pin);
  }
  connect_buses(chip);
  chip->host_next_ps = any(20000000);
}
