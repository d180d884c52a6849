/* The callback starts the first read; the interrupt that ends one starts the next. Nothing waits but the main loop,
 * for its second. During the boot a read is started and its end is waited for.
 */
#include "conversion.h"
#include "lab.h"

typedef struct {
  uint16_t device;
  uint8_t reg;
  uint8_t size;
} Read;

static const Read reads[] = {{0xD6, 0x28, 6}, {0xD6, 0x22, 6}, {0x3C, 0x68, 6}, {0xBA, 0x28, 3}};
#define READS (sizeof reads / sizeof *reads)

static uint8_t bytes[READS][6];
static volatile uint32_t chained; /* number of the read that is under way, plus 1; 0 for none */

int main(void)
{
  Lab_Run();
}

static void StartRead(uint32_t number)
{
  const Read *read = &reads[number];
  chained = number + 1U;
  if (I2c_Mem_Read_IT(&i2c2, read->device, read->reg, bytes[number], read->size) != HAL_OK) {
    errors++;
    chained = 0;
  }
}

static void TakeSample(void)
{
  AxesFromBytes(bytes[0], ACC_MG_PER_LSB, &acc);
  AxesFromBytes(bytes[1], GYRO_MDPS_PER_LSB, &gyro);
  AxesFromBytes(bytes[2], MAG_MGAUSS_PER_LSB, &mag);
  press = PressureFromBytes(bytes[3]);
  samples++;
}

void I2c_MemRxCpltCallback(I2c *i2c)
{
  UNUSED(i2c);
  if (chained == READS) {
    chained = 0;
    TakeSample();
  } else if (chained != 0U) {
    StartRead(chained);
  }
}

void I2c_ErrorCallback(I2c *i2c)
{
  UNUSED(i2c);
  errors++;
  chained = 0;
}

HAL_StatusTypeDef Bus_Read(uint16_t device, uint8_t reg, uint8_t *data, uint16_t size)
{
  HAL_StatusTypeDef status = I2c_Mem_Read_IT(&i2c2, device, reg, data, size);
  while (status == HAL_OK && i2c2.state != I2C_READY) {
  }
  return status == HAL_OK && i2c2.error != 0U ? HAL_ERROR : status;
}

void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  if (chained == 0U) {
    StartRead(0);
  } else {
    errors++;
  }
}
