/* Timers TIM1 to TIM5 and TIM9 to TIM11 (RM0368 sections 12.4, 13.4, 14.4, 14.5).
 *
 * Made of emulator/chip/registers/tim.py, by python -m fcu_emulator.emulator.chip.registers. */
#ifndef FCU_REGISTERS_TIM_H
#define FCU_REGISTERS_TIM_H

#include <stdint.h>

/* Control 1. */
enum { CR1 = 0x00 };
#define CR1_STORED 0x000003FFu
#define CR1_CKD 0x00000300u
#define CR1_CKD_SHIFT 8
#define CR1_ARPE 0x00000080u
#define CR1_CMS 0x00000060u
#define CR1_CMS_SHIFT 5
#define CR1_DIR 0x00000010u
#define CR1_OPM 0x00000008u
#define CR1_URS 0x00000004u
#define CR1_UDIS 0x00000002u
#define CR1_CEN 0x00000001u

/* Control 2. */
enum { CR2 = 0x04 };
#define CR2_STORED 0x00007FFDu
#define CR2_OIS4 0x00004000u
#define CR2_OIS3N 0x00002000u
#define CR2_OIS3 0x00001000u
#define CR2_OIS2N 0x00000800u
#define CR2_OIS2 0x00000400u
#define CR2_OIS1N 0x00000200u
#define CR2_OIS1 0x00000100u
#define CR2_TI1S 0x00000080u
#define CR2_MMS 0x00000070u
#define CR2_MMS_SHIFT 4
#define CR2_CCDS 0x00000008u
#define CR2_CCUS 0x00000004u
#define CR2_CCPC 0x00000001u

/* Slave mode control. */
enum { SMCR = 0x08 };
#define SMCR_STORED 0x0000FFF7u
#define SMCR_ETP 0x00008000u
#define SMCR_ECE 0x00004000u
#define SMCR_ETPS 0x00003000u
#define SMCR_ETPS_SHIFT 12
#define SMCR_ETF 0x00000F00u
#define SMCR_ETF_SHIFT 8
#define SMCR_MSM 0x00000080u
#define SMCR_TS 0x00000070u
#define SMCR_TS_SHIFT 4
#define SMCR_SMS 0x00000007u
#define SMCR_SMS_SHIFT 0

/* DMA and interrupt enable. */
enum { DIER = 0x0C };
#define DIER_STORED 0x00007FFFu
#define DIER_TDE 0x00004000u
#define DIER_COMDE 0x00002000u
#define DIER_CC4DE 0x00001000u
#define DIER_CC3DE 0x00000800u
#define DIER_CC2DE 0x00000400u
#define DIER_CC1DE 0x00000200u
#define DIER_UDE 0x00000100u
#define DIER_BIE 0x00000080u
#define DIER_TIE 0x00000040u
#define DIER_COMIE 0x00000020u
#define DIER_CC4IE 0x00000010u
#define DIER_CC3IE 0x00000008u
#define DIER_CC2IE 0x00000004u
#define DIER_CC1IE 0x00000002u
#define DIER_UIE 0x00000001u

/* Status. */
enum { SR = 0x10 };
#define SR_CC4OF 0x00001000u
#define SR_CC3OF 0x00000800u
#define SR_CC2OF 0x00000400u
#define SR_CC1OF 0x00000200u
#define SR_BIF 0x00000080u
#define SR_TIF 0x00000040u
#define SR_COMIF 0x00000020u
#define SR_CC4IF 0x00000010u
#define SR_CC3IF 0x00000008u
#define SR_CC2IF 0x00000004u
#define SR_CC1IF 0x00000002u
#define SR_UIF 0x00000001u

/* Event generation. */
enum { EGR = 0x14 };
#define EGR_BG 0x00000080u
#define EGR_TG 0x00000040u
#define EGR_COMG 0x00000020u
#define EGR_CC4G 0x00000010u
#define EGR_CC3G 0x00000008u
#define EGR_CC2G 0x00000004u
#define EGR_CC1G 0x00000002u
#define EGR_UG 0x00000001u

/* Capture and compare mode, channels 1 and 2. */
enum { CCMR1 = 0x18 };
#define CCMR1_STORED 0x0000FFFFu
#define CCMR1_OC2CE 0x00008000u
#define CCMR1_OC2M 0x00007000u
#define CCMR1_OC2M_SHIFT 12
#define CCMR1_OC2PE 0x00000800u
#define CCMR1_OC2FE 0x00000400u
#define CCMR1_CC2S 0x00000300u
#define CCMR1_CC2S_SHIFT 8
#define CCMR1_OC1CE 0x00000080u
#define CCMR1_OC1M 0x00000070u
#define CCMR1_OC1M_SHIFT 4
#define CCMR1_OC1PE 0x00000008u
#define CCMR1_OC1FE 0x00000004u
#define CCMR1_CC1S 0x00000003u
#define CCMR1_CC1S_SHIFT 0
#define CCMR1_IC2F 0x0000F000u
#define CCMR1_IC2F_SHIFT 12
#define CCMR1_IC2PSC 0x00000C00u
#define CCMR1_IC2PSC_SHIFT 10
#define CCMR1_IC1F 0x000000F0u
#define CCMR1_IC1F_SHIFT 4
#define CCMR1_IC1PSC 0x0000000Cu
#define CCMR1_IC1PSC_SHIFT 2

/* Capture and compare mode, channels 3 and 4. */
enum { CCMR2 = 0x1C };
#define CCMR2_STORED 0x0000FFFFu
#define CCMR2_OC4CE 0x00008000u
#define CCMR2_OC4M 0x00007000u
#define CCMR2_OC4M_SHIFT 12
#define CCMR2_OC4PE 0x00000800u
#define CCMR2_OC4FE 0x00000400u
#define CCMR2_CC4S 0x00000300u
#define CCMR2_CC4S_SHIFT 8
#define CCMR2_OC3CE 0x00000080u
#define CCMR2_OC3M 0x00000070u
#define CCMR2_OC3M_SHIFT 4
#define CCMR2_OC3PE 0x00000008u
#define CCMR2_OC3FE 0x00000004u
#define CCMR2_CC3S 0x00000003u
#define CCMR2_CC3S_SHIFT 0
#define CCMR2_IC4F 0x0000F000u
#define CCMR2_IC4F_SHIFT 12
#define CCMR2_IC4PSC 0x00000C00u
#define CCMR2_IC4PSC_SHIFT 10
#define CCMR2_IC3F 0x000000F0u
#define CCMR2_IC3F_SHIFT 4
#define CCMR2_IC3PSC 0x0000000Cu
#define CCMR2_IC3PSC_SHIFT 2

/* Capture and compare enable. */
enum { CCER = 0x20 };
#define CCER_STORED 0x0000BFFFu
#define CCER_CC4NP 0x00008000u
#define CCER_CC4P 0x00002000u
#define CCER_CC4E 0x00001000u
#define CCER_CC3NP 0x00000800u
#define CCER_CC3NE 0x00000400u
#define CCER_CC3P 0x00000200u
#define CCER_CC3E 0x00000100u
#define CCER_CC2NP 0x00000080u
#define CCER_CC2NE 0x00000040u
#define CCER_CC2P 0x00000020u
#define CCER_CC2E 0x00000010u
#define CCER_CC1NP 0x00000008u
#define CCER_CC1NE 0x00000004u
#define CCER_CC1P 0x00000002u
#define CCER_CC1E 0x00000001u

/* Counter. */
enum { CNT = 0x24 };

/* Prescaler. */
enum { PSC = 0x28 };
#define PSC_STORED 0x0000FFFFu
#define PSC_PSC 0x0000FFFFu
#define PSC_PSC_SHIFT 0

/* Auto-reload: the highest count. */
enum { ARR = 0x2C };
#define ARR_RESET 0xFFFFFFFFu

/* Repetition counter. */
enum { RCR = 0x30 };
#define RCR_STORED 0x000000FFu
#define RCR_REP 0x000000FFu
#define RCR_REP_SHIFT 0

/* Capture and compare value. */
#define CCRx(x) (0x34u + 0x04u * ((x) - 1))

/* Break and dead time. */
enum { BDTR = 0x44 };
#define BDTR_STORED 0x0000FFFFu
#define BDTR_MOE 0x00008000u
#define BDTR_AOE 0x00004000u
#define BDTR_BKP 0x00002000u
#define BDTR_BKE 0x00001000u
#define BDTR_OSSR 0x00000800u
#define BDTR_OSSI 0x00000400u
#define BDTR_LOCK 0x00000300u
#define BDTR_LOCK_SHIFT 8
#define BDTR_DTG 0x000000FFu
#define BDTR_DTG_SHIFT 0

/* DMA burst control. */
enum { DCR = 0x48 };
#define DCR_STORED 0x00001F1Fu
#define DCR_DBL 0x00001F00u
#define DCR_DBL_SHIFT 8
#define DCR_DBA 0x0000001Fu
#define DCR_DBA_SHIFT 0

/* DMA burst access. */
enum { DMAR = 0x4C };
#define DMAR_STORED 0x0000FFFFu
#define DMAR_DMAB 0x0000FFFFu
#define DMAR_DMAB_SHIFT 0

/* Input remap. */
enum { OR = 0x50 };
#define OR_STORED 0x00000CC3u
#define OR_ITR1_RMP 0x00000C00u
#define OR_ITR1_RMP_SHIFT 10
#define OR_TI4_RMP 0x000000C0u
#define OR_TI4_RMP_SHIFT 6
#define OR_TI1_RMP 0x00000003u
#define OR_TI1_RMP_SHIFT 0

/* All of them; -1 ends the list. */
static const int16_t TIM_OFFSETS[] = {
  0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x18, 0x1C,
  0x20, 0x24, 0x28, 0x2C, 0x30, 0x34, 0x38, 0x3C,
  0x40, 0x44, 0x48, 0x4C, 0x50,
  -1,
};

/* The bits that each block has, by offset / 4. */
static const uint32_t TIM_EXISTING[8][21] = {
  { /* TIM1 */
    [0] = 0x3FF, [1] = 0x7FFD, [2] = 0xFFF7, [3] = 0x7FFF, [4] = 0x1EFF,
    [5] = 0xFF, [6] = 0xFFFF, [7] = 0xFFFF, [8] = 0xBFFF, [9] = 0xFFFF,
    [10] = 0xFFFF, [11] = 0xFFFF, [12] = 0xFF, [13] = 0xFFFF, [14] = 0xFFFF,
    [15] = 0xFFFF, [16] = 0xFFFF, [17] = 0xFFFF, [18] = 0x1F1F, [19] = 0xFFFF,
  },
  { /* TIM2 */
    [0] = 0x3FF, [1] = 0xF8, [2] = 0xFFF7, [3] = 0x5F5F, [4] = 0x1E5F,
    [5] = 0x5F, [6] = 0xFFFF, [7] = 0xFFFF, [8] = 0xBBBB, [9] = 0xFFFFFFFF,
    [10] = 0xFFFF, [11] = 0xFFFFFFFF, [13] = 0xFFFFFFFF, [14] = 0xFFFFFFFF, [15] = 0xFFFFFFFF,
    [16] = 0xFFFFFFFF, [18] = 0x1F1F, [19] = 0xFFFF, [20] = 0xC00,
  },
  { /* TIM3 */
    [0] = 0x3FF, [1] = 0xF8, [2] = 0xFFF7, [3] = 0x5F5F, [4] = 0x1E5F,
    [5] = 0x5F, [6] = 0xFFFF, [7] = 0xFFFF, [8] = 0xBBBB, [9] = 0xFFFF,
    [10] = 0xFFFF, [11] = 0xFFFF, [13] = 0xFFFF, [14] = 0xFFFF, [15] = 0xFFFF,
    [16] = 0xFFFF, [18] = 0x1F1F, [19] = 0xFFFF,
  },
  { /* TIM4 */
    [0] = 0x3FF, [1] = 0xF8, [2] = 0xFFF7, [3] = 0x5F5F, [4] = 0x1E5F,
    [5] = 0x5F, [6] = 0xFFFF, [7] = 0xFFFF, [8] = 0xBBBB, [9] = 0xFFFF,
    [10] = 0xFFFF, [11] = 0xFFFF, [13] = 0xFFFF, [14] = 0xFFFF, [15] = 0xFFFF,
    [16] = 0xFFFF, [18] = 0x1F1F, [19] = 0xFFFF,
  },
  { /* TIM5 */
    [0] = 0x3FF, [1] = 0xF8, [2] = 0xFFF7, [3] = 0x5F5F, [4] = 0x1E5F,
    [5] = 0x5F, [6] = 0xFFFF, [7] = 0xFFFF, [8] = 0xBBBB, [9] = 0xFFFFFFFF,
    [10] = 0xFFFF, [11] = 0xFFFFFFFF, [13] = 0xFFFFFFFF, [14] = 0xFFFFFFFF, [15] = 0xFFFFFFFF,
    [16] = 0xFFFFFFFF, [18] = 0x1F1F, [19] = 0xFFFF, [20] = 0xC0,
  },
  { /* TIM9 */
    [0] = 0x38F, [1] = 0x70, [2] = 0xF7, [3] = 0x47, [4] = 0x647,
    [5] = 0x47, [6] = 0xFFFF, [8] = 0xBB, [9] = 0xFFFF, [10] = 0xFFFF,
    [11] = 0xFFFF, [13] = 0xFFFF, [14] = 0xFFFF,
  },
  { /* TIM10 */
    [0] = 0x38F, [1] = 0x70, [3] = 0x43, [4] = 0x243, [5] = 0x43,
    [6] = 0xFF, [8] = 0xB, [9] = 0xFFFF, [10] = 0xFFFF, [11] = 0xFFFF,
    [13] = 0xFFFF,
  },
  { /* TIM11 */
    [0] = 0x38F, [1] = 0x70, [3] = 0x43, [4] = 0x243, [5] = 0x43,
    [6] = 0xFF, [8] = 0xB, [9] = 0xFFFF, [10] = 0xFFFF, [11] = 0xFFFF,
    [13] = 0xFFFF, [20] = 0x3,
  },
};

/* Values after reset, by offset / 4. */
static const uint32_t TIM_RESETS[8][21] = {
  { /* TIM1 */
    [11] = 0xFFFF,
  },
  { /* TIM2 */
    [11] = 0xFFFFFFFF,
  },
  { /* TIM3 */
    [11] = 0xFFFF,
  },
  { /* TIM4 */
    [11] = 0xFFFF,
  },
  { /* TIM5 */
    [11] = 0xFFFFFFFF,
  },
  { /* TIM9 */
    [11] = 0xFFFF,
  },
  { /* TIM10 */
    [11] = 0xFFFF,
  },
  { /* TIM11 */
    [11] = 0xFFFF,
  },
};

#endif
