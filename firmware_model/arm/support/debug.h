/* PRINTF, with which the lab prints on the terminal. */
#ifndef DEBUG_H
#define DEBUG_H

/* Formats as printf does, sends the first 254 characters over USART1, and waits until they have
 * been sent. If another PRINTF is sending (for example, if an interrupt prints during a PRINTF
 * of the main loop), the text is lost. The compiler compares the format with the arguments, as
 * it does for printf. */
void PRINTF(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
