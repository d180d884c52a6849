/* Direct memory access controller (RM0368 section 9.5).
 *
 * Made of emulator/chip/registers/dma.py, by python -m fcu_emulator.emulator.chip.registers. */
#ifndef FCU_REGISTERS_DMA_H
#define FCU_REGISTERS_DMA_H

#include <stdint.h>

/* Interrupt status, streams 0 to 3. */
enum { LISR = 0x00 };
#define LISR_TCIF3 0x08000000u
#define LISR_HTIF3 0x04000000u
#define LISR_TEIF3 0x02000000u
#define LISR_DMEIF3 0x01000000u
#define LISR_FEIF3 0x00400000u
#define LISR_TCIF2 0x00200000u
#define LISR_HTIF2 0x00100000u
#define LISR_TEIF2 0x00080000u
#define LISR_DMEIF2 0x00040000u
#define LISR_FEIF2 0x00010000u
#define LISR_TCIF1 0x00000800u
#define LISR_HTIF1 0x00000400u
#define LISR_TEIF1 0x00000200u
#define LISR_DMEIF1 0x00000100u
#define LISR_FEIF1 0x00000040u
#define LISR_TCIF0 0x00000020u
#define LISR_HTIF0 0x00000010u
#define LISR_TEIF0 0x00000008u
#define LISR_DMEIF0 0x00000004u
#define LISR_FEIF0 0x00000001u

/* Interrupt status, streams 4 to 7. */
enum { HISR = 0x04 };
#define HISR_TCIF7 0x08000000u
#define HISR_HTIF7 0x04000000u
#define HISR_TEIF7 0x02000000u
#define HISR_DMEIF7 0x01000000u
#define HISR_FEIF7 0x00400000u
#define HISR_TCIF6 0x00200000u
#define HISR_HTIF6 0x00100000u
#define HISR_TEIF6 0x00080000u
#define HISR_DMEIF6 0x00040000u
#define HISR_FEIF6 0x00010000u
#define HISR_TCIF5 0x00000800u
#define HISR_HTIF5 0x00000400u
#define HISR_TEIF5 0x00000200u
#define HISR_DMEIF5 0x00000100u
#define HISR_FEIF5 0x00000040u
#define HISR_TCIF4 0x00000020u
#define HISR_HTIF4 0x00000010u
#define HISR_TEIF4 0x00000008u
#define HISR_DMEIF4 0x00000004u
#define HISR_FEIF4 0x00000001u

/* Interrupt flag clear, streams 0 to 3. */
enum { LIFCR = 0x08 };
#define LIFCR_CTCIF3 0x08000000u
#define LIFCR_CHTIF3 0x04000000u
#define LIFCR_CTEIF3 0x02000000u
#define LIFCR_CDMEIF3 0x01000000u
#define LIFCR_CFEIF3 0x00400000u
#define LIFCR_CTCIF2 0x00200000u
#define LIFCR_CHTIF2 0x00100000u
#define LIFCR_CTEIF2 0x00080000u
#define LIFCR_CDMEIF2 0x00040000u
#define LIFCR_CFEIF2 0x00010000u
#define LIFCR_CTCIF1 0x00000800u
#define LIFCR_CHTIF1 0x00000400u
#define LIFCR_CTEIF1 0x00000200u
#define LIFCR_CDMEIF1 0x00000100u
#define LIFCR_CFEIF1 0x00000040u
#define LIFCR_CTCIF0 0x00000020u
#define LIFCR_CHTIF0 0x00000010u
#define LIFCR_CTEIF0 0x00000008u
#define LIFCR_CDMEIF0 0x00000004u
#define LIFCR_CFEIF0 0x00000001u

/* Interrupt flag clear, streams 4 to 7. */
enum { HIFCR = 0x0C };
#define HIFCR_CTCIF7 0x08000000u
#define HIFCR_CHTIF7 0x04000000u
#define HIFCR_CTEIF7 0x02000000u
#define HIFCR_CDMEIF7 0x01000000u
#define HIFCR_CFEIF7 0x00400000u
#define HIFCR_CTCIF6 0x00200000u
#define HIFCR_CHTIF6 0x00100000u
#define HIFCR_CTEIF6 0x00080000u
#define HIFCR_CDMEIF6 0x00040000u
#define HIFCR_CFEIF6 0x00010000u
#define HIFCR_CTCIF5 0x00000800u
#define HIFCR_CHTIF5 0x00000400u
#define HIFCR_CTEIF5 0x00000200u
#define HIFCR_CDMEIF5 0x00000100u
#define HIFCR_CFEIF5 0x00000040u
#define HIFCR_CTCIF4 0x00000020u
#define HIFCR_CHTIF4 0x00000010u
#define HIFCR_CTEIF4 0x00000008u
#define HIFCR_CDMEIF4 0x00000004u
#define HIFCR_CFEIF4 0x00000001u

/* Stream configuration. */
#define SxCR(x) (0x10u + 0x18u * (x))
#define SxCR_STORED 0x0FEFFFFFu
#define SxCR_CHSEL 0x0E000000u
#define SxCR_CHSEL_SHIFT 25
#define SxCR_MBURST 0x01800000u
#define SxCR_MBURST_SHIFT 23
#define SxCR_PBURST 0x00600000u
#define SxCR_PBURST_SHIFT 21
#define SxCR_CT 0x00080000u
#define SxCR_DBM 0x00040000u
#define SxCR_PL 0x00030000u
#define SxCR_PL_SHIFT 16
#define SxCR_PINCOS 0x00008000u
#define SxCR_MSIZE 0x00006000u
#define SxCR_MSIZE_SHIFT 13
#define SxCR_PSIZE 0x00001800u
#define SxCR_PSIZE_SHIFT 11
#define SxCR_MINC 0x00000400u
#define SxCR_PINC 0x00000200u
#define SxCR_CIRC 0x00000100u
#define SxCR_DIR 0x000000C0u
#define SxCR_DIR_SHIFT 6
#define SxCR_PFCTRL 0x00000020u
#define SxCR_TCIE 0x00000010u
#define SxCR_HTIE 0x00000008u
#define SxCR_TEIE 0x00000004u
#define SxCR_DMEIE 0x00000002u
#define SxCR_EN 0x00000001u

/* Number of items left. */
#define SxNDTR(x) (0x14u + 0x18u * (x))
#define SxNDTR_STORED 0x0000FFFFu
#define SxNDTR_NDT 0x0000FFFFu
#define SxNDTR_NDT_SHIFT 0

/* Peripheral address. */
#define SxPAR(x) (0x18u + 0x18u * (x))

/* Memory 0 address. */
#define SxM0AR(x) (0x1Cu + 0x18u * (x))

/* Memory 1 address. */
#define SxM1AR(x) (0x20u + 0x18u * (x))

/* FIFO control. */
#define SxFCR(x) (0x24u + 0x18u * (x))
#define SxFCR_RESET 0x00000021u
#define SxFCR_STORED 0x00000087u
#define SxFCR_FEIE 0x00000080u
#define SxFCR_FS 0x00000038u
#define SxFCR_FS_SHIFT 3
#define SxFCR_DMDIS 0x00000004u
#define SxFCR_FTH 0x00000003u
#define SxFCR_FTH_SHIFT 0

/* All of them; -1 ends the list. */
static const int16_t DMA_OFFSETS[] = {
  0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x18, 0x1C,
  0x20, 0x24, 0x28, 0x2C, 0x30, 0x34, 0x38, 0x3C,
  0x40, 0x44, 0x48, 0x4C, 0x50, 0x54, 0x58, 0x5C,
  0x60, 0x64, 0x68, 0x6C, 0x70, 0x74, 0x78, 0x7C,
  0x80, 0x84, 0x88, 0x8C, 0x90, 0x94, 0x98, 0x9C,
  0xA0, 0xA4, 0xA8, 0xAC, 0xB0, 0xB4, 0xB8, 0xBC,
  0xC0, 0xC4, 0xC8, 0xCC,
  -1,
};

#endif
