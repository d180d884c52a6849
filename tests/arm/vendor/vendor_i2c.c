/* I2C as a master (RM0368 18.3.3): the sequences of the manual, each flag asked for by a read of its own. */
#include "vendor_i2c.h"

#define BUSY_TIMEOUT_MS 25U
#define FLAG_TIMEOUT_MS 100U
#define READ_BIT 1U
#define ERRORS (I2C_SR1_BERR | I2C_SR1_ARLO | I2C_SR1_AF | I2C_SR1_OVR)
#define ALL_INTERRUPTS (I2C_CR2_ITEVTEN | I2C_CR2_ITBUFEN | I2C_CR2_ITERREN)

__weak void I2c_MemRxCpltCallback(I2c *i2c) { UNUSED(i2c); }
__weak void I2c_ErrorCallback(I2c *i2c) { UNUSED(i2c); }

static int HasFlag(const I2c *i2c, uint32_t flag) { return (i2c->regs->SR1 & flag) == flag; }

static void ClearAddr(const I2c *i2c)
{
  (void)i2c->regs->SR1;
  (void)i2c->regs->SR2;
}

/* -- polled ----------------------------------------------------------------------------------------------- */

static HAL_StatusTypeDef WaitWhileBusy(I2c *i2c)
{
  uint32_t tickstart = HAL_GetTick();
  while ((i2c->regs->SR2 & I2C_SR2_BUSY) != 0U) {
    if (HAL_GetTick() - tickstart > BUSY_TIMEOUT_MS) {
      return HAL_BUSY;
    }
  }
  return HAL_OK;
}

static HAL_StatusTypeDef WaitOnFlag(I2c *i2c, uint32_t flag, uint32_t timeout_ms, uint32_t tickstart)
{
  while (!HasFlag(i2c, flag)) {
    if (HasFlag(i2c, I2C_SR1_AF)) {
      i2c->regs->CR1 |= I2C_CR1_STOP;
      i2c->regs->SR1 = ~I2C_SR1_AF;
      i2c->error |= I2C_SR1_AF;
      return HAL_ERROR;
    }
    if (timeout_ms != HAL_MAX_DELAY && HAL_GetTick() - tickstart > timeout_ms) {
      return HAL_TIMEOUT;
    }
  }
  return HAL_OK;
}

static HAL_StatusTypeDef SendAddress(I2c *i2c, uint16_t address, uint32_t timeout_ms, uint32_t tickstart)
{
  i2c->regs->CR1 |= I2C_CR1_START;
  HAL_StatusTypeDef status = WaitOnFlag(i2c, I2C_SR1_SB, timeout_ms, tickstart);
  if (status != HAL_OK) {
    return status;
  }
  i2c->regs->DR = address;
  return WaitOnFlag(i2c, I2C_SR1_ADDR, timeout_ms, tickstart);
}

static HAL_StatusTypeDef RequestMemoryWrite(I2c *i2c, uint32_t timeout_ms, uint32_t tickstart)
{
  i2c->regs->CR1 |= I2C_CR1_ACK;
  HAL_StatusTypeDef status = SendAddress(i2c, i2c->device & (uint16_t)~READ_BIT, timeout_ms, tickstart);
  if (status != HAL_OK) {
    return status;
  }
  ClearAddr(i2c);
  status = WaitOnFlag(i2c, I2C_SR1_TXE, timeout_ms, tickstart);
  if (status == HAL_OK) {
    i2c->regs->DR = i2c->memory;
  }
  return status;
}

/* On return ADDR of the second address is set and holds the clock. */
static HAL_StatusTypeDef RequestMemoryRead(I2c *i2c, uint32_t timeout_ms, uint32_t tickstart)
{
  HAL_StatusTypeDef status = RequestMemoryWrite(i2c, timeout_ms, tickstart);
  if (status == HAL_OK) {
    status = WaitOnFlag(i2c, I2C_SR1_TXE, timeout_ms, tickstart);
  }
  return status == HAL_OK ? SendAddress(i2c, i2c->device | READ_BIT, timeout_ms, tickstart) : status;
}

static HAL_StatusTypeDef Begin(I2c *i2c, I2cState state, uint16_t device, uint16_t memory, uint16_t size)
{
  if (i2c->state != I2C_READY || WaitWhileBusy(i2c) != HAL_OK) {
    return HAL_BUSY;
  }
  if ((i2c->regs->CR1 & I2C_CR1_PE) == 0U) {
    i2c->regs->CR1 |= I2C_CR1_PE;
  }
  i2c->regs->CR1 &= ~I2C_CR1_POS;
  i2c->state = state;
  i2c->error = 0;
  i2c->device = device;
  i2c->memory = memory;
  i2c->left = size;
  i2c->step = 0;
  return HAL_OK;
}

static void TakeByte(I2c *i2c)
{
  *i2c->data++ = (uint8_t)i2c->regs->DR;
  i2c->left--;
}

/* What acknowledge and stop need depends on how many bytes there are (RM0368, "Master receiver"). */
static void AnswerReadAddress(I2c *i2c)
{
  if (i2c->left == 1U) {
    i2c->regs->CR1 &= ~I2C_CR1_ACK;
    ClearAddr(i2c);
    i2c->regs->CR1 |= I2C_CR1_STOP;
  } else if (i2c->left == 2U) {
    i2c->regs->CR1 &= ~I2C_CR1_ACK;
    i2c->regs->CR1 |= I2C_CR1_POS;
    ClearAddr(i2c);
  } else {
    ClearAddr(i2c);
  }
}

static HAL_StatusTypeDef ReceiveLastThree(I2c *i2c, uint32_t timeout_ms, uint32_t tickstart)
{
  if (i2c->left == 3U) {
    if (WaitOnFlag(i2c, I2C_SR1_BTF, timeout_ms, tickstart) != HAL_OK) {
      return HAL_TIMEOUT;
    }
    i2c->regs->CR1 &= ~I2C_CR1_ACK;
    TakeByte(i2c);
  }
  if (i2c->left == 1U) {
    if (WaitOnFlag(i2c, I2C_SR1_RXNE, timeout_ms, tickstart) != HAL_OK) {
      return HAL_TIMEOUT;
    }
    TakeByte(i2c);
    return HAL_OK;
  }
  if (WaitOnFlag(i2c, I2C_SR1_BTF, timeout_ms, tickstart) != HAL_OK) {
    return HAL_TIMEOUT;
  }
  i2c->regs->CR1 |= I2C_CR1_STOP;
  TakeByte(i2c);
  TakeByte(i2c);
  return HAL_OK;
}

static HAL_StatusTypeDef Receive(I2c *i2c, uint32_t timeout_ms, uint32_t tickstart)
{
  while (i2c->left > 3U) {
    if (WaitOnFlag(i2c, I2C_SR1_RXNE, timeout_ms, tickstart) != HAL_OK) {
      return HAL_TIMEOUT;
    }
    TakeByte(i2c);
    if (i2c->left > 3U && HasFlag(i2c, I2C_SR1_BTF)) {
      TakeByte(i2c);
    }
  }
  return ReceiveLastThree(i2c, timeout_ms, tickstart);
}

HAL_StatusTypeDef I2c_Mem_Read(I2c *i2c, uint16_t device, uint16_t memory, uint8_t *data, uint16_t size,
                               uint32_t timeout_ms)
{
  uint32_t tickstart = HAL_GetTick();
  HAL_StatusTypeDef status = Begin(i2c, I2C_BUSY_RECEIVING, device, memory, size);
  if (status != HAL_OK) {
    return status;
  }
  i2c->data = data;
  status = RequestMemoryRead(i2c, timeout_ms, tickstart);
  if (status == HAL_OK) {
    AnswerReadAddress(i2c);
    status = Receive(i2c, timeout_ms, tickstart);
  }
  i2c->state = I2C_READY;
  return status;
}

HAL_StatusTypeDef I2c_Mem_Write(I2c *i2c, uint16_t device, uint16_t memory, const uint8_t *data, uint16_t size,
                                uint32_t timeout_ms)
{
  uint32_t tickstart = HAL_GetTick();
  HAL_StatusTypeDef status = Begin(i2c, I2C_BUSY_SENDING, device, memory, size);
  if (status != HAL_OK) {
    return status;
  }
  status = RequestMemoryWrite(i2c, timeout_ms, tickstart);
  while (status == HAL_OK && i2c->left > 0U) {
    status = WaitOnFlag(i2c, I2C_SR1_TXE, timeout_ms, tickstart);
    i2c->regs->DR = *data++;
    i2c->left--;
  }
  if (status == HAL_OK) {
    status = WaitOnFlag(i2c, I2C_SR1_BTF, timeout_ms, tickstart);
    i2c->regs->CR1 |= I2C_CR1_STOP;
  }
  i2c->state = I2C_READY;
  return status;
}

/* -- by interrupts ---------------------------------------------------------------------------------------- */

HAL_StatusTypeDef I2c_Mem_Read_IT(I2c *i2c, uint16_t device, uint16_t memory, uint8_t *data, uint16_t size)
{
  HAL_StatusTypeDef status = Begin(i2c, I2C_BUSY_RECEIVING, device, memory, size);
  if (status != HAL_OK) {
    return status;
  }
  i2c->data = data;
  i2c->regs->CR1 |= I2C_CR1_ACK;
  i2c->regs->CR1 |= I2C_CR1_START;
  i2c->regs->CR2 |= ALL_INTERRUPTS;
  return HAL_OK;
}

static void Finish(I2c *i2c)
{
  i2c->regs->CR2 &= ~ALL_INTERRUPTS;
  i2c->state = I2C_READY;
  I2c_MemRxCpltCallback(i2c);
}

static void OnAddress(I2c *i2c)
{
  if (i2c->step == 0U) {
    ClearAddr(i2c);
    i2c->step = 1;
  } else {
    AnswerReadAddress(i2c);
  }
}

/* TXE and BTF stand until the repeated start: the handler comes again and again, and finds nothing to do. */
static void OnTransmit(I2c *i2c)
{
  if (i2c->step == 1U) {
    i2c->regs->DR = i2c->memory;
    i2c->step = 2;
  } else if (i2c->step == 2U) {
    i2c->regs->CR1 |= I2C_CR1_START;
    i2c->step = 3;
  }
}

static void OnByte(I2c *i2c)
{
  if (i2c->left > 3U) {
    TakeByte(i2c);
  } else if (i2c->left > 1U) {
    i2c->regs->CR2 &= ~I2C_CR2_ITBUFEN; /* the last ones are taken in pairs, with BTF */
  } else {
    TakeByte(i2c);
    Finish(i2c);
  }
}

static void OnByteTransferFinished(I2c *i2c)
{
  if (i2c->left == 3U) {
    i2c->regs->CR1 &= ~I2C_CR1_ACK;
    TakeByte(i2c);
  } else if (i2c->left == 2U) {
    i2c->regs->CR1 |= I2C_CR1_STOP;
    TakeByte(i2c);
    TakeByte(i2c);
    Finish(i2c);
  } else {
    TakeByte(i2c);
  }
}

void I2c_EV_IRQHandler(I2c *i2c)
{
  uint32_t enabled = i2c->regs->CR2;
  uint32_t status = i2c->regs->SR1;
  if ((status & I2C_SR1_SB) != 0U && (enabled & I2C_CR2_ITEVTEN) != 0U) {
    i2c->regs->DR = i2c->step == 0U ? i2c->device & ~READ_BIT : i2c->device | READ_BIT;
  } else if ((status & I2C_SR1_ADDR) != 0U && (enabled & I2C_CR2_ITEVTEN) != 0U) {
    OnAddress(i2c);
  } else if ((i2c->regs->SR2 & I2C_SR2_TRA) != 0U) {
    if ((status & (I2C_SR1_TXE | I2C_SR1_BTF)) != 0U) {
      OnTransmit(i2c);
    }
  } else if ((status & I2C_SR1_BTF) != 0U && (enabled & I2C_CR2_ITEVTEN) != 0U) {
    OnByteTransferFinished(i2c);
  } else if ((status & I2C_SR1_RXNE) != 0U && (enabled & I2C_CR2_ITBUFEN) != 0U) {
    OnByte(i2c);
  }
}

void I2c_ER_IRQHandler(I2c *i2c)
{
  uint32_t errors = i2c->regs->SR1 & ERRORS;
  i2c->error |= errors;
  if ((errors & I2C_SR1_AF) != 0U) {
    i2c->regs->CR1 |= I2C_CR1_STOP;
  }
  i2c->regs->SR1 = ~errors;
  i2c->regs->CR2 &= ~ALL_INTERRUPTS;
  i2c->state = I2C_READY;
  I2c_ErrorCallback(i2c);
}

/* -- by DMA ----------------------------------------------------------------------------------------------- */

static void OnDmaComplete(Dma *dma)
{
  I2c *i2c = dma->parent;
  i2c->regs->CR1 |= I2C_CR1_STOP;
  i2c->regs->CR2 &= ~I2C_CR2_LAST;
  i2c->regs->CR2 &= ~I2C_CR2_DMAEN;
  i2c->left = 0;
  i2c->state = I2C_READY;
  I2c_MemRxCpltCallback(i2c);
}

static void OnDmaHalfComplete(Dma *dma) { UNUSED(dma); }

/* The address phases are polled, the bytes come by themselves. */
HAL_StatusTypeDef I2c_Mem_Read_DMA(I2c *i2c, uint16_t device, uint16_t memory, uint8_t *data, uint16_t size)
{
  uint32_t tickstart = HAL_GetTick();
  HAL_StatusTypeDef status = Begin(i2c, I2C_BUSY_RECEIVING, device, memory, size);
  if (status != HAL_OK) {
    return status;
  }
  i2c->receiver->parent = i2c;
  i2c->receiver->complete = OnDmaComplete;
  i2c->receiver->half_complete = OnDmaHalfComplete;
  Dma_Start_IT(i2c->receiver, &i2c->regs->DR, data, size);
  status = RequestMemoryRead(i2c, FLAG_TIMEOUT_MS, tickstart);
  if (status != HAL_OK) {
    i2c->state = I2C_READY;
    return status;
  }
  if (size == 1U) {
    i2c->regs->CR1 &= ~I2C_CR1_ACK;
  } else {
    i2c->regs->CR2 |= I2C_CR2_LAST;
  }
  ClearAddr(i2c);
  i2c->regs->CR2 |= I2C_CR2_ITERREN;
  i2c->regs->CR2 |= I2C_CR2_DMAEN;
  return HAL_OK;
}
