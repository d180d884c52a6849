/* DMA controllers and request lines. */
#ifndef FCU_DMA_H
#define FCU_DMA_H

#include "peripherals/peripheral.h"

#define DMA_CONTROLLERS 2
#define DMA_STREAMS 8

typedef struct {
  uint32_t control, items, peripheral, memory[2], fifo_control; /* CR, NDTR, PAR, M0AR, M1AR, FCR */
  uint32_t flags; /* bits of LISR or HISR */
  /* length: initial NDTR. This length is loaded into NDTR again in a circular transfer, and when firmware
   * enables a completed stream. moved: items moved so far. size and steps are in bytes. */
  uint32_t length, moved, size, peripheral_step, memory_step;
  int64_t copy_ps;   /* time at which a memory-to-memory transfer ends */
  enum Request line; /* the line that the stream serves */
} DmaStream;

typedef struct {
  Peripheral peripheral;
  DmaStream streams[DMA_STREAMS];
  int32_t event;
} DmaController;

typedef struct {
  DmaController controllers[DMA_CONTROLLERS];
  Peripheral *requester[REQUESTS];
  uint8_t server[REQUESTS]; /* the serving stream: 1 to 8 for DMA1, 9 to 16 for DMA2, or 0 */
} Dma;

void dma_create(Chip *chip);

#endif
