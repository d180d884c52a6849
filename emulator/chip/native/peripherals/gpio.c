/* GPIO ports A to E and H (RM0368 section 8), and the level of each pin.
 *
 * Strong drivers are the output stage and the devices outside (combined by emulator/buses/gpio.py). If one of
 * them drives low, the pin is low. Without a strong driver, the pull resistor determines the level; the level
 * of a floating pin is 0.
 *
 * Reset: PA13 to PA15, PB3 and PB4 belong to the debug port (AF0), so MODER of port A is 0xA800 0000; some
 * revisions of RM0368 print 0x0C00 0000, which contradicts 8.3.1. Analog pins read as 0 (8.3.12).
 *
 * The trace shows level 1 for an open-drain output at 1, and for a pin that is no longer an output.
 *
 * NOT MODELLED
 * - Levels in alternate-function mode: the pin is released.
 * - OSPEEDR: stored.
 * - EXTI: analog pins are not disconnected from EXTI.
 */
#include "peripherals/gpio.h"

#include <stdlib.h>

#include "chip.h"
#include "peripherals/exti.h"
#include "fcu.h"
#include "generated/registers_gpio.h"

enum { INPUT, OUTPUT, ALTERNATE, ANALOG };
enum { NO_PULL, PULL_UP, PULL_DOWN };

#define ALL_PINS 0xFFFFu

static const uint32_t BASES[PORTS] = {GPIOA_BASE, GPIOB_BASE, GPIOC_BASE, GPIOD_BASE, GPIOE_BASE, GPIOH_BASE};

static uint32_t *reg(GpioPort *port, uint32_t offset) { return &port->registers[offset >> 2]; }

static int index_of(const GpioPort *port) { return (int)(port - port->peripheral.chip->gpio.ports); }

static void set_bit(uint16_t *set, uint32_t bit, bool in) { *set = (uint16_t)(in ? *set | bit : *set & ~bit); }

static uint32_t levels(const GpioPort *port) {
  uint32_t strong = port->driven | port->external;
  uint32_t low = (port->driven & ~port->driven_high) | (port->external & ~port->external_high);
  return (strong & ~low) | (port->pulled_up & ~strong);
}

static void update_input(GpioPort *port, int pin) {
  Chip *chip = port->peripheral.chip;
  uint32_t bit = 1u << pin, now = levels(port);
  if (!((now ^ port->input) & bit)) {
    return;
  }
  int level = now >> pin & 1;
  set_bit(&port->input, bit, level);
  exti_pin_changed(&chip->exti, index_of(port), pin, level);
  timers_pin_changed(chip, index_of(port), pin, level);
  if (port->has_listener & bit) {
    for (int n = 0; n < chip->gpio.listener_count; n++) {
      if (chip->gpio.listeners[n].port == index_of(port) && chip->gpio.listeners[n].pin == pin) {
        chip->gpio.listeners[n].changed(chip->gpio.listeners[n].peripheral, pin, level);
      }
    }
  }
  if (port->watched & bit) {
    chip->gpio.calls.changed(chip->now_ps, index_of(port), pin, level);
  }
}

static void trace_level(GpioPort *port, int pin, int level) {
  Chip *chip = port->peripheral.chip;
  uint32_t bit = 1u << pin;
  if (port->traced & bit && (port->traced_high >> pin & 1) == level) {
    return;
  }
  set_bit(&port->traced, bit, true);
  set_bit(&port->traced_high, bit, level);
  if (port->frequent & bit && !chip->detailed) {
    return;
  }
  if (!chip->observed) {
    Gpio *gpio = &chip->gpio;
    gpio->edges[gpio->edge_count++ % EDGE_RING_SIZE] = (Edge){
        .at_ps = chip->now_ps, .port = (uint8_t)index_of(port), .pin = (uint8_t)pin, .level = (uint8_t)level};
    chip->work += gpio->edge_count - gpio->edges_taken <= EDGE_RING_SIZE ? WORK_EDGE_TRACED : WORK_EDGE;
  } else if (chip->gpio.calls.edge) {
    chip->gpio.calls.edge(chip->now_ps, index_of(port), pin, level);
  }
}

int64_t fcu_pending_edges(const Chip *chip) { return chip->gpio.edge_count - chip->gpio.edges_taken; }

int64_t fcu_take_edges(Chip *chip, Edge *edges, int64_t size, int64_t *lost) {
  Gpio *gpio = &chip->gpio;
  int64_t first = gpio->edge_count - (size < EDGE_RING_SIZE ? size : EDGE_RING_SIZE);
  first = first > gpio->edges_taken ? first : gpio->edges_taken;
  *lost = first - gpio->edges_taken;
  int64_t count = gpio->edge_count - first;
  for (int64_t n = 0; n < count; n++) {
    edges[n] = gpio->edges[(first + n) % EDGE_RING_SIZE];
  }
  gpio->edges_taken = gpio->edge_count;
  return count;
}

/* An open drain at 1 releases the pin. */
static void output(GpioPort *port, int pin) {
  uint32_t bit = 1u << pin;
  bool level = *reg(port, ODR) & bit;
  set_bit(&port->driven, bit, !level || !(*reg(port, OTYPER) & bit));
  set_bit(&port->driven_high, bit, level);
  trace_level(port, pin, level);
  update_input(port, pin);
}

static void release(GpioPort *port, int pin) {
  set_bit(&port->driven, 1u << pin, false);
  if ((port->traced & ~port->traced_high) >> pin & 1) {
    trace_level(port, pin, 1);
  }
  update_input(port, pin);
}

/* If BSRR both sets and resets a pin, the pin is set (8.4.7). */
static uint32_t latched(const GpioPort *port, uint32_t offset, uint32_t value, uint32_t mask) {
  uint32_t odr = port->registers[ODR >> 2];
  if (offset == BSRR) {
    return (odr & ~(value >> 16)) | (value & ALL_PINS);
  }
  return (odr & ~mask) | (value & ALL_PINS);
}

static void latch(GpioPort *port, uint32_t odr) {
  uint32_t changed = *reg(port, ODR) ^ odr, moder = *reg(port, MODER);
  *reg(port, ODR) = odr;
  for (int pin = 0; changed; pin++, changed >>= 1) {
    if (changed & 1 && (moder >> 2 * pin & 3) == OUTPUT) {
      output(port, pin);
    }
  }
}

static void configure_pin(GpioPort *port, int pin) {
  port->peripheral.chip->work += WORK_PIN;
  uint32_t bit = 1u << pin, mode = *reg(port, MODER) >> 2 * pin & 3;
  uint32_t pull = mode == ANALOG ? NO_PULL : *reg(port, PUPDR) >> 2 * pin & 3;
  set_bit(&port->pulled_up, bit, pull == PULL_UP);
  set_bit(&port->pulled_down, bit, pull == PULL_DOWN);
  update_input(port, pin);
  uint32_t function = *reg(port, pin >= 8 ? AFRH : AFRL) >> 4 * (pin & 7) & 15;
  port->peripheral.chip->alternate[index_of(port)][pin] = (int8_t)(mode == ALTERNATE ? (int)function : -1);
  if (mode == OUTPUT) {
    output(port, pin);
  } else {
    release(port, pin);
  }
  set_bit(&port->analog, bit, mode == ANALOG);
}

/* Return 0 for other registers. */
static unsigned bits_per_pin(uint32_t offset) {
  switch (offset) {
    case MODER: case OSPEEDR: case PUPDR: return 2;
    case OTYPER: return 1;
    case AFRL: case AFRH: return 4;
    default: return 0;
  }
}

static void configure(GpioPort *port, uint32_t offset, uint32_t value, uint32_t mask) {
  unsigned width = bits_per_pin(offset), first = offset == AFRH ? 8 : 0;
  unsigned count = width == 4 ? 8 : 16;
  uint32_t field = (1u << width) - 1, old = *reg(port, offset);
  mask &= width == 1 ? ALL_PINS : WORD;
  for (unsigned n = 0; n < count; n++) {
    if (port->locked >> (first + n) & 1) {
      mask &= ~(field << width * n);
    }
  }
  uint32_t new = (old & ~mask) | (value & mask);
  *reg(port, offset) = new;
  for (unsigned n = 0; n < count; n++) {
    if ((old ^ new) >> width * n & field) {
      configure_pin(port, (int)(first + n));
    }
  }
}

/* Three word writes with LCKK = 1, 0, 1 and the same pins lock these pins until reset (8.4.8). */
static void write_lock(GpioPort *port, uint32_t value, uint32_t mask) {
  if (port->locked || mask != WORD) {
    return;
  }
  bool key = value & LCKR_LCKK, wanted = port->lock_step != 1;
  uint32_t pins = value & ALL_PINS;
  if (key != wanted || (port->lock_step && pins != port->lock_pins)) {
    port->lock_step = 0;
    wanted = true;
  }
  if (key == wanted) {
    port->lock_pins = pins;
    port->lock_step++;
  }
  *reg(port, LCKR) = port->lock_pins;
  if (port->lock_step == 3) {
    port->locked = pins;
    *reg(port, LCKR) = pins | LCKR_LCKK;
    port->lock_step = 0;
  }
}

static uint32_t gpio_peek(const Peripheral *peripheral, uint32_t offset) {
  const GpioPort *port = (const GpioPort *)peripheral;
  return offset == IDR ? port->input & (uint32_t)~port->analog : port->registers[offset >> 2];
}

static void gpio_write(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  GpioPort *port = (GpioPort *)peripheral;
  if (offset == BSRR || offset == ODR) {
    latch(port, latched(port, offset, value, mask));
  } else if (offset == LCKR) {
    write_lock(port, value, mask);
  } else if (bits_per_pin(offset)) {
    configure(port, offset, value, mask);
  }
}

/* Return whether the write changes no output. Loops that show a state on LEDs repeat the same write. */
static bool gpio_is_redundant_write(const Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  const GpioPort *port = (const GpioPort *)peripheral;
  return (offset == BSRR || offset == ODR) && latched(port, offset, value, mask) == port->registers[ODR >> 2];
}

static void gpio_reset(Peripheral *peripheral) {
  GpioPort *port = (GpioPort *)peripheral;
  for (uint32_t offset = MODER; offset <= AFRH; offset += 4) {
    *reg(port, offset) = GPIO_RESETS[index_of(port)][offset >> 2];
  }
  port->locked = port->lock_step = port->lock_pins = 0;
  for (int pin = 0; pin < 16; pin++) {
    configure_pin(port, pin);
  }
}

static const PeripheralType TYPE = {
  .read = peripheral_read_as_peek,
  .peek = gpio_peek,
  .write = gpio_write,
  .reset = gpio_reset,
  .is_redundant_write = gpio_is_redundant_write,
};

bool gpio_allocate(Chip *chip) {
  chip->gpio.edges = calloc(EDGE_RING_SIZE, sizeof(Edge));
  return chip->gpio.edges != NULL;
}

void gpio_create(Chip *chip) {
  for (int n = 0; n < PORTS; n++) {
    peripheral_create(chip, &chip->gpio.ports[n].peripheral, &TYPE, BASES[n], GPIOA_SIZE, GPIO_OFFSETS);
    chip->gpio.ports[n].peripheral.memory_like = 1;
    gpio_reset(&chip->gpio.ports[n].peripheral);
  }
}

void gpio_destroy(Chip *chip) { free(chip->gpio.edges); }

void pin_listen(Peripheral *peripheral, char port, int pin, PinChanged changed) {
  Gpio *gpio = &peripheral->chip->gpio;
  int n = gpio->listener_count++, index = port_index(port);
  gpio->listeners[n].peripheral = peripheral;
  gpio->listeners[n].changed = changed;
  gpio->listeners[n].port = index;
  gpio->listeners[n].pin = pin;
  set_bit(&gpio->ports[index].has_listener, 1u << pin, true);
}

int pin_level(const Chip *chip, int port, int pin) {
  const GpioPort *gpio = &chip->gpio.ports[port];
  uint32_t held = gpio->driven | gpio->external | gpio->pulled_up | gpio->pulled_down;
  return held >> pin & 1 ? gpio->input >> pin & 1 : -1;
}

void fcu_connect_pins(Chip *chip, const PinCalls *calls) { chip->gpio.calls = *calls; }

void fcu_watch_pin(Chip *chip, int32_t port, int32_t pin) {
  set_bit(&chip->gpio.ports[port].watched, 1u << pin, true);
}

void fcu_frequent_pin(Chip *chip, int32_t port, int32_t pin) {
  set_bit(&chip->gpio.ports[port].frequent, 1u << pin, true);
}

void fcu_drive_pin(Chip *chip, int32_t port, int32_t pin, int32_t level) {
  set_bit(&chip->gpio.ports[port].external, 1u << pin, level >= 0);
  set_bit(&chip->gpio.ports[port].external_high, 1u << pin, level > 0);
  update_input(&chip->gpio.ports[port], pin);
}

int32_t fcu_pin_output(const Chip *chip, int32_t port, int32_t pin) {
  const GpioPort *gpio = &chip->gpio.ports[port];
  return gpio->driven >> pin & 1 ? gpio->driven_high >> pin & 1 : -1;
}

int32_t fcu_pin_pull(const Chip *chip, int32_t port, int32_t pin) {
  const GpioPort *gpio = &chip->gpio.ports[port];
  return (gpio->pulled_up | gpio->pulled_down) >> pin & 1 ? gpio->pulled_up >> pin & 1 : -1;
}

int32_t fcu_pin_alternate(const Chip *chip, int32_t port, int32_t pin) { return chip->alternate[port][pin]; }
