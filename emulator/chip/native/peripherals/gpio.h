/* GPIO ports and the pins of the chip. */
#ifndef FCU_GPIO_H
#define FCU_GPIO_H

#include "peripherals/peripheral.h"

#define PORTS 6 /* A to E, H (RM0368 2.3) */
#define PIN_LISTENERS 64

/* In a set of pins, bit n is pin n. */
typedef struct {
  Peripheral peripheral;
  uint32_t registers[10]; /* by offset / 4, without IDR and BSRR */
  uint32_t locked, lock_step, lock_pins;
  uint16_t driven, driven_high;     /* driven by the output stage */
  uint16_t external, external_high; /* driven from outside of the chip */
  uint16_t pulled_up, pulled_down;
  uint16_t analog;
  uint16_t input;               /* resulting level; 0 while floating */
  uint16_t traced, traced_high; /* traced: the pin has been an output; traced_high: its level in the trace */
  uint16_t frequent;            /* traced in detail only */
  uint16_t has_listener;
  uint16_t watched;
} GpioPort;

typedef struct {
  /* an output has changed; called only while the trace is observed */
  void (*edge)(int64_t now_ps, int32_t port, int32_t pin, int32_t level);
  void (*changed)(int64_t now_ps, int32_t port, int32_t pin, int32_t level);
} PinCalls;

#define EDGE_RING_SIZE 262144 /* a power of 2; more than a trace keeps (emulator/trace.py) */

typedef struct {
  int64_t at_ps;
  uint8_t port, pin, level, _[5];
} Edge;

typedef struct {
  GpioPort ports[PORTS];
  Edge *edges; /* not in snapshots */
  int64_t edge_count;
  int64_t edges_taken;
  PinCalls calls;
  struct {
    Peripheral *peripheral;
    PinChanged changed;
    int32_t port, pin;
  } listeners[PIN_LISTENERS];
  int32_t listener_count;
} Gpio;

bool gpio_allocate(Chip *chip); /* false: no host memory */
void gpio_create(Chip *chip);
void gpio_destroy(Chip *chip);

#endif
