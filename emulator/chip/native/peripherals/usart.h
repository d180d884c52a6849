/* USART1, USART2 and USART6. */
#ifndef FCU_USART_H
#define FCU_USART_H

#include "peripherals/peripheral.h"

#define USARTS 3
#define USART_BUFFER 256

/* Duration of a frame: num / den ps. */
typedef struct {
  int64_t num, den;
} UsartFrame;

/* Frames without a gap. Times are computed from the first frame, so that rounding errors do not add up. */
typedef struct {
  int64_t start_ps, count;
  UsartFrame frame;
  uint8_t connected; /* the transmitter's pin is switched to the USART */
} UsartRun;

typedef struct {
  Peripheral peripheral;
  int32_t number;
  int32_t event;
  uint32_t registers[7]; /* by offset / 4, without SR and DR */
  UsartFrame frame;

  UsartRun run;
  int64_t txe_ps, idle_ps; /* times at which DR becomes empty and the line becomes idle */
  int64_t tc_ps;           /* time when TC is set */
  int16_t pending_byte;    /* byte that waits until TE and UE are set; -1: none */
  uint8_t sr_read;         /* SR was read after the latest write of DR: the next write of DR clears TC */
  /* Bytes that Python has not received. */
  uint8_t buffer[USART_BUFFER];
  int32_t buffer_length;

  int16_t rx_byte; /* received byte (RXNE); -1: none */
  uint8_t received;
  uint8_t overrun, idle;
  uint32_t last_sr; /* flags that the next read of DR clears */

  uint8_t wants_events;
  uint8_t settings_checked;
  uint8_t in_dma;

  PinFunction pins[2];   /* the terminal's pins; function 255 ends the list */
  int32_t terminal_baud; /* 0: no terminal */
} Usart;

/* Callbacks into Python, or NULL. */
typedef struct {
  /* Frames of a gapless run, from number `first` on. detailed: the trace needs these frames. */
  void (*sent)(int64_t now_ps, int32_t peripheral, int64_t start_ps, int64_t num, int64_t den, int32_t connected,
               int64_t first, const uint8_t *bytes, int32_t length, int32_t detailed);
  /* Firmware has written `value` to DR, and so overwritten the latest byte that was passed to sent(). */
  void (*replaced)(int64_t now_ps, int32_t peripheral, int32_t value);
} UsartCalls;

typedef struct {
  Usart usarts[USARTS];
  UsartCalls calls;
} Usarts;

void usarts_create(Chip *chip);

#endif
