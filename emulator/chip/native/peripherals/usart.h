/* One USART; usart.c explains it. */
#ifndef FCU_USART_H
#define FCU_USART_H

#include "peripherals/peripheral.h"

#define USARTS 3
#define USART_BUFFER 256

/* The length of a frame, num / den ps. */
typedef struct {
  int64_t num, den;
} UsartFrame;

/* Frames on the wire without a gap: each time is computed from the first one, so that they do not drift. */
typedef struct {
  int64_t start_ps, count;
  UsartFrame frame;
  uint8_t connected; /* the pin is switched to the transmitter: a terminal receives it */
} UsartRun;

typedef struct {
  Peripheral peripheral;
  int32_t number; /* the number among the three */
  int32_t event;
  uint32_t registers[7]; /* by offset / 4; SR and DR are not stored */
  UsartFrame frame; /* of the next byte */

  /* The transmitter. */
  UsartRun run;
  int64_t txe_ps, idle_ps; /* when the data register is next empty, and the line idle */
  int64_t tc_ps;           /* when TC is next set */
  int16_t pending_byte;         /* a byte in DR while the transmitter is off; -1: none */
  uint8_t sr_read;           /* SR was read since DR was last written: writing DR clears TC */
  /* The latest bytes of the run, which Python has not yet received. */
  uint8_t buffer[USART_BUFFER];
  int32_t buffer_length;

  /* The receiver. */
  int16_t rx_byte;  /* a byte that has not been read; -1: none (RXNE) */
  uint8_t received; /* the last byte that was read */
  uint8_t overrun, idle;
  uint32_t last_sr; /* SR as last read: the flags that a following read of DR clears */

  uint8_t wants_events; /* an interrupt or a DMA request may be due */
  uint8_t in_dma;

  /* The wiring, set once. */
  PinFunction pins[2]; /* pins of the terminal; function 255 ends them */
  int32_t terminal_baud; /* 0: no terminal */
} Usart;

/* Callbacks into Python; either may be NULL. */
typedef struct {
  /* Bytes were sent: frames number first and following of a run that began at start_ps. detailed: the trace needs
   * them. */
  void (*sent)(int64_t now_ps, int32_t peripheral, int64_t start_ps, int64_t num, int64_t den, int32_t connected,
               int64_t first, const uint8_t *bytes, int32_t length, int32_t detailed);
  /* The last of these bytes was overwritten in DR. */
  void (*replaced)(int64_t now_ps, int32_t peripheral, int32_t value);
} UsartCalls;

typedef struct {
  Usart usarts[USARTS];
  UsartCalls calls;
} Usarts;

void usarts_create(Chip *chip);

#endif
