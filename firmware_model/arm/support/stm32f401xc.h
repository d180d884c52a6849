/* Registers of the STM32F401 that this firmware uses, under the reference manual's names (RM0368). */
#ifndef STM32F401XC_H
#define STM32F401XC_H

#include "cortex_m4.h"

typedef enum {
  SysTick_IRQn = -1,
  TIM1_BRK_TIM9_IRQn = 24,
  TIM2_IRQn = 28,
  TIM3_IRQn = 29,
  TIM4_IRQn = 30,
  I2C2_EV_IRQn = 33,
  I2C2_ER_IRQn = 34,
  SPI2_IRQn = 36,
  USART1_IRQn = 37
} IRQn_Type;

/* -- RCC, FLASH, PWR (sections 6, 3, 5) ------------------------------------------------------------------- */

typedef struct {
  volatile uint32_t CR, PLLCFGR, CFGR, CIR;
  volatile uint32_t AHB1RSTR, AHB2RSTR;
  uint32_t RESERVED0[2];
  volatile uint32_t APB1RSTR, APB2RSTR;
  uint32_t RESERVED1[2];
  volatile uint32_t AHB1ENR, AHB2ENR;
  uint32_t RESERVED2[2];
  volatile uint32_t APB1ENR, APB2ENR;
} RCC_TypeDef;

typedef struct {
  volatile uint32_t ACR, KEYR, OPTKEYR, SR, CR, OPTCR;
} FLASH_TypeDef;

typedef struct {
  volatile uint32_t CR, CSR;
} PWR_TypeDef;

#define RCC_CR_HSION (1U << 0)
#define RCC_CR_HSIRDY (1U << 1)
#define RCC_CR_HSEON (1U << 16)
#define RCC_CR_HSERDY (1U << 17)
#define RCC_CR_HSEBYP (1U << 18)
#define RCC_CR_CSSON (1U << 19)
#define RCC_CR_PLLON (1U << 24)
#define RCC_CR_PLLRDY (1U << 25)

#define RCC_PLLCFGR_RESET 0x24003010U
#define RCC_PLLCFGR_PLLM 0x3FU
#define RCC_PLLCFGR_PLLN_Pos 6
#define RCC_PLLCFGR_PLLN (0x1FFU << 6)
#define RCC_PLLCFGR_PLLP_Pos 16
#define RCC_PLLCFGR_PLLP (0x3U << 16)
#define RCC_PLLCFGR_PLLSRC_HSE (1U << 22)
#define RCC_PLLCFGR_PLLQ_Pos 24

#define RCC_CFGR_SW 0x3U
#define RCC_CFGR_SWS_Pos 2
#define RCC_CFGR_HPRE_Pos 4
#define RCC_CFGR_HPRE (0xFU << 4)
#define RCC_CFGR_PPRE1_Pos 10
#define RCC_CFGR_PPRE1 (0x7U << 10)
#define RCC_CFGR_PPRE2_Pos 13
#define RCC_CFGR_PPRE2 (0x7U << 13)

#define RCC_AHB1ENR_GPIOAEN (1U << 0)
#define RCC_AHB1ENR_GPIOBEN (1U << 1)
#define RCC_AHB1ENR_GPIOCEN (1U << 2)
#define RCC_APB1ENR_SPI2EN (1U << 14)
#define RCC_APB1ENR_I2C2EN (1U << 22)
#define RCC_APB1ENR_PWREN (1U << 28)
#define RCC_APB2ENR_USART1EN (1U << 4)
#define RCC_APB2ENR_SYSCFGEN (1U << 14)
#define RCC_APB2ENR_TIM9EN (1U << 16)

#define FLASH_ACR_LATENCY 0x7U
#define FLASH_ACR_PRFTEN (1U << 8)
#define FLASH_ACR_ICEN (1U << 9)
#define FLASH_ACR_DCEN (1U << 10)

#define PWR_CR_VOS (0x3U << 14)
#define PWR_CR_VOS_SCALE2 (0x2U << 14)

/* -- GPIO (section 8) ------------------------------------------------------------------------------------- */

typedef struct {
  volatile uint32_t MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, LCKR, AFR[2];
} GPIO_TypeDef;

/* -- TIM9 (section 14), also the base of the other timers -------------------------------------------------- */

typedef struct {
  volatile uint32_t CR1, CR2, SMCR, DIER, SR, EGR, CCMR1, CCMR2, CCER, CNT, PSC, ARR;
} TIM_TypeDef;

#define TIM_CR1_CEN (1U << 0)
#define TIM_DIER_UIE (1U << 0)
#define TIM_SR_UIF (1U << 0)
#define TIM_EGR_UG (1U << 0)

/* -- USART (section 19) ----------------------------------------------------------------------------------- */

typedef struct {
  volatile uint32_t SR, DR, BRR, CR1, CR2, CR3, GTPR;
} USART_TypeDef;

#define USART_SR_RXNE (1U << 5)
#define USART_SR_TC (1U << 6)
#define USART_SR_TXE (1U << 7)
#define USART_CR1_RE (1U << 2)
#define USART_CR1_TE (1U << 3)
#define USART_CR1_UE (1U << 13)

/* -- I2C (section 18) ------------------------------------------------------------------------------------- */

typedef struct {
  volatile uint32_t CR1, CR2, OAR1, OAR2, DR, SR1, SR2, CCR, TRISE, FLTR;
} I2C_TypeDef;

#define I2C_CR1_PE (1U << 0)
#define I2C_CR1_START (1U << 8)
#define I2C_CR1_STOP (1U << 9)
#define I2C_CR1_ACK (1U << 10)
#define I2C_CR1_POS (1U << 11)
#define I2C_CR1_SWRST (1U << 15)
#define I2C_SR1_SB (1U << 0)
#define I2C_SR1_ADDR (1U << 1)
#define I2C_SR1_BTF (1U << 2)
#define I2C_SR1_RXNE (1U << 6)
#define I2C_SR1_TXE (1U << 7)
#define I2C_SR1_BERR (1U << 8)
#define I2C_SR1_ARLO (1U << 9)
#define I2C_SR1_AF (1U << 10)
#define I2C_SR1_OVR (1U << 11)
#define I2C_SR2_BUSY (1U << 1)
#define I2C_CCR_DUTY (1U << 14)
#define I2C_CCR_FS (1U << 15)

/* -- SPI (section 20) ------------------------------------------------------------------------------------- */

typedef struct {
  volatile uint32_t CR1, CR2, SR, DR, CRCPR, RXCRCR, TXCRCR, I2SCFGR, I2SPR;
} SPI_TypeDef;

#define SPI_CR1_CPHA (1U << 0)
#define SPI_CR1_CPOL (1U << 1)
#define SPI_CR1_MSTR (1U << 2)
#define SPI_CR1_BR_Pos 3
#define SPI_CR1_SPE (1U << 6)
#define SPI_CR1_SSI (1U << 8)
#define SPI_CR1_SSM (1U << 9)
#define SPI_CR1_BIDIOE (1U << 14)
#define SPI_CR1_BIDIMODE (1U << 15)
#define SPI_SR_RXNE (1U << 0)
#define SPI_SR_TXE (1U << 1)
#define SPI_SR_BSY (1U << 7)

/* -- Where they are (table 1) ----------------------------------------------------------------------------- */

#define TIM2 ((TIM_TypeDef *)0x40000000U)
#define TIM3 ((TIM_TypeDef *)0x40000400U)
#define TIM4 ((TIM_TypeDef *)0x40000800U)
#define SPI2 ((SPI_TypeDef *)0x40003800U)
#define I2C2 ((I2C_TypeDef *)0x40005800U)
#define PWR ((PWR_TypeDef *)0x40007000U)
#define USART1 ((USART_TypeDef *)0x40011000U)
#define TIM9 ((TIM_TypeDef *)0x40014000U)
#define GPIOA ((GPIO_TypeDef *)0x40020000U)
#define GPIOB ((GPIO_TypeDef *)0x40020400U)
#define GPIOC ((GPIO_TypeDef *)0x40020800U)
#define RCC ((RCC_TypeDef *)0x40023800U)
#define FLASH ((FLASH_TypeDef *)0x40023C00U)

#define FLASH_BASE 0x08000000U

#endif
