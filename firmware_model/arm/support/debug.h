/* PRINTF, the lab's way to the terminal. */
#ifndef DEBUG_H
#define DEBUG_H

/* Formats as printf does, sends the first 254 characters over USART1 and waits until they have left. While another
 * PRINTF is sending (one in an interrupt, during the main loop's) the text is lost. The compiler compares the format
 * with the arguments, as it does for printf. */
void PRINTF(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
