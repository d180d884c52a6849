/* GPIO ports and the pins of the chip; gpio.c explains them. */
#ifndef FCU_GPIO_H
#define FCU_GPIO_H

#include "peripherals/peripheral.h"

#define PORTS 6 /* A to E, and H (RM0368 section 2.3) */
#define PIN_LISTENERS 64

/* A port with its pins. Sets of pins: bit = pin. */
typedef struct {
  Peripheral peripheral;
  uint32_t registers[10]; /* by offset / 4; IDR and BSRR are not stored */
  uint32_t locked, lock_step, lock_pins;
  uint16_t driven, driven_high;   /* the chip's output stage: pins it drives at all, and at 1 */
  uint16_t external, external_high; /* likewise for all drivers outside of the chip together */
  uint16_t pulled_up, pulled_down;
  uint16_t analog;
  uint16_t input;             /* the resulting level; a floating pin reads as 0 */
  uint16_t traced, traced_high; /* pins that were once an output, and their levels in the trace */
  uint16_t frequent;          /* pins whose edges are of interest in a detailed trace only */
  uint16_t has_listener;             /* pins that peripherals of the chip monitor */
  uint16_t watched;           /* pins that Python monitors */
} GpioPort;

/* Callbacks into Python. */
typedef struct {
  void (*edge)(int64_t now_ps, int32_t port, int32_t pin, int32_t level);    /* the chip's output changed; while
                                                                                 the trace is observed */
  void (*changed)(int64_t now_ps, int32_t port, int32_t pin, int32_t level); /* the input level of a watched pin */
} PinCalls;

#define EDGE_RING_SIZE 262144 /* edges in the ring; a power of 2, and more than a trace keeps (emulator/trace.py) */

/* An edge for the trace that Python has not taken yet. */
typedef struct {
  int64_t at_ps;
  uint8_t port, pin, level, _[5];
} Edge;

typedef struct {
  GpioPort ports[PORTS];
  Edge *edges;         /* a ring; not part of a snapshot: Python takes the edges before */
  int64_t edge_count;  /* edges so far */
  int64_t edges_taken; /* of these; the ring holds EDGES_KEPT, older ones are lost */
  PinCalls calls;
  struct {
    Peripheral *peripheral;
    PinChanged changed;
    int32_t port, pin;
  } listeners[PIN_LISTENERS];
  int32_t listener_count;
} Gpio;

bool gpio_allocate(Chip *chip); /* false: the host has no memory */
void gpio_create(Chip *chip);
void gpio_destroy(Chip *chip);

#endif
