/* USART1, USART2 and USART6. */
#ifndef FCU_USART_H
#define FCU_USART_H

#include "peripherals/peripheral.h"

#define USARTS 3
#define USART_BUFFER 256

/* The frame takes num / den ps. */
typedef struct {
  int64_t num, den;
} UsartFrame;

/* Frames without a gap, timed from the first one, so that they do not drift. */
typedef struct {
  int64_t start_ps, count;
  UsartFrame frame;
  uint8_t connected; /* pin switched to the USART */
} UsartRun;

typedef struct {
  Peripheral peripheral;
  int32_t number;
  int32_t event;
  uint32_t registers[7]; /* by offset / 4, without SR and DR */
  UsartFrame frame;

  UsartRun run;
  int64_t txe_ps, idle_ps; /* DR is empty; the line is idle */
  int64_t tc_ps;           /* TC is set */
  int16_t pending_byte;    /* until TE and UE are set; -1: none */
  uint8_t sr_read;         /* since a write of DR: the next one clears TC */
  /* Bytes that Python has not received. */
  uint8_t buffer[USART_BUFFER];
  int32_t buffer_length;

  int16_t rx_byte; /* RXNE; -1: none */
  uint8_t received;
  uint8_t overrun, idle;
  uint32_t last_sr; /* flags that reading DR clears */

  uint8_t wants_events;
  uint8_t in_dma;

  PinFunction pins[2];   /* of the terminal; function 255 ends them */
  int32_t terminal_baud; /* 0: none */
} Usart;

/* Callbacks into Python, or NULL. */
typedef struct {
  /* Frames from number `first` of a run. detailed: the trace needs them. */
  void (*sent)(int64_t now_ps, int32_t peripheral, int64_t start_ps, int64_t num, int64_t den, int32_t connected,
               int64_t first, const uint8_t *bytes, int32_t length, int32_t detailed);
  /* The last of these bytes was overwritten. */
  void (*replaced)(int64_t now_ps, int32_t peripheral, int32_t value);
} UsartCalls;

typedef struct {
  Usart usarts[USARTS];
  UsartCalls calls;
} Usarts;

void usarts_create(Chip *chip);

#endif
