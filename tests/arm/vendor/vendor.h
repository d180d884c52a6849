/* Registers that these programs use beyond those of the support layer (RM0368). */
#ifndef VENDOR_H
#define VENDOR_H

#include "board.h"

#define BIT(number) (1U << (number))

/* -- interrupts (table 38) -------------------------------------------------------------------------------- */

#define DMA1_Stream2_IRQn ((IRQn_Type)13)
#define DMA2_Stream2_IRQn ((IRQn_Type)58)
#define DMA2_Stream7_IRQn ((IRQn_Type)70)

/* -- clocks ----------------------------------------------------------------------------------------------- */

#define RCC_AHB1ENR_DMA1EN BIT(21)
#define RCC_AHB1ENR_DMA2EN BIT(22)
#define RCC_APB1ENR_TIM2EN BIT(0)
#define RCC_APB1ENR_TIM4EN BIT(2)
#define RCC_APB1ENR_TIM5EN BIT(3)
#define RCC_APB2ENR_SPI1EN BIT(12)

/* -- DMA (section 9) -------------------------------------------------------------------------------------- */

typedef struct {
  volatile uint32_t CR, NDTR, PAR, M0AR, M1AR, FCR;
} DMA_Stream_TypeDef;

typedef struct {
  volatile uint32_t LISR, HISR, LIFCR, HIFCR;
  DMA_Stream_TypeDef stream[8];
} DMA_TypeDef;

#define DMA1 ((DMA_TypeDef *)0x40026000U)
#define DMA2 ((DMA_TypeDef *)0x40026400U)

#define DMA_CR_EN BIT(0)
#define DMA_CR_DMEIE BIT(1)
#define DMA_CR_TEIE BIT(2)
#define DMA_CR_HTIE BIT(3)
#define DMA_CR_TCIE BIT(4)
#define DMA_CR_DIR_M2P (1U << 6)
#define DMA_CR_CIRC BIT(8)
#define DMA_CR_MINC BIT(10)
#define DMA_CR_DBM BIT(18)
#define DMA_CR_CHSEL_Pos 25
#define DMA_FCR_FEIE BIT(7)

/* -- bits that only interrupts and DMA need ---------------------------------------------------------------- */

#define I2C_CR2_ITERREN BIT(8)
#define I2C_CR2_ITEVTEN BIT(9)
#define I2C_CR2_ITBUFEN BIT(10)
#define I2C_CR2_DMAEN BIT(11)
#define I2C_CR2_LAST BIT(12)
#define I2C_SR2_TRA BIT(2)

#define USART_SR_PE BIT(0)
#define USART_SR_FE BIT(1)
#define USART_SR_NE BIT(2)
#define USART_SR_ORE BIT(3)
#define USART_SR_IDLE BIT(4)
#define USART_CR1_IDLEIE BIT(4)
#define USART_CR1_RXNEIE BIT(5)
#define USART_CR1_TCIE BIT(6)
#define USART_CR1_TXEIE BIT(7)
#define USART_CR1_PEIE BIT(8)
#define USART_CR3_EIE BIT(0)
#define USART_CR3_DMAR BIT(6)
#define USART_CR3_DMAT BIT(7)

#define SPI1 ((SPI_TypeDef *)0x40013000U)
#define TIM5 ((TIM_TypeDef *)0x40000C00U)

/* The compare registers follow RCR, which ends where the support layer's TIM_TypeDef does. */
#define TIM_CCR(timer, channel) (((volatile uint32_t *)(timer))[12U + (channel)])

#endif
