/* I2C2 as a master in the vendor's three styles: polled flag by flag, by interrupts, by DMA. */
#ifndef VENDOR_I2C_H
#define VENDOR_I2C_H

#include "vendor.h"
#include "vendor_dma.h"

typedef enum { I2C_READY, I2C_BUSY_RECEIVING, I2C_BUSY_SENDING } I2cState;

typedef struct I2c I2c;

struct I2c {
  I2C_TypeDef *regs;
  Dma *receiver;
  volatile I2cState state;
  volatile uint32_t error; /* AF, ARLO, BERR, OVR as in SR1 */
  uint16_t device;
  uint16_t memory;
  uint8_t *data;
  volatile uint16_t left;
  volatile uint32_t step; /* 0: address to be sent, 1: register's number to be sent, 2: to be restarted, 3: restarted */
};

/* Each gives HAL_BUSY while a transfer is under way. */
HAL_StatusTypeDef I2c_Mem_Read(I2c *i2c, uint16_t device, uint16_t memory, uint8_t *data, uint16_t size,
                               uint32_t timeout_ms);
HAL_StatusTypeDef I2c_Mem_Write(I2c *i2c, uint16_t device, uint16_t memory, const uint8_t *data, uint16_t size,
                                uint32_t timeout_ms);
HAL_StatusTypeDef I2c_Mem_Read_IT(I2c *i2c, uint16_t device, uint16_t memory, uint8_t *data, uint16_t size);
HAL_StatusTypeDef I2c_Mem_Read_DMA(I2c *i2c, uint16_t device, uint16_t memory, uint8_t *data, uint16_t size);

/* Called from the interrupt handlers. */
void I2c_EV_IRQHandler(I2c *i2c);
void I2c_ER_IRQHandler(I2c *i2c);

/* Yours to write; these, which do nothing, are weak. */
void I2c_MemRxCpltCallback(I2c *i2c);
void I2c_ErrorCallback(I2c *i2c);

#endif
