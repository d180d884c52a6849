/* LAB3 reduced to what its bus does: all sensors 800 times a second, their values once a second. */
#ifndef LAB_H
#define LAB_H

#include "lab3.h"
#include "vendor_i2c.h"

extern AxesRaw_TypeDef acc;
extern AxesRaw_TypeDef gyro;
extern AxesRaw_TypeDef mag;
extern float press;
extern volatile uint32_t samples; /* complete sets since the start */
extern volatile uint32_t errors;

extern I2c i2c2;

/* Boots as LAB3 does, starts the callback, prints for ever. */
void Lab_Run(void);

/* How the program reads registers; polled unless it has its own. */
HAL_StatusTypeDef Bus_Read(uint16_t device, uint8_t reg, uint8_t *data, uint16_t size);

void I2C2_EV_IRQHandler(void);
void I2C2_ER_IRQHandler(void);
void DMA1_Stream2_IRQHandler(void);

#endif
