/* LPS22HB: set-up and readings. Registers: LPS22HB datasheet, section 9. The steps are in the order
 * of ST's driver.
 *
 * Decisions: over I2C the output registers are read in one burst. This needs IF_ADD_INC, which
 * ST's driver clears in the same transaction. Over SPI they are read one by one with IF_ADD_INC
 * cleared, and I2C is switched off: CTRL_REG2 = 08. ST's driver writes F8 to it, which also sets
 * BOOT, FIFO_EN and STOP_ON_FTH. This mistake has no effect; it is not repeated here.
 * LPS22HB_WaitForData is new here: before the first conversion, the output is not the pressure at
 * the floor.
 */
#include "lps22hb.h"

#include "conversion.h"

#define WHO_AM_I 0x0FU
#define CTRL_REG1 0x10U
#define CTRL_REG2 0x11U
#define RES_CONF 0x1AU
#define STATUS 0x27U
#define PRESS_OUT_XL 0x28U
#define TEMP_OUT_L 0x2BU

#define WHO_AM_I_VALUE 0xB1U

#define ODR 0x70U
#define EN_LPFP 0x08U
#define LPFP_CFG 0x04U
#define BDU 0x02U
#define SIM_3_WIRE 0x01U
#define BOOT_SWRESET 0x84U
#define IF_ADD_INC 0x10U
#define I2C_DIS 0x08U
#define LC_EN 0x01U
#define P_DA_T_DA 0x03U

#define ODR_25_HZ 0x30U
#define RESET_TIME_MS 1000U
#define FIRST_SAMPLE_TIMEOUT_MS 100 /* two and a half periods at 25 Hz */

static const SensorDevice lps22hb = {0xBA, GPIOC, GPIO_PIN_13}; /* SA0 high: 0x5D in 7 bits */

static DrvStatusTypeDef Update(uint8_t reg, uint8_t mask, uint8_t value)
{
  return Sensor_IO_Update(&lps22hb, reg, mask, value);
}

/* After power-on and after a reset the sensor uses four-wire SPI. A write, which does not need
 * an answer, selects three wires. */
static DrvStatusTypeDef UseThreeWires(void)
{
  return SENSORS_USE_SPI ? Sensor_IO_Write(&lps22hb, CTRL_REG1, SIM_3_WIRE) : COMPONENT_OK;
}

static DrvStatusTypeDef KeepThreeWires(void)
{
  return SENSORS_USE_SPI ? Update(CTRL_REG1, SIM_3_WIRE, SIM_3_WIRE) : COMPONENT_OK;
}

static DrvStatusTypeDef Reset(void)
{
  if (UseThreeWires() != COMPONENT_OK || Update(CTRL_REG2, BOOT_SWRESET, BOOT_SWRESET) != COMPONENT_OK) {
    return COMPONENT_ERROR;
  }
  HAL_Delay(RESET_TIME_MS);
  return UseThreeWires() == COMPONENT_OK ? KeepThreeWires() : COMPONENT_ERROR;
}

DrvStatusTypeDef LPS22HB_Init(void)
{
  if (Reset() != COMPONENT_OK || Sensor_IO_CheckId(&lps22hb, WHO_AM_I, WHO_AM_I_VALUE) != COMPONENT_OK ||
      Update(RES_CONF, LC_EN, LC_EN) != COMPONENT_OK ||
      Update(CTRL_REG1, ODR, 0) != COMPONENT_OK || /* one-shot until enabled */
      Update(CTRL_REG1, EN_LPFP, 0) != COMPONENT_OK || Update(CTRL_REG1, LPFP_CFG, 0) != COMPONENT_OK ||
      Update(CTRL_REG1, BDU, BDU) != COMPONENT_OK ||
      Update(CTRL_REG2, IF_ADD_INC, SENSORS_USE_SPI ? 0 : IF_ADD_INC) != COMPONENT_OK ||
      KeepThreeWires() != COMPONENT_OK) {
    return COMPONENT_ERROR;
  }
  return SENSORS_USE_SPI ? Update(CTRL_REG2, I2C_DIS, I2C_DIS) : COMPONENT_OK;
}

DrvStatusTypeDef LPS22HB_Enable(void)
{
  uint8_t control;
  if (Update(CTRL_REG1, ODR, ODR_25_HZ) != COMPONENT_OK) {
    return COMPONENT_ERROR;
  }
  return Sensor_IO_Read(&lps22hb, CTRL_REG1, &control, 1);
}

DrvStatusTypeDef LPS22HB_WaitForData(void)
{
  for (int waited_ms = 0; waited_ms < FIRST_SAMPLE_TIMEOUT_MS; waited_ms++) {
    uint8_t status;
    if (Sensor_IO_Read(&lps22hb, STATUS, &status, 1) != COMPONENT_OK) {
      return COMPONENT_ERROR;
    }
    if ((status & P_DA_T_DA) == P_DA_T_DA) {
      return COMPONENT_OK;
    }
    HAL_Delay(1);
  }
  return COMPONENT_ERROR;
}

DrvStatusTypeDef LPS22HB_Get_Press(float *press)
{
  uint8_t bytes[3];
  if (Sensor_IO_Read(&lps22hb, PRESS_OUT_XL, bytes, sizeof bytes) != COMPONENT_OK) {
    return COMPONENT_ERROR;
  }
  *press = PressureFromBytes(bytes);
  return COMPONENT_OK;
}

DrvStatusTypeDef LPS22HB_Get_Temp(float *temperature)
{
  uint8_t bytes[2];
  if (Sensor_IO_Read(&lps22hb, TEMP_OUT_L, bytes, sizeof bytes) != COMPONENT_OK) {
    return COMPONENT_ERROR;
  }
  *temperature = TemperatureFromBytes(bytes);
  return COMPONENT_OK;
}
