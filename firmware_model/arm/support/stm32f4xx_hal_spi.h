/* SPI as a polling master on three wires, half duplex (RM0368 section 20), as the board's
 * sensors are connected. */
#ifndef STM32F4XX_HAL_SPI_H
#define STM32F4XX_HAL_SPI_H

#include "stm32f4xx_hal_def.h"

typedef struct {
  uint32_t Mode;
  uint32_t Direction;
  uint32_t DataSize;
  uint32_t CLKPolarity;
  uint32_t CLKPhase;
  uint32_t NSS;
  uint32_t BaudRatePrescaler;
  uint32_t FirstBit;
} SPI_InitTypeDef;

typedef enum { HAL_SPI_STATE_RESET = 0, HAL_SPI_STATE_READY = 1, HAL_SPI_STATE_BUSY = 2 } HAL_SPI_StateTypeDef;

typedef struct {
  SPI_TypeDef *Instance;
  SPI_InitTypeDef Init;
  volatile HAL_SPI_StateTypeDef State;
} SPI_HandleTypeDef;

#define SPI_MODE_MASTER (SPI_CR1_MSTR | SPI_CR1_SSI)
#define SPI_DIRECTION_1LINE SPI_CR1_BIDIMODE
#define SPI_DATASIZE_8BIT 0U
#define SPI_POLARITY_LOW 0U
#define SPI_POLARITY_HIGH SPI_CR1_CPOL
#define SPI_PHASE_1EDGE 0U
#define SPI_PHASE_2EDGE SPI_CR1_CPHA
#define SPI_NSS_SOFT SPI_CR1_SSM
#define SPI_BAUDRATEPRESCALER_8 (2U << SPI_CR1_BR_Pos)
#define SPI_BAUDRATEPRESCALER_16 (3U << SPI_CR1_BR_Pos)
#define SPI_BAUDRATEPRESCALER_32 (4U << SPI_CR1_BR_Pos)
#define SPI_FIRSTBIT_MSB 0U

/* This layer has only the direction SPI_DIRECTION_1LINE; for other directions the result
 * is HAL_ERROR. */
HAL_StatusTypeDef HAL_SPI_Init(SPI_HandleTypeDef *hspi);

/* They return HAL_BUSY if the handle is in use, and HAL_TIMEOUT if a flag is not set within
 * Timeout ms. */
HAL_StatusTypeDef HAL_SPI_Transmit(SPI_HandleTypeDef *hspi, const uint8_t *pData, uint16_t Size, uint32_t Timeout);

/* Receives exactly Size bytes, at prescalers 8 to 32 (see the source). */
HAL_StatusTypeDef HAL_SPI_Receive(SPI_HandleTypeDef *hspi, uint8_t *pData, uint16_t Size, uint32_t Timeout);

#endif
