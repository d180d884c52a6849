/* Inter-integrated circuit interface (RM0368 section 18.6).
 *
 * Made of emulator/chip/registers/i2c.py, by python -m fcu_emulator.emulator.chip.registers. */
#ifndef FCU_REGISTERS_I2C_H
#define FCU_REGISTERS_I2C_H

#include <stdint.h>

/* Control 1. */
enum { CR1 = 0x00 };
#define CR1_STORED 0x0000BFFBu
#define CR1_SWRST 0x00008000u
#define CR1_ALERT 0x00002000u
#define CR1_PEC 0x00001000u
#define CR1_POS 0x00000800u
#define CR1_ACK 0x00000400u
#define CR1_STOP 0x00000200u
#define CR1_START 0x00000100u
#define CR1_NOSTRETCH 0x00000080u
#define CR1_ENGC 0x00000040u
#define CR1_ENPEC 0x00000020u
#define CR1_ENARP 0x00000010u
#define CR1_SMBTYPE 0x00000008u
#define CR1_SMBUS 0x00000002u
#define CR1_PE 0x00000001u

/* Control 2. */
enum { CR2 = 0x04 };
#define CR2_STORED 0x00001F3Fu
#define CR2_LAST 0x00001000u
#define CR2_DMAEN 0x00000800u
#define CR2_ITBUFEN 0x00000400u
#define CR2_ITEVTEN 0x00000200u
#define CR2_ITERREN 0x00000100u
#define CR2_FREQ 0x0000003Fu
#define CR2_FREQ_SHIFT 0

/* Own address 1. */
enum { OAR1 = 0x08 };
#define OAR1_STORED 0x0000C3FFu
#define OAR1_ADDMODE 0x00008000u
#define OAR1_BIT14 0x00004000u
#define OAR1_ADD 0x000003FFu
#define OAR1_ADD_SHIFT 0

/* Own address 2. */
enum { OAR2 = 0x0C };
#define OAR2_STORED 0x000000FFu
#define OAR2_ADD2 0x000000FEu
#define OAR2_ADD2_SHIFT 1
#define OAR2_ENDUAL 0x00000001u

/* Data. */
enum { DR = 0x10 };
#define DR_STORED 0x000000FFu
#define DR_DR 0x000000FFu
#define DR_DR_SHIFT 0

/* Status 1. */
enum { SR1 = 0x14 };
#define SR1_SMBALERT 0x00008000u
#define SR1_TIMEOUT 0x00004000u
#define SR1_PECERR 0x00001000u
#define SR1_OVR 0x00000800u
#define SR1_AF 0x00000400u
#define SR1_ARLO 0x00000200u
#define SR1_BERR 0x00000100u
#define SR1_TXE 0x00000080u
#define SR1_RXNE 0x00000040u
#define SR1_STOPF 0x00000010u
#define SR1_ADD10 0x00000008u
#define SR1_BTF 0x00000004u
#define SR1_ADDR 0x00000002u
#define SR1_SB 0x00000001u

/* Status 2. */
enum { SR2 = 0x18 };
#define SR2_PEC 0x0000FF00u
#define SR2_PEC_SHIFT 8
#define SR2_DUALF 0x00000080u
#define SR2_SMBHOST 0x00000040u
#define SR2_SMBDEFAULT 0x00000020u
#define SR2_GENCALL 0x00000010u
#define SR2_TRA 0x00000004u
#define SR2_BUSY 0x00000002u
#define SR2_MSL 0x00000001u

/* Clock control. */
enum { CCR = 0x1C };
#define CCR_STORED 0x0000CFFFu
#define CCR_FS 0x00008000u
#define CCR_DUTY 0x00004000u
#define CCR_CCR 0x00000FFFu
#define CCR_CCR_SHIFT 0

/* Rise time. */
enum { TRISE = 0x20 };
#define TRISE_RESET 0x00000002u
#define TRISE_STORED 0x0000003Fu
#define TRISE_TRISE 0x0000003Fu
#define TRISE_TRISE_SHIFT 0

/* Filters. */
enum { FLTR = 0x24 };
#define FLTR_STORED 0x0000001Fu
#define FLTR_ANOFF 0x00000010u
#define FLTR_DNF 0x0000000Fu
#define FLTR_DNF_SHIFT 0

/* All of them; -1 ends the list. */
static const int16_t I2C_OFFSETS[] = {
  0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x18, 0x1C,
  0x20, 0x24,
  -1,
};

#endif
