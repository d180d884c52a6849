/* A DMA stream with interrupts, in the vendor's style: configured once, started with addresses and a length. */
#ifndef VENDOR_DMA_H
#define VENDOR_DMA_H

#include "vendor.h"

typedef struct Dma Dma;

struct Dma {
  DMA_TypeDef *controller;
  uint32_t number; /* of the stream */
  uint32_t settings; /* of CR: channel, direction, circular */
  void *parent;
  void (*complete)(Dma *dma);
  void (*half_complete)(Dma *dma);
  volatile uint32_t errors;
  volatile uint32_t busy;
};

void Dma_Init(Dma *dma);
HAL_StatusTypeDef Dma_Start_IT(Dma *dma, volatile uint32_t *peripheral, void *memory, uint32_t length);

/* Transfers that are left. */
uint32_t Dma_Remaining(const Dma *dma);

/* Called from the stream's interrupt handler. */
void Dma_IRQHandler(Dma *dma);

#endif
