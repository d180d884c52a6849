/* LSM6DSL: set-up and readings. Registers: LSM6DSL datasheet, sections 9 and 10.
 *
 * The order of the steps is that of ST's driver. Over SPI, a write first selects three wires,
 * and a later write switches the I2C interface off, as in ST's driver. Over I2C both steps are
 * omitted.
 */
#include "lsm6dsl.h"

#include "conversion.h"

#define FIFO_CTRL5 0x0AU
#define WHO_AM_I 0x0FU
#define CTRL1_XL 0x10U
#define CTRL2_G 0x11U
#define CTRL3_C 0x12U
#define CTRL4_C 0x13U
#define CTRL6_C 0x15U
#define CTRL8_XL 0x17U
#define OUTX_L_G 0x22U
#define OUTX_L_XL 0x28U

#define WHO_AM_I_VALUE 0x6AU

#define FIFO_MODE 0x07U
#define ODR 0xF0U
#define FS 0x0CU
#define BW0_XL 0x01U
#define BDU 0x40U
#define SIM_3_WIRE 0x08U
#define IF_INC 0x04U
#define I2C_DISABLE 0x04U
#define FTYPE 0x03U
#define LPF2_XL_EN 0x80U
#define HPCF_XL 0x60U
#define INPUT_COMPOSITE 0x08U

#define ODR_104_HZ 0x40U
#define ODR_6660_HZ 0xA0U
#define FS_XL_2_G 0x00U
#define FS_XL_4_G 0x08U
#define FS_G_2000_DPS 0x0CU
#define HPCF_XL_ODR_400 0x60U
#define CTRL2_G_416_HZ_2000_DPS 0x6CU

static const SensorDevice lsm6dsl = {0xD6, GPIOA, GPIO_PIN_8}; /* SA0 high: 0x6B in 7 bits */

static DrvStatusTypeDef Update(uint8_t reg, uint8_t mask, uint8_t value)
{
  return Sensor_IO_Update(&lsm6dsl, reg, mask, value);
}

/* The first steps are the same for accelerometer and gyroscope. The next two steps write the
 * output data rate 0 (power-down) and the range. */
static DrvStatusTypeDef Init(uint8_t control, uint8_t full_scale)
{
  if (Sensor_IO_CheckId(&lsm6dsl, WHO_AM_I, WHO_AM_I_VALUE) != COMPONENT_OK ||
      Update(CTRL3_C, IF_INC, IF_INC) != COMPONENT_OK || Update(CTRL3_C, BDU, BDU) != COMPONENT_OK ||
      Update(FIFO_CTRL5, FIFO_MODE, 0) != COMPONENT_OK || Update(control, ODR, 0) != COMPONENT_OK ||
      Update(control, FS, full_scale) != COMPONENT_OK) {
    return COMPONENT_ERROR;
  }
  return SENSORS_USE_SPI ? Update(CTRL4_C, I2C_DISABLE, I2C_DISABLE) : COMPONENT_OK;
}

DrvStatusTypeDef LSM6DSL_X_Init(void)
{
  if (SENSORS_USE_SPI && Sensor_IO_Write(&lsm6dsl, CTRL3_C, SIM_3_WIRE | IF_INC) != COMPONENT_OK) {
    return COMPONENT_ERROR;
  }
  return Init(CTRL1_XL, FS_XL_2_G);
}

DrvStatusTypeDef LSM6DSL_G_Init(void) { return Init(CTRL2_G, FS_G_2000_DPS); }

DrvStatusTypeDef LSM6DSL_X_Enable(void) { return Update(CTRL1_XL, ODR, ODR_104_HZ); }

DrvStatusTypeDef LSM6DSL_G_Enable(void) { return Update(CTRL2_G, ODR, ODR_104_HZ); }

void LSM6DSL_FlightSetup(void)
{
  Update(CTRL1_XL, ODR, ODR_6660_HZ);
  Update(CTRL1_XL, FS, FS_XL_4_G);
  Update(CTRL8_XL, INPUT_COMPOSITE, 0); /* ODR/2 */
  Update(CTRL8_XL, LPF2_XL_EN, LPF2_XL_EN);
  Update(CTRL8_XL, HPCF_XL, HPCF_XL_ODR_400);
  Update(CTRL1_XL, BW0_XL, 0); /* analog bandwidth 1.5 kHz */
  Update(CTRL6_C, FTYPE, 0x01);
  Sensor_IO_Write(&lsm6dsl, CTRL2_G, CTRL2_G_416_HZ_2000_DPS);
}

static DrvStatusTypeDef GetAxes(uint8_t reg, float per_lsb, AxesRaw_TypeDef *axes)
{
  uint8_t bytes[6];
  if (Sensor_IO_Read(&lsm6dsl, reg, bytes, sizeof bytes) != COMPONENT_OK) {
    return COMPONENT_ERROR;
  }
  AxesFromBytes(bytes, per_lsb, axes);
  return COMPONENT_OK;
}

DrvStatusTypeDef LSM6DSL_X_GetAxes(AxesRaw_TypeDef *acc) { return GetAxes(OUTX_L_XL, ACC_MG_PER_LSB, acc); }

DrvStatusTypeDef LSM6DSL_G_GetAxes(AxesRaw_TypeDef *gyro) { return GetAxes(OUTX_L_G, GYRO_MDPS_PER_LSB, gyro); }
