/* I2C as a polling master with 7-bit addresses (RM0368 section 18). */
#ifndef STM32F4XX_HAL_I2C_H
#define STM32F4XX_HAL_I2C_H

#include "stm32f4xx_hal_def.h"

typedef struct {
  uint32_t ClockSpeed; /* Hz, up to 400 000 */
  uint32_t DutyCycle;
  uint32_t OwnAddress1;
  uint32_t AddressingMode;
  uint32_t DualAddressMode;
  uint32_t OwnAddress2;
  uint32_t GeneralCallMode;
  uint32_t NoStretchMode;
} I2C_InitTypeDef;

typedef enum { HAL_I2C_STATE_RESET = 0x00, HAL_I2C_STATE_READY = 0x20, HAL_I2C_STATE_BUSY = 0x24 } HAL_I2C_StateTypeDef;

typedef struct {
  I2C_TypeDef *Instance;
  I2C_InitTypeDef Init;
  volatile HAL_I2C_StateTypeDef State;
  volatile uint32_t ErrorCode; /* HAL_I2C_ERROR_... of the last call */
} I2C_HandleTypeDef;

#define I2C_DUTYCYCLE_2 0U
#define I2C_DUTYCYCLE_16_9 I2C_CCR_DUTY
#define I2C_ADDRESSINGMODE_7BIT 0x4000U
#define I2C_DUALADDRESS_DISABLE 0U
#define I2C_GENERALCALL_DISABLE 0U
#define I2C_NOSTRETCH_DISABLE 0U
#define I2C_MEMADD_SIZE_8BIT 1U

#define HAL_I2C_ERROR_NONE 0x00U
#define HAL_I2C_ERROR_BERR 0x01U
#define HAL_I2C_ERROR_ARLO 0x02U
#define HAL_I2C_ERROR_AF 0x04U
#define HAL_I2C_ERROR_OVR 0x08U
#define HAL_I2C_ERROR_TIMEOUT 0x20U

/* The peripheral's clock and its pins must be set up before. */
HAL_StatusTypeDef HAL_I2C_Init(I2C_HandleTypeDef *hi2c);

/* For all these functions: device addresses have 8 bits (0xD6 for 0x6B); Timeout, in ms, limits the whole call.
 * The functions return HAL_BUSY if the handle is in use or the bus stays busy for 25 ms, HAL_ERROR if a
 * byte was not acknowledged or the bus failed, and HAL_TIMEOUT if a flag was not set in time. */
HAL_StatusTypeDef HAL_I2C_Master_Transmit(I2C_HandleTypeDef *hi2c, uint16_t DevAddress, const uint8_t *pData,
                                          uint16_t Size, uint32_t Timeout);
HAL_StatusTypeDef HAL_I2C_Master_Receive(I2C_HandleTypeDef *hi2c, uint16_t DevAddress, uint8_t *pData,
                                         uint16_t Size, uint32_t Timeout);
HAL_StatusTypeDef HAL_I2C_Mem_Write(I2C_HandleTypeDef *hi2c, uint16_t DevAddress, uint16_t MemAddress,
                                    uint16_t MemAddSize, const uint8_t *pData, uint16_t Size, uint32_t Timeout);
HAL_StatusTypeDef HAL_I2C_Mem_Read(I2C_HandleTypeDef *hi2c, uint16_t DevAddress, uint16_t MemAddress,
                                   uint16_t MemAddSize, uint8_t *pData, uint16_t Size, uint32_t Timeout);
HAL_StatusTypeDef HAL_I2C_IsDeviceReady(I2C_HandleTypeDef *hi2c, uint16_t DevAddress, uint32_t Trials,
                                        uint32_t Timeout);
uint32_t HAL_I2C_GetError(const I2C_HandleTypeDef *hi2c);

#endif
