/* A DMA stream with interrupts (RM0368 9.3.17, 9.5). */
#include "vendor_dma.h"

#define FLAG_FE BIT(0)
#define FLAG_DME BIT(2)
#define FLAG_TE BIT(3)
#define FLAG_HT BIT(4)
#define FLAG_TC BIT(5)
#define FLAG_ALL 0x3DU

static DMA_Stream_TypeDef *Stream(const Dma *dma) { return &dma->controller->stream[dma->number]; }

/* Where a stream's flags are in LISR or HISR: bits 0, 6, 16, 22. */
static uint32_t FlagShift(const Dma *dma) { return (dma->number & 1U) * 6U + (dma->number >> 1 & 1U) * 16U; }

static uint32_t Flag(const Dma *dma, uint32_t flag)
{
  uint32_t status = dma->number < 4U ? dma->controller->LISR : dma->controller->HISR;
  return status >> FlagShift(dma) & flag;
}

static void ClearFlag(const Dma *dma, uint32_t flag)
{
  if (dma->number < 4U) {
    dma->controller->LIFCR = flag << FlagShift(dma);
  } else {
    dma->controller->HIFCR = flag << FlagShift(dma);
  }
}

void Dma_Init(Dma *dma)
{
  DMA_Stream_TypeDef *stream = Stream(dma);
  stream->CR &= ~DMA_CR_EN;
  while ((stream->CR & DMA_CR_EN) != 0U) {
  }
  stream->CR = dma->settings;
  ClearFlag(dma, FLAG_ALL);
  dma->busy = 0;
}

HAL_StatusTypeDef Dma_Start_IT(Dma *dma, volatile uint32_t *peripheral, void *memory, uint32_t length)
{
  DMA_Stream_TypeDef *stream = Stream(dma);
  if (dma->busy) {
    return HAL_BUSY;
  }
  dma->busy = 1;
  stream->CR &= ~DMA_CR_EN;
  stream->CR &= ~DMA_CR_DBM;
  stream->NDTR = length;
  stream->PAR = (uint32_t)peripheral;
  stream->M0AR = (uint32_t)memory;
  ClearFlag(dma, FLAG_ALL);
  stream->CR |= DMA_CR_TCIE | DMA_CR_TEIE | DMA_CR_DMEIE;
  stream->FCR |= DMA_FCR_FEIE;
  if (dma->half_complete) {
    stream->CR |= DMA_CR_HTIE;
  }
  stream->CR |= DMA_CR_EN;
  return HAL_OK;
}

uint32_t Dma_Remaining(const Dma *dma) { return Stream(dma)->NDTR; }

static void Error(Dma *dma, uint32_t flag, uint32_t enabled)
{
  if (Flag(dma, flag) && enabled) {
    ClearFlag(dma, flag);
    dma->errors |= flag;
  }
}

void Dma_IRQHandler(Dma *dma)
{
  DMA_Stream_TypeDef *stream = Stream(dma);
  Error(dma, FLAG_TE, stream->CR & DMA_CR_TEIE);
  Error(dma, FLAG_FE, stream->FCR & DMA_FCR_FEIE);
  Error(dma, FLAG_DME, stream->CR & DMA_CR_DMEIE);
  if (Flag(dma, FLAG_HT) && (stream->CR & DMA_CR_HTIE) != 0U) {
    ClearFlag(dma, FLAG_HT);
    if ((stream->CR & DMA_CR_CIRC) == 0U) {
      stream->CR &= ~DMA_CR_HTIE;
    }
    dma->half_complete(dma);
  }
  if (Flag(dma, FLAG_TC) && (stream->CR & DMA_CR_TCIE) != 0U) {
    ClearFlag(dma, FLAG_TC);
    if ((stream->CR & DMA_CR_CIRC) == 0U) {
      stream->CR &= ~DMA_CR_TCIE;
      dma->busy = 0;
    }
    if (dma->complete) {
      dma->complete(dma);
    }
  }
}
