/* USART1, USART2 and USART6. */
#ifndef FCU_USART_H
#define FCU_USART_H

#include "peripherals/peripheral.h"

#define USARTS 3
#define USART_BUFFER 256

/* num / den ps. */
typedef struct {
  int64_t num, den;
} UsartFrame;

/* Without a gap: times are computed from the first, so that they do not drift. */
typedef struct {
  int64_t start_ps, count;
  UsartFrame frame;
  uint8_t connected; /* pin switched to the USART */
} UsartRun;

typedef struct {
  Peripheral peripheral;
  int32_t number; /* 0 to 2 */
  int32_t event;
  uint32_t registers[7]; /* by offset / 4, without SR and DR */
  UsartFrame frame; /* next byte */

  UsartRun run;
  int64_t txe_ps, idle_ps; /* DR next empty, line next idle */
  int64_t tc_ps;           /* TC next set */
  int16_t pending_byte;         /* waits for TE and UE; -1: none */
  uint8_t sr_read;           /* since a write of DR, which clears TC then */
  /* Not yet passed to Python. */
  uint8_t buffer[USART_BUFFER];
  int32_t buffer_length;

  int16_t rx_byte;  /* RXNE; -1: none */
  uint8_t received; /* last byte read */
  uint8_t overrun, idle;
  uint32_t last_sr; /* flags that reading DR clears */

  uint8_t wants_events; /* interrupts or DMA enabled */
  uint8_t in_dma;

  PinFunction pins[2]; /* terminal; 255 ends */
  int32_t terminal_baud; /* 0: none */
} Usart;

/* Callbacks into Python, or NULL. */
typedef struct {
  /* From frame `first` of a run. detailed: for the trace. */
  void (*sent)(int64_t now_ps, int32_t peripheral, int64_t start_ps, int64_t num, int64_t den, int32_t connected,
               int64_t first, const uint8_t *bytes, int32_t length, int32_t detailed);
  /* Overwrites the last byte sent. */
  void (*replaced)(int64_t now_ps, int32_t peripheral, int32_t value);
} UsartCalls;

typedef struct {
  Usart usarts[USARTS];
  UsartCalls calls;
} Usarts;

void usarts_create(Chip *chip);

#endif
