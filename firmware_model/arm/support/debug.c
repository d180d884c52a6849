/* PRINTF on USART1.
 *
 * Decision: only the characters that vsnprintf put into the buffer are sent. ST's version sends as
 * many characters as the whole text has, and so reads past its buffer if a line is longer than 253
 * characters.
 */
#include "debug.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "board.h"

#define BUFFER_SIZE 255
#define TIMEOUT_MS 1000U

void PRINTF(const char *format, ...)
{
  char text[BUFFER_SIZE];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  HAL_UART_Transmit(&huart1, (const uint8_t *)text, (uint16_t)strlen(text), TIMEOUT_MS);
}
