/* The sensors' bus: reads and writes of a device's registers. Either sensor_bus_i2c2.c or
 * sensor_bus_spi2.c is built (make BUS=I2C2 or BUS=SPI2).
 */
#ifndef SENSOR_BUS_H
#define SENSOR_BUS_H

#include "stm32f4xx_hal.h"

typedef enum { COMPONENT_OK = 0, COMPONENT_ERROR = 1 } DrvStatusTypeDef;

typedef struct {
  uint16_t i2c_address; /* 8 bits, as the HAL requires */
  GPIO_TypeDef *cs_port;
  uint16_t cs_pin;
} SensorDevice;

/* 1 if the sensors are on SPI2, which has three wires and chip selects instead of addresses. */
#ifdef SENSORS_ON_SPI2
#define SENSORS_USE_SPI 1
extern SPI_HandleTypeDef hspi2;
#else
#define SENSORS_USE_SPI 0
extern I2C_HandleTypeDef hi2c2;
#endif

/* Sets up the bus and its pins. */
void MX_SensorBus_Init(void);

/* Read consecutive registers: over I2C in one burst, over SPI one by one, as ST's firmware does. */
DrvStatusTypeDef Sensor_IO_Read(const SensorDevice *device, uint8_t reg, uint8_t *data, uint16_t size);
DrvStatusTypeDef Sensor_IO_Write(const SensorDevice *device, uint8_t reg, uint8_t value);

/* Changes a field with exactly one read and one write; mask and value are at its bit position. */
DrvStatusTypeDef Sensor_IO_Update(const SensorDevice *device, uint8_t reg, uint8_t mask, uint8_t value);

/* Returns COMPONENT_OK if the identification register has the expected value. */
DrvStatusTypeDef Sensor_IO_CheckId(const SensorDevice *device, uint8_t reg, uint8_t expected);

#endif
