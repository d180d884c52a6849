/* SPI in the vendor's sensor driver's style: one byte after the other, each flag polled, without time-outs. */
#ifndef VENDOR_SPI_H
#define VENDOR_SPI_H

#include "vendor.h"

/* Three wires, half duplex: BIDIMODE, the direction by BIDIOE. Interrupts are off while SPE is pulsed. */
void Spi_InitThreeWires(SPI_TypeDef *regs);
void Spi_Send(SPI_TypeDef *regs, uint8_t value);
void Spi_ReceiveBytes(SPI_TypeDef *regs, uint8_t *data, uint32_t size);

/* Full duplex: bytes out and in at the same time. */
void Spi_InitFullDuplex(SPI_TypeDef *regs);
uint8_t Spi_Exchange(SPI_TypeDef *regs, uint8_t value);

#endif
