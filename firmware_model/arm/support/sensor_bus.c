/* Functions that are the same for both buses. */
#include "sensor_bus.h"

DrvStatusTypeDef Sensor_IO_Update(const SensorDevice *device, uint8_t reg, uint8_t mask, uint8_t value)
{
  uint8_t old;
  if (Sensor_IO_Read(device, reg, &old, 1) != COMPONENT_OK) {
    return COMPONENT_ERROR;
  }
  return Sensor_IO_Write(device, reg, (uint8_t)((old & ~mask) | value));
}

DrvStatusTypeDef Sensor_IO_CheckId(const SensorDevice *device, uint8_t reg, uint8_t expected)
{
  uint8_t id;
  if (Sensor_IO_Read(device, reg, &id, 1) != COMPONENT_OK) {
    return COMPONENT_ERROR;
  }
  return id == expected ? COMPONENT_OK : COMPONENT_ERROR;
}
