/* I2C as a polling master (RM0368 section 18.3.3).
 *
 * Decision: bytes are received in pairs. BTF shows that one byte waits in DR and the next one in the shift register,
 * while the clock is stretched; then both bytes are read. So the code waits half as often as with a check of RXNE for
 * each byte. The last three bytes must be read while BTF is set: the clock is stretched then, so that an interrupt
 * cannot change which byte gets the acknowledge bit and the stop.
 *
 * CR1 is always written as a whole. This code changes only START, STOP, ACK and POS; each write gives a value to all
 * four.
 */
#include "stm32f4xx_hal.h"

#define BUSY_TIMEOUT_MS 25U
#define READ_BIT 1U
#define SR1_ERRORS (I2C_SR1_BERR | I2C_SR1_ARLO | I2C_SR1_AF | I2C_SR1_OVR)
#define SR1_ERROR_SHIFT 8 /* BERR, ARLO, AF, OVR of SR1 are bits 0 to 3 of ErrorCode */
#define STANDARD_MODE_HZ 100000U

typedef struct {
  I2C_HandleTypeDef *handle;
  I2C_TypeDef *regs;
  uint32_t enabled; /* CR1 between two actions */
  uint32_t tickstart;
  uint32_t timeout_ms;
} Transfer;

HAL_StatusTypeDef HAL_I2C_Init(I2C_HandleTypeDef *hi2c)
{
  I2C_TypeDef *regs = hi2c->Instance;
  uint32_t pclk1 = HAL_RCC_GetPCLK1Freq();
  uint32_t pclk1_mhz = pclk1 / 1000000U;
  uint32_t speed = hi2c->Init.ClockSpeed;
  uint32_t divider; /* Hz; CCR is PCLK1 / divider, rounded up */

  regs->CR1 = 0;
  regs->CR2 = pclk1_mhz;
  if (speed <= STANDARD_MODE_HZ) {
    regs->TRISE = pclk1_mhz + 1U; /* 1000 ns */
    divider = speed * 2U;
    regs->CCR = (pclk1 + divider - 1U) / divider;
  } else {
    regs->TRISE = pclk1_mhz * 300U / 1000U + 1U; /* 300 ns */
    divider = speed * (hi2c->Init.DutyCycle == I2C_DUTYCYCLE_2 ? 3U : 25U);
    regs->CCR = I2C_CCR_FS | hi2c->Init.DutyCycle | ((pclk1 + divider - 1U) / divider);
  }
  regs->OAR1 = hi2c->Init.AddressingMode | hi2c->Init.OwnAddress1;
  regs->CR1 = hi2c->Init.GeneralCallMode | hi2c->Init.NoStretchMode | I2C_CR1_PE;
  hi2c->ErrorCode = HAL_I2C_ERROR_NONE;
  hi2c->State = HAL_I2C_STATE_READY;
  return HAL_OK;
}

/* -- one transfer ----------------------------------------------------------------------------------------- */

static HAL_StatusTypeDef Begin(Transfer *transfer, I2C_HandleTypeDef *hi2c, uint32_t timeout_ms)
{
  if (hi2c->State != HAL_I2C_STATE_READY) {
    return HAL_BUSY;
  }
  uint32_t tickstart = HAL_GetTick();
  while ((hi2c->Instance->SR2 & I2C_SR2_BUSY) != 0U) {
    if (HAL_Expired(tickstart, BUSY_TIMEOUT_MS)) {
      return HAL_BUSY;
    }
  }
  hi2c->State = HAL_I2C_STATE_BUSY;
  hi2c->ErrorCode = HAL_I2C_ERROR_NONE;
  transfer->handle = hi2c;
  transfer->regs = hi2c->Instance;
  transfer->enabled = hi2c->Init.GeneralCallMode | hi2c->Init.NoStretchMode | I2C_CR1_PE;
  transfer->tickstart = tickstart;
  transfer->timeout_ms = timeout_ms;
  return HAL_OK;
}

static HAL_StatusTypeDef End(Transfer *transfer, HAL_StatusTypeDef status)
{
  transfer->handle->State = HAL_I2C_STATE_READY;
  return status;
}

static void Stop(Transfer *transfer) { transfer->regs->CR1 = transfer->enabled | I2C_CR1_STOP; }

static HAL_StatusTypeDef Fail(Transfer *transfer, uint32_t sr1)
{
  transfer->handle->ErrorCode |= (sr1 & SR1_ERRORS) >> SR1_ERROR_SHIFT;
  transfer->regs->SR1 = ~SR1_ERRORS; /* each is cleared by writing 0 */
  Stop(transfer);
  return HAL_ERROR;
}

/* Waits for a flag of SR1; an error ends the transfer with a stop. */
static HAL_StatusTypeDef WaitFor(Transfer *transfer, uint32_t flag)
{
  for (;;) {
    /* The time is read first, so that a flag counts if it was set in time, even after a
       long interrupt. */
    int expired = HAL_Expired(transfer->tickstart, transfer->timeout_ms);
    uint32_t sr1 = transfer->regs->SR1;
    if ((sr1 & SR1_ERRORS) != 0U) {
      return Fail(transfer, sr1);
    }
    if ((sr1 & flag) != 0U) {
      return HAL_OK;
    }
    if (expired) {
      transfer->handle->ErrorCode |= HAL_I2C_ERROR_TIMEOUT;
      return HAL_TIMEOUT;
    }
  }
}

/* Sends a start or repeated start condition, then the address. On return ADDR is set and stretches the clock. */
static HAL_StatusTypeDef Address(Transfer *transfer, uint32_t address)
{
  transfer->regs->CR1 = transfer->enabled | I2C_CR1_ACK | I2C_CR1_START;
  HAL_StatusTypeDef status = WaitFor(transfer, I2C_SR1_SB);
  if (status != HAL_OK) {
    return status;
  }
  transfer->regs->DR = address;
  return WaitFor(transfer, I2C_SR1_ADDR);
}

/* ADDR is cleared by reading SR1, which WaitFor has done, and then SR2. */
static void ClearAddr(Transfer *transfer) { (void)transfer->regs->SR2; }

static HAL_StatusTypeDef SendAddress(Transfer *transfer, uint16_t device)
{
  HAL_StatusTypeDef status = Address(transfer, device & ~READ_BIT);
  if (status == HAL_OK) {
    ClearAddr(transfer);
  }
  return status;
}

static HAL_StatusTypeDef SendBytes(Transfer *transfer, const uint8_t *data, uint32_t size)
{
  for (; size > 0U; size--) {
    HAL_StatusTypeDef status = WaitFor(transfer, I2C_SR1_TXE);
    if (status != HAL_OK) {
      return status;
    }
    transfer->regs->DR = *data++;
  }
  return HAL_OK;
}

/* The stop must not come before the last byte has been sent and acknowledged. */
static HAL_StatusTypeDef Finish(Transfer *transfer)
{
  HAL_StatusTypeDef status = WaitFor(transfer, I2C_SR1_BTF);
  if (status == HAL_OK) {
    Stop(transfer);
  }
  return status;
}

/* -- receiving: RM0368 18.3.3, "Master receiver", by the number of bytes --------------------------------------- */

static HAL_StatusTypeDef ReceiveOne(Transfer *transfer, uint8_t *data)
{
  transfer->regs->CR1 = transfer->enabled; /* no acknowledge */
  /* The stop must be set before the byte arrives, so no interrupt may come in between. */
  uint32_t primask = __get_PRIMASK();
  __disable_irq();
  ClearAddr(transfer);
  Stop(transfer);
  __set_PRIMASK(primask);
  HAL_StatusTypeDef status = WaitFor(transfer, I2C_SR1_RXNE);
  if (status == HAL_OK) {
    data[0] = (uint8_t)transfer->regs->DR;
  }
  return status;
}

/* While BTF is set, both bytes wait; the second is not acknowledged. Sets the stop, then reads both. */
static HAL_StatusTypeDef TakeLastTwo(Transfer *transfer, uint8_t *data)
{
  HAL_StatusTypeDef status = WaitFor(transfer, I2C_SR1_BTF);
  if (status == HAL_OK) {
    Stop(transfer);
    data[0] = (uint8_t)transfer->regs->DR;
    data[1] = (uint8_t)transfer->regs->DR;
  }
  return status;
}

static HAL_StatusTypeDef ReceiveTwo(Transfer *transfer, uint8_t *data)
{
  transfer->regs->CR1 = transfer->enabled | I2C_CR1_POS; /* the second byte is not acknowledged */
  ClearAddr(transfer);
  return TakeLastTwo(transfer, data);
}

static HAL_StatusTypeDef ReceiveMany(Transfer *transfer, uint8_t *data, uint32_t size)
{
  ClearAddr(transfer);
  while (size > 3U) {
    /* If an even number remains, one byte is read instead of two, so that the loop ends with three. */
    uint32_t count = size % 2U == 0U ? 1U : 2U;
    HAL_StatusTypeDef status = WaitFor(transfer, I2C_SR1_BTF);
    if (status != HAL_OK) {
      return status;
    }
    size -= count;
    for (; count > 0U; count--) {
      *data++ = (uint8_t)transfer->regs->DR;
    }
  }
  /* Byte N-2 is in DR, byte N-1 in the shift register. Byte N, which starts when byte N-2 is
     read, is not acknowledged. */
  HAL_StatusTypeDef status = WaitFor(transfer, I2C_SR1_BTF);
  if (status != HAL_OK) {
    return status;
  }
  transfer->regs->CR1 = transfer->enabled;
  data[0] = (uint8_t)transfer->regs->DR;
  return TakeLastTwo(transfer, data + 1);
}

static HAL_StatusTypeDef ReceiveBytes(Transfer *transfer, uint16_t device, uint8_t *data, uint32_t size)
{
  HAL_StatusTypeDef status = Address(transfer, device | READ_BIT);
  if (status != HAL_OK) {
    return status;
  }
  switch (size) {
  case 0:
    ClearAddr(transfer);
    Stop(transfer);
    return HAL_OK;
  case 1:
    return ReceiveOne(transfer, data);
  case 2:
    return ReceiveTwo(transfer, data);
  default:
    return ReceiveMany(transfer, data, size);
  }
}

/* -- the calls ---------------------------------------------------------------------------------------------- */

HAL_StatusTypeDef HAL_I2C_Master_Transmit(I2C_HandleTypeDef *hi2c, uint16_t DevAddress, const uint8_t *pData,
                                          uint16_t Size, uint32_t Timeout)
{
  Transfer transfer;
  HAL_StatusTypeDef status = Begin(&transfer, hi2c, Timeout);
  if (status != HAL_OK) {
    return status;
  }
  status = SendAddress(&transfer, DevAddress);
  if (status == HAL_OK) {
    status = SendBytes(&transfer, pData, Size);
  }
  return End(&transfer, status == HAL_OK ? Finish(&transfer) : status);
}

HAL_StatusTypeDef HAL_I2C_Master_Receive(I2C_HandleTypeDef *hi2c, uint16_t DevAddress, uint8_t *pData,
                                         uint16_t Size, uint32_t Timeout)
{
  Transfer transfer;
  HAL_StatusTypeDef status = Begin(&transfer, hi2c, Timeout);
  if (status != HAL_OK) {
    return status;
  }
  return End(&transfer, ReceiveBytes(&transfer, DevAddress, pData, Size));
}

/* Sends address and register number, the beginning of each write or read of a device's register. */
static HAL_StatusTypeDef SendRegister(Transfer *transfer, uint16_t device, uint16_t address, uint16_t size)
{
  uint8_t bytes[2] = {(uint8_t)(address >> 8), (uint8_t)address};
  HAL_StatusTypeDef status = SendAddress(transfer, device);
  if (status != HAL_OK) {
    return status;
  }
  return size == I2C_MEMADD_SIZE_8BIT ? SendBytes(transfer, &bytes[1], 1) : SendBytes(transfer, bytes, 2);
}

HAL_StatusTypeDef HAL_I2C_Mem_Write(I2C_HandleTypeDef *hi2c, uint16_t DevAddress, uint16_t MemAddress,
                                    uint16_t MemAddSize, const uint8_t *pData, uint16_t Size, uint32_t Timeout)
{
  Transfer transfer;
  HAL_StatusTypeDef status = Begin(&transfer, hi2c, Timeout);
  if (status != HAL_OK) {
    return status;
  }
  status = SendRegister(&transfer, DevAddress, MemAddress, MemAddSize);
  if (status == HAL_OK) {
    status = SendBytes(&transfer, pData, Size);
  }
  return End(&transfer, status == HAL_OK ? Finish(&transfer) : status);
}

HAL_StatusTypeDef HAL_I2C_Mem_Read(I2C_HandleTypeDef *hi2c, uint16_t DevAddress, uint16_t MemAddress,
                                   uint16_t MemAddSize, uint8_t *pData, uint16_t Size, uint32_t Timeout)
{
  Transfer transfer;
  HAL_StatusTypeDef status = Begin(&transfer, hi2c, Timeout);
  if (status != HAL_OK) {
    return status;
  }
  status = SendRegister(&transfer, DevAddress, MemAddress, MemAddSize);
  if (status == HAL_OK) {
    /* The register number must be acknowledged before the repeated start. */
    status = WaitFor(&transfer, I2C_SR1_BTF);
  }
  return End(&transfer, status == HAL_OK ? ReceiveBytes(&transfer, DevAddress, pData, Size) : status);
}

HAL_StatusTypeDef HAL_I2C_IsDeviceReady(I2C_HandleTypeDef *hi2c, uint16_t DevAddress, uint32_t Trials,
                                        uint32_t Timeout)
{
  Transfer transfer;
  HAL_StatusTypeDef status = HAL_ERROR;
  for (; Trials > 0U && status != HAL_OK; Trials--) {
    status = Begin(&transfer, hi2c, Timeout);
    if (status != HAL_OK) {
      return status;
    }
    status = SendAddress(&transfer, DevAddress);
    if (status == HAL_OK) {
      Stop(&transfer);
    }
    End(&transfer, status);
  }
  return status;
}

uint32_t HAL_I2C_GetError(const I2C_HandleTypeDef *hi2c) { return hi2c->ErrorCode; }
