/* The start bit's flag is waited for, and no start was asked for. */
#include "boot.h"

int main(void)
{
  boot();
  while ((I2C2->SR1 & I2C_SR1_SB) == 0U) {
  }
  blink_for_ever();
}
