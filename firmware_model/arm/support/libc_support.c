/* Functions that the C library needs. _sbrk() provides memory for the digits of a %f, between variables
 * and stack. If this memory is used up, an assertion fails, and __assert_func() loops forever.
 */
#include <errno.h>
#include <stddef.h>

extern char _end; /* set in the linker script */
extern char _heap_limit;

void *_sbrk(ptrdiff_t increment);
void __assert_func(const char *file, int line, const char *function, const char *expression);

void *_sbrk(ptrdiff_t increment)
{
  static char *top = &_end;
  char *old = top;
  if (increment > &_heap_limit - old) {
    errno = ENOMEM;
    return (void *)-1; /* the result of a failed sbrk */
  }
  top += increment;
  return old;
}

void __assert_func(const char *file, int line, const char *function, const char *expression)
{
  (void)file, (void)line, (void)function, (void)expression; /* shown by a debugger */
  for (;;) {
  }
}
