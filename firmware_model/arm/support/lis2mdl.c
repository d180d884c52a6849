/* LIS2MDL: set-up and readings. Registers: LIS2MDL datasheet, section 8. After reset the sensor uses 3-wire SPI. */
#include "lis2mdl.h"

#include "conversion.h"

#define WHO_AM_I 0x4FU
#define CFG_REG_A 0x60U
#define CFG_REG_B 0x61U
#define CFG_REG_C 0x62U
#define OUTX_L_REG 0x68U

#define WHO_AM_I_VALUE 0x40U

#define MD 0x03U
#define ODR 0x0CU
#define BDU 0x10U
#define SELF_TEST 0x02U

#define MD_CONTINUOUS 0x00U
#define MD_IDLE 0x03U
#define ODR_100_HZ 0x0CU
#define CFG_REG_A_COMP_TEMP_100_HZ 0x8CU
#define CFG_REG_B_OFF_CANC 0x02U

static const SensorDevice lis2mdl = {0x3C, GPIOB, GPIO_PIN_12}; /* 0x1E in 7 bits */

static DrvStatusTypeDef Update(uint8_t reg, uint8_t mask, uint8_t value)
{
  return Sensor_IO_Update(&lis2mdl, reg, mask, value);
}

DrvStatusTypeDef LIS2MDL_Init(void)
{
  if (Sensor_IO_CheckId(&lis2mdl, WHO_AM_I, WHO_AM_I_VALUE) != COMPONENT_OK ||
      Update(CFG_REG_A, MD, MD_IDLE) != COMPONENT_OK || Update(CFG_REG_C, BDU, BDU) != COMPONENT_OK ||
      Update(CFG_REG_A, ODR, ODR_100_HZ) != COMPONENT_OK) {
    return COMPONENT_ERROR;
  }
  return Update(CFG_REG_C, SELF_TEST, 0);
}

DrvStatusTypeDef LIS2MDL_Enable(void) { return Update(CFG_REG_A, MD, MD_CONTINUOUS); }

void LIS2MDL_FlightSetup(void)
{
  Sensor_IO_Write(&lis2mdl, CFG_REG_A, CFG_REG_A_COMP_TEMP_100_HZ);
  Sensor_IO_Write(&lis2mdl, CFG_REG_B, CFG_REG_B_OFF_CANC);
}

DrvStatusTypeDef LIS2MDL_GetAxes(AxesRaw_TypeDef *mag)
{
  uint8_t bytes[6];
  if (Sensor_IO_Read(&lis2mdl, OUTX_L_REG, bytes, sizeof bytes) != COMPONENT_OK) {
    return COMPONENT_ERROR;
  }
  AxesFromBytes(bytes, MAG_MGAUSS_PER_LSB, mag);
  return COMPONENT_OK;
}
