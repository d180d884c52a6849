/* Peripherals in C: X(type, member of struct Chip, create function).
 *
 * The order of this list determines the indices and the order of simultaneous events. Add new peripherals at the end,
 * and include their header.
 */
#ifndef FCU_LIST_H
#define FCU_LIST_H

#include "peripherals/adc.h"
#include "peripherals/crc.h"
#include "peripherals/dma.h"
#include "peripherals/dwt.h"
#include "peripherals/exti.h"
#include "peripherals/gpio.h"
#include "peripherals/i2c.h"
#include "peripherals/scb.h"
#include "peripherals/spi.h"
#include "peripherals/systick.h"
#include "peripherals/tim.h"
#include "peripherals/usart.h"

#define EACH_PERIPHERAL(X)            \
  X(Dwt, dwt, dwt_create)             \
  X(Scb, scb, scb_create)             \
  X(SysTick, systick, systick_create) \
  X(Gpio, gpio, gpio_create)          \
  X(Syscfg, syscfg, syscfg_create)    \
  X(Exti, exti, exti_create)          \
  X(Timers, timers, timers_create)    \
  X(Dma, dma, dma_create)             \
  X(Usarts, usarts, usarts_create)    \
  X(I2c, i2c[I2C_COUNT], i2c_create)  \
  X(Spi, spi[SPIS], spi_create)       \
  X(Crc, crc, crc_create)             \
  X(Adc, adc, adc_create)

#endif
