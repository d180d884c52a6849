/* Nothing is wrong: a number is kept in the flash's last sector over a reset. */
#include "boot.h"

#define CELL (*(volatile uint32_t *)0x08020000U)
#define FLASH_KEYR (*(volatile uint32_t *)0x40023C04U)
#define FLASH_SR (*(volatile uint32_t *)0x40023C0CU)
#define FLASH_CR (*(volatile uint32_t *)0x40023C10U)
#define AIRCR (*(volatile uint32_t *)0xE000ED0CU)
#define PG 0x201U   /* and words */
#define ERASE 0x22AU /* sector 5 */
#define START 0x10000U
#define LOCK 0x80000000U

static void operate(uint32_t control)
{
  FLASH_KEYR = 0x45670123U;
  FLASH_KEYR = 0xCDEF89ABU;
  FLASH_CR = control;
}

static void finish(void)
{
  while (FLASH_SR & START) {
  }
  FLASH_CR = LOCK;
  if (FLASH_SR != 0U) {
    Error_Handler();
  }
}

static void keep(uint32_t number)
{
  operate(ERASE);
  FLASH_CR |= START;
  finish();
  operate(PG);
  CELL = number;
  finish();
}

int main(void)
{
  boot();
  if (CELL == 0xFFFFFFFFU) {
    keep(42U);
    AIRCR = 0x05FA0004U;
  }
  if (CELL != 42U) {
    Error_Handler();
  }
  blink_for_ever();
}
