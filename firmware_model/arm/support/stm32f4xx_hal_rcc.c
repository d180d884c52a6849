/* Clocks: oscillators, PLL, dividers, flash wait states (RM0368 sections 6.3 and 3.4). */
#include "stm32f4xx_hal.h"

#define HSE_TIMEOUT_MS 100U
#define READY_TIMEOUT_MS 2U
#define SWITCH_TIMEOUT_MS 5000U
#define SWS_PLL 2U
#define SWS_HSE 1U

static HAL_StatusTypeDef WaitForBits(volatile uint32_t *reg, uint32_t mask, uint32_t value, uint32_t timeout_ms)
{
  uint32_t tickstart = HAL_GetTick();
  while ((*reg & mask) != value) {
    if (HAL_Expired(tickstart, timeout_ms)) {
      return HAL_TIMEOUT;
    }
  }
  return HAL_OK;
}

static HAL_StatusTypeDef SwitchOscillator(uint32_t on_bits, uint32_t state, uint32_t ready, uint32_t timeout_ms)
{
  RCC->CR = (RCC->CR & ~on_bits) | state;
  return WaitForBits(&RCC->CR, ready, state != 0U ? ready : 0U, timeout_ms);
}

/* The PLL's factors can be changed only while the PLL is off (RM0368 6.3.2). */
static HAL_StatusTypeDef ConfigurePll(const RCC_PLLInitTypeDef *pll)
{
  if (pll->PLLState == RCC_PLL_NONE) {
    return HAL_OK;
  }
  HAL_StatusTypeDef status = SwitchOscillator(RCC_CR_PLLON, 0, RCC_CR_PLLRDY, READY_TIMEOUT_MS);
  if (status != HAL_OK || pll->PLLState == RCC_PLL_OFF) {
    return status;
  }
  RCC->PLLCFGR = pll->PLLSource | pll->PLLM | (pll->PLLN << RCC_PLLCFGR_PLLN_Pos) |
                 ((pll->PLLP / 2U - 1U) << RCC_PLLCFGR_PLLP_Pos) | (pll->PLLQ << RCC_PLLCFGR_PLLQ_Pos);
  return SwitchOscillator(RCC_CR_PLLON, RCC_CR_PLLON, RCC_CR_PLLRDY, READY_TIMEOUT_MS);
}

HAL_StatusTypeDef HAL_RCC_OscConfig(const RCC_OscInitTypeDef *RCC_OscInitStruct)
{
  HAL_StatusTypeDef status = HAL_OK;
  if ((RCC_OscInitStruct->OscillatorType & RCC_OSCILLATORTYPE_HSE) != 0U) {
    status = SwitchOscillator(RCC_HSE_BYPASS, RCC_OscInitStruct->HSEState, RCC_CR_HSERDY, HSE_TIMEOUT_MS);
  }
  if (status == HAL_OK && (RCC_OscInitStruct->OscillatorType & RCC_OSCILLATORTYPE_HSI) != 0U) {
    status = SwitchOscillator(RCC_CR_HSION, RCC_OscInitStruct->HSIState, RCC_CR_HSIRDY, READY_TIMEOUT_MS);
  }
  return status == HAL_OK ? ConfigurePll(&RCC_OscInitStruct->PLL) : status;
}

static HAL_StatusTypeDef SetLatency(uint32_t latency)
{
  FLASH->ACR = (FLASH->ACR & ~FLASH_ACR_LATENCY) | latency;
  return (FLASH->ACR & FLASH_ACR_LATENCY) == latency ? HAL_OK : HAL_ERROR;
}

static HAL_StatusTypeDef SwitchSysclk(const RCC_ClkInitTypeDef *clk)
{
  if ((clk->ClockType & RCC_CLOCKTYPE_HCLK) != 0U) {
    RCC->CFGR = (RCC->CFGR & ~RCC_CFGR_HPRE) | (clk->AHBCLKDivider << RCC_CFGR_HPRE_Pos);
  }
  if ((clk->ClockType & RCC_CLOCKTYPE_SYSCLK) == 0U) {
    return HAL_OK;
  }
  RCC->CFGR = (RCC->CFGR & ~RCC_CFGR_SW) | clk->SYSCLKSource;
  return WaitForBits(&RCC->CFGR, RCC_CFGR_SW << RCC_CFGR_SWS_Pos, clk->SYSCLKSource << RCC_CFGR_SWS_Pos,
                     SWITCH_TIMEOUT_MS);
}

HAL_StatusTypeDef HAL_RCC_ClockConfig(const RCC_ClkInitTypeDef *RCC_ClkInitStruct, uint32_t FLatency)
{
  /* Wait states are added before the clock becomes faster, and removed after it has become
     slower (RM0368 3.4.1). */
  int faster = FLatency > (FLASH->ACR & FLASH_ACR_LATENCY);
  if (faster && SetLatency(FLatency) != HAL_OK) {
    return HAL_ERROR;
  }
  HAL_StatusTypeDef status = SwitchSysclk(RCC_ClkInitStruct);
  if (status != HAL_OK) {
    return status;
  }
  if (!faster && SetLatency(FLatency) != HAL_OK) {
    return HAL_ERROR;
  }
  if ((RCC_ClkInitStruct->ClockType & RCC_CLOCKTYPE_PCLK1) != 0U) {
    RCC->CFGR = (RCC->CFGR & ~RCC_CFGR_PPRE1) | (RCC_ClkInitStruct->APB1CLKDivider << RCC_CFGR_PPRE1_Pos);
  }
  if ((RCC_ClkInitStruct->ClockType & RCC_CLOCKTYPE_PCLK2) != 0U) {
    RCC->CFGR = (RCC->CFGR & ~RCC_CFGR_PPRE2) | (RCC_ClkInitStruct->APB2CLKDivider << RCC_CFGR_PPRE2_Pos);
  }
  SystemCoreClock = HAL_RCC_GetHCLKFreq();
  return HAL_InitTick(TICK_INT_PRIORITY);
}

static uint32_t PllFrequency(void)
{
  uint32_t pllcfgr = RCC->PLLCFGR;
  uint32_t input = (pllcfgr & RCC_PLLCFGR_PLLSRC_HSE) != 0U ? HSE_VALUE : HSI_VALUE;
  uint32_t vco = input / (pllcfgr & RCC_PLLCFGR_PLLM) * ((pllcfgr & RCC_PLLCFGR_PLLN) >> RCC_PLLCFGR_PLLN_Pos);
  return vco / ((((pllcfgr & RCC_PLLCFGR_PLLP) >> RCC_PLLCFGR_PLLP_Pos) + 1U) * 2U);
}

uint32_t HAL_RCC_GetSysClockFreq(void)
{
  switch ((RCC->CFGR >> RCC_CFGR_SWS_Pos) & RCC_CFGR_SW) {
  case SWS_PLL:
    return PllFrequency();
  case SWS_HSE:
    return HSE_VALUE;
  default:
    return HSI_VALUE;
  }
}

uint32_t HAL_RCC_GetHCLKFreq(void)
{
  /* Codes 8..15 divide by 2, 4, 8, 16, 64, 128, 256, 512; there is no 32 (RM0368 6.3.3, HPRE). */
  static const uint8_t shifts[16] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 6, 7, 8, 9};
  return HAL_RCC_GetSysClockFreq() >> shifts[(RCC->CFGR & RCC_CFGR_HPRE) >> RCC_CFGR_HPRE_Pos];
}

/* Codes 4..7 divide by 2, 4, 8, 16 (RM0368 6.3.3, PPRE1 and PPRE2). */
static uint32_t ApbShift(uint32_t code) { return code < 4U ? 0U : code - 3U; }

uint32_t HAL_RCC_GetPCLK1Freq(void)
{
  return HAL_RCC_GetHCLKFreq() >> ApbShift((RCC->CFGR & RCC_CFGR_PPRE1) >> RCC_CFGR_PPRE1_Pos);
}

uint32_t HAL_RCC_GetPCLK2Freq(void)
{
  return HAL_RCC_GetHCLKFreq() >> ApbShift((RCC->CFGR & RCC_CFGR_PPRE2) >> RCC_CFGR_PPRE2_Pos);
}
