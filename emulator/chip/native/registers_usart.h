/* Universal synchronous asynchronous receiver transmitter (RM0368 section 19.6).
 *
 * Made of emulator/chip/registers/usart.py, by python -m fcu_emulator.emulator.chip.registers. */
#ifndef FCU_REGISTERS_USART_H
#define FCU_REGISTERS_USART_H

#include <stdint.h>

/* Status. */
enum { SR = 0x00 };
#define SR_RESET 0x000000C0u
#define SR_CTS 0x00000200u
#define SR_LBD 0x00000100u
#define SR_TXE 0x00000080u
#define SR_TC 0x00000040u
#define SR_RXNE 0x00000020u
#define SR_IDLE 0x00000010u
#define SR_ORE 0x00000008u
#define SR_NF 0x00000004u
#define SR_FE 0x00000002u
#define SR_PE 0x00000001u

/* Data: what was received, and what is to be sent. */
enum { DR = 0x04 };
#define DR_STORED 0x000001FFu
#define DR_DR 0x000001FFu
#define DR_DR_SHIFT 0

/* Baud rate: the kernel clock divided by 16 (or 8) times this. */
enum { BRR = 0x08 };
#define BRR_STORED 0x0000FFFFu
#define BRR_DIV_Mantissa 0x0000FFF0u
#define BRR_DIV_Mantissa_SHIFT 4
#define BRR_DIV_Fraction 0x0000000Fu
#define BRR_DIV_Fraction_SHIFT 0

/* Control 1. */
enum { CR1 = 0x0C };
#define CR1_STORED 0x0000BFFFu
#define CR1_OVER8 0x00008000u
#define CR1_UE 0x00002000u
#define CR1_M 0x00001000u
#define CR1_WAKE 0x00000800u
#define CR1_PCE 0x00000400u
#define CR1_PS 0x00000200u
#define CR1_PEIE 0x00000100u
#define CR1_TXEIE 0x00000080u
#define CR1_TCIE 0x00000040u
#define CR1_RXNEIE 0x00000020u
#define CR1_IDLEIE 0x00000010u
#define CR1_TE 0x00000008u
#define CR1_RE 0x00000004u
#define CR1_RWU 0x00000002u
#define CR1_SBK 0x00000001u

/* Control 2. */
enum { CR2 = 0x10 };
#define CR2_STORED 0x00007F6Fu
#define CR2_LINEN 0x00004000u
#define CR2_STOP 0x00003000u
#define CR2_STOP_SHIFT 12
#define CR2_CLKEN 0x00000800u
#define CR2_CPOL 0x00000400u
#define CR2_CPHA 0x00000200u
#define CR2_LBCL 0x00000100u
#define CR2_LBDIE 0x00000040u
#define CR2_LBDL 0x00000020u
#define CR2_ADD 0x0000000Fu
#define CR2_ADD_SHIFT 0

/* Control 3. */
enum { CR3 = 0x14 };
#define CR3_STORED 0x00000FFFu
#define CR3_ONEBIT 0x00000800u
#define CR3_CTSIE 0x00000400u
#define CR3_CTSE 0x00000200u
#define CR3_RTSE 0x00000100u
#define CR3_DMAT 0x00000080u
#define CR3_DMAR 0x00000040u
#define CR3_SCEN 0x00000020u
#define CR3_NACK 0x00000010u
#define CR3_HDSEL 0x00000008u
#define CR3_IRLP 0x00000004u
#define CR3_IREN 0x00000002u
#define CR3_EIE 0x00000001u

/* Guard time and prescaler, of smartcard and IrDA mode. */
enum { GTPR = 0x18 };
#define GTPR_STORED 0x0000FFFFu
#define GTPR_GT 0x0000FF00u
#define GTPR_GT_SHIFT 8
#define GTPR_PSC 0x000000FFu
#define GTPR_PSC_SHIFT 0

/* All of them; -1 ends the list. */
static const int16_t USART_OFFSETS[] = {
  0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x18,
  -1,
};

#endif
