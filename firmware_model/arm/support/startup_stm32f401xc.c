/* Vector table and reset (ARMv7-M ARM B1.5.2, B1.5.3; RM0368 table 38).
 *
 * Every handler is a weak alias of Default_Handler. A function of the same name in the program
 * replaces it.
 */
#include <stdint.h>

extern uint32_t _estack, _sidata, _sdata, _edata, _sbss, _ebss; /* set in the linker script */

int main(void);
void SystemInit(void);
void Reset_Handler(void);
void Default_Handler(void);

#define HANDLER(name) void name(void) __attribute__((weak, alias("Default_Handler")))

HANDLER(NMI_Handler);
HANDLER(HardFault_Handler);
HANDLER(MemManage_Handler);
HANDLER(BusFault_Handler);
HANDLER(UsageFault_Handler);
HANDLER(SVC_Handler);
HANDLER(DebugMon_Handler);
HANDLER(PendSV_Handler);
HANDLER(SysTick_Handler);
HANDLER(WWDG_IRQHandler);
HANDLER(PVD_IRQHandler);
HANDLER(TAMP_STAMP_IRQHandler);
HANDLER(RTC_WKUP_IRQHandler);
HANDLER(FLASH_IRQHandler);
HANDLER(RCC_IRQHandler);
HANDLER(EXTI0_IRQHandler);
HANDLER(EXTI1_IRQHandler);
HANDLER(EXTI2_IRQHandler);
HANDLER(EXTI3_IRQHandler);
HANDLER(EXTI4_IRQHandler);
HANDLER(DMA1_Stream0_IRQHandler);
HANDLER(DMA1_Stream1_IRQHandler);
HANDLER(DMA1_Stream2_IRQHandler);
HANDLER(DMA1_Stream3_IRQHandler);
HANDLER(DMA1_Stream4_IRQHandler);
HANDLER(DMA1_Stream5_IRQHandler);
HANDLER(DMA1_Stream6_IRQHandler);
HANDLER(ADC_IRQHandler);
HANDLER(EXTI9_5_IRQHandler);
HANDLER(TIM1_BRK_TIM9_IRQHandler);
HANDLER(TIM1_UP_TIM10_IRQHandler);
HANDLER(TIM1_TRG_COM_TIM11_IRQHandler);
HANDLER(TIM1_CC_IRQHandler);
HANDLER(TIM2_IRQHandler);
HANDLER(TIM3_IRQHandler);
HANDLER(TIM4_IRQHandler);
HANDLER(I2C1_EV_IRQHandler);
HANDLER(I2C1_ER_IRQHandler);
HANDLER(I2C2_EV_IRQHandler);
HANDLER(I2C2_ER_IRQHandler);
HANDLER(SPI1_IRQHandler);
HANDLER(SPI2_IRQHandler);
HANDLER(USART1_IRQHandler);
HANDLER(USART2_IRQHandler);
HANDLER(EXTI15_10_IRQHandler);
HANDLER(RTC_Alarm_IRQHandler);
HANDLER(OTG_FS_WKUP_IRQHandler);
HANDLER(DMA1_Stream7_IRQHandler);
HANDLER(SDIO_IRQHandler);
HANDLER(TIM5_IRQHandler);
HANDLER(SPI3_IRQHandler);
HANDLER(DMA2_Stream0_IRQHandler);
HANDLER(DMA2_Stream1_IRQHandler);
HANDLER(DMA2_Stream2_IRQHandler);
HANDLER(DMA2_Stream3_IRQHandler);
HANDLER(DMA2_Stream4_IRQHandler);
HANDLER(OTG_FS_IRQHandler);
HANDLER(DMA2_Stream5_IRQHandler);
HANDLER(DMA2_Stream6_IRQHandler);
HANDLER(DMA2_Stream7_IRQHandler);
HANDLER(USART6_IRQHandler);
HANDLER(I2C3_EV_IRQHandler);
HANDLER(I2C3_ER_IRQHandler);
HANDLER(FPU_IRQHandler);
HANDLER(SPI4_IRQHandler);

typedef union {
  void *stack;
  void (*handler)(void);
} Vector;

#define IRQ(number) [16 + (number)].handler

__attribute__((section(".isr_vector"), used)) const Vector vectors[16 + 85] = {
    [0].stack = &_estack,
    [1].handler = Reset_Handler,
    [2].handler = NMI_Handler,
    [3].handler = HardFault_Handler,
    [4].handler = MemManage_Handler,
    [5].handler = BusFault_Handler,
    [6].handler = UsageFault_Handler,
    [11].handler = SVC_Handler,
    [12].handler = DebugMon_Handler,
    [14].handler = PendSV_Handler,
    [15].handler = SysTick_Handler,
    IRQ(0) = WWDG_IRQHandler,
    IRQ(1) = PVD_IRQHandler,
    IRQ(2) = TAMP_STAMP_IRQHandler,
    IRQ(3) = RTC_WKUP_IRQHandler,
    IRQ(4) = FLASH_IRQHandler,
    IRQ(5) = RCC_IRQHandler,
    IRQ(6) = EXTI0_IRQHandler,
    IRQ(7) = EXTI1_IRQHandler,
    IRQ(8) = EXTI2_IRQHandler,
    IRQ(9) = EXTI3_IRQHandler,
    IRQ(10) = EXTI4_IRQHandler,
    IRQ(11) = DMA1_Stream0_IRQHandler,
    IRQ(12) = DMA1_Stream1_IRQHandler,
    IRQ(13) = DMA1_Stream2_IRQHandler,
    IRQ(14) = DMA1_Stream3_IRQHandler,
    IRQ(15) = DMA1_Stream4_IRQHandler,
    IRQ(16) = DMA1_Stream5_IRQHandler,
    IRQ(17) = DMA1_Stream6_IRQHandler,
    IRQ(18) = ADC_IRQHandler,
    IRQ(23) = EXTI9_5_IRQHandler,
    IRQ(24) = TIM1_BRK_TIM9_IRQHandler,
    IRQ(25) = TIM1_UP_TIM10_IRQHandler,
    IRQ(26) = TIM1_TRG_COM_TIM11_IRQHandler,
    IRQ(27) = TIM1_CC_IRQHandler,
    IRQ(28) = TIM2_IRQHandler,
    IRQ(29) = TIM3_IRQHandler,
    IRQ(30) = TIM4_IRQHandler,
    IRQ(31) = I2C1_EV_IRQHandler,
    IRQ(32) = I2C1_ER_IRQHandler,
    IRQ(33) = I2C2_EV_IRQHandler,
    IRQ(34) = I2C2_ER_IRQHandler,
    IRQ(35) = SPI1_IRQHandler,
    IRQ(36) = SPI2_IRQHandler,
    IRQ(37) = USART1_IRQHandler,
    IRQ(38) = USART2_IRQHandler,
    IRQ(40) = EXTI15_10_IRQHandler,
    IRQ(41) = RTC_Alarm_IRQHandler,
    IRQ(42) = OTG_FS_WKUP_IRQHandler,
    IRQ(47) = DMA1_Stream7_IRQHandler,
    IRQ(49) = SDIO_IRQHandler,
    IRQ(50) = TIM5_IRQHandler,
    IRQ(51) = SPI3_IRQHandler,
    IRQ(56) = DMA2_Stream0_IRQHandler,
    IRQ(57) = DMA2_Stream1_IRQHandler,
    IRQ(58) = DMA2_Stream2_IRQHandler,
    IRQ(59) = DMA2_Stream3_IRQHandler,
    IRQ(60) = DMA2_Stream4_IRQHandler,
    IRQ(67) = OTG_FS_IRQHandler,
    IRQ(68) = DMA2_Stream5_IRQHandler,
    IRQ(69) = DMA2_Stream6_IRQHandler,
    IRQ(70) = DMA2_Stream7_IRQHandler,
    IRQ(71) = USART6_IRQHandler,
    IRQ(72) = I2C3_EV_IRQHandler,
    IRQ(73) = I2C3_ER_IRQHandler,
    IRQ(81) = FPU_IRQHandler,
    IRQ(84) = SPI4_IRQHandler,
};

void Reset_Handler(void)
{
  SystemInit();
  const uint32_t *source = &_sidata;
  for (uint32_t *word = &_sdata; word < &_edata; word++) {
    *word = *source++;
  }
  for (uint32_t *word = &_sbss; word < &_ebss; word++) {
    *word = 0;
  }
  main();
  for (;;) {
  }
}

void Default_Handler(void)
{
  for (;;) {
  }
}
