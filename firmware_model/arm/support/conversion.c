/* Conversion of the sensors' output registers to physical units. */
#include "conversion.h"

static int32_t Scaled(const uint8_t *bytes, float per_lsb)
{
  int16_t raw = (int16_t)(bytes[0] | bytes[1] << 8);
  return (int32_t)((float)raw * per_lsb);
}

void AxesFromBytes(const uint8_t bytes[6], float per_lsb, AxesRaw_TypeDef *axes)
{
  axes->AXIS_X = -Scaled(bytes + 2, per_lsb);
  axes->AXIS_Y = Scaled(bytes, per_lsb);
  axes->AXIS_Z = Scaled(bytes + 4, per_lsb);
}

float PressureFromBytes(const uint8_t bytes[3])
{
  /* The 24 bits are a signed number. In the upper bits of a word, they give the word the same sign. */
  uint32_t top = (uint32_t)bytes[0] << 8 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 24;
  int32_t raw = (int32_t)top / 256;
  return (float)(raw * 100 / 4096) / 100.0f;
}

float TemperatureFromBytes(const uint8_t bytes[2])
{
  int16_t raw = (int16_t)(bytes[0] | bytes[1] << 8);
  return (float)(raw * 10 / 100) / 10.0f;
}
