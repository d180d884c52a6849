/* Serial peripheral interface (RM0368 section 20.5).
 *
 * Made of emulator/chip/registers/spi.py, by python -m fcu_emulator.emulator.chip.registers. */
#ifndef FCU_REGISTERS_SPI_H
#define FCU_REGISTERS_SPI_H

#include <stdint.h>

/* Control 1. */
enum { CR1 = 0x00 };
#define CR1_STORED 0x0000FFFFu
#define CR1_BIDIMODE 0x00008000u
#define CR1_BIDIOE 0x00004000u
#define CR1_CRCEN 0x00002000u
#define CR1_CRCNEXT 0x00001000u
#define CR1_DFF 0x00000800u
#define CR1_RXONLY 0x00000400u
#define CR1_SSM 0x00000200u
#define CR1_SSI 0x00000100u
#define CR1_LSBFIRST 0x00000080u
#define CR1_SPE 0x00000040u
#define CR1_BR 0x00000038u
#define CR1_BR_SHIFT 3
#define CR1_MSTR 0x00000004u
#define CR1_CPOL 0x00000002u
#define CR1_CPHA 0x00000001u

/* Control 2. */
enum { CR2 = 0x04 };
#define CR2_STORED 0x000000F7u
#define CR2_TXEIE 0x00000080u
#define CR2_RXNEIE 0x00000040u
#define CR2_ERRIE 0x00000020u
#define CR2_FRF 0x00000010u
#define CR2_SSOE 0x00000004u
#define CR2_TXDMAEN 0x00000002u
#define CR2_RXDMAEN 0x00000001u

/* Status. */
enum { SR = 0x08 };
#define SR_RESET 0x00000002u
#define SR_FRE 0x00000100u
#define SR_BSY 0x00000080u
#define SR_OVR 0x00000040u
#define SR_MODF 0x00000020u
#define SR_CRCERR 0x00000010u
#define SR_UDR 0x00000008u
#define SR_CHSIDE 0x00000004u
#define SR_TXE 0x00000002u
#define SR_RXNE 0x00000001u

/* Data. */
enum { DR = 0x0C };
#define DR_STORED 0x0000FFFFu
#define DR_DR 0x0000FFFFu
#define DR_DR_SHIFT 0

/* CRC polynomial. */
enum { CRCPR = 0x10 };
#define CRCPR_RESET 0x00000007u
#define CRCPR_STORED 0x0000FFFFu
#define CRCPR_CRCPOLY 0x0000FFFFu
#define CRCPR_CRCPOLY_SHIFT 0

/* CRC of what was received. */
enum { RXCRCR = 0x14 };
#define RXCRCR_RXCRC 0x0000FFFFu
#define RXCRCR_RXCRC_SHIFT 0

/* CRC of what was sent. */
enum { TXCRCR = 0x18 };
#define TXCRCR_TXCRC 0x0000FFFFu
#define TXCRCR_TXCRC_SHIFT 0

/* I2S configuration. */
enum { I2SCFGR = 0x1C };
#define I2SCFGR_STORED 0x00000FBFu
#define I2SCFGR_I2SMOD 0x00000800u
#define I2SCFGR_I2SE 0x00000400u
#define I2SCFGR_I2SCFG 0x00000300u
#define I2SCFGR_I2SCFG_SHIFT 8
#define I2SCFGR_PCMSYNC 0x00000080u
#define I2SCFGR_I2SSTD 0x00000030u
#define I2SCFGR_I2SSTD_SHIFT 4
#define I2SCFGR_CKPOL 0x00000008u
#define I2SCFGR_DATLEN 0x00000006u
#define I2SCFGR_DATLEN_SHIFT 1
#define I2SCFGR_CHLEN 0x00000001u

/* I2S prescaler. */
enum { I2SPR = 0x20 };
#define I2SPR_RESET 0x00000002u
#define I2SPR_STORED 0x000003FFu
#define I2SPR_MCKOE 0x00000200u
#define I2SPR_ODD 0x00000100u
#define I2SPR_I2SDIV 0x000000FFu
#define I2SPR_I2SDIV_SHIFT 0

/* All of them; -1 ends the list. */
static const int16_t SPI_OFFSETS[] = {
  0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x18, 0x1C,
  0x20,
  -1,
};

#endif
