/* printf and its inverse: the C library's, and a small one of our own with variable arguments. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kernel.h"

static char line[160];

static void add_line(int length) {
  add((uint32_t)length);
  add_bytes(line, strlen(line));
}

static void run_integers(void) {
  for (int n = 0; n < 60; n++) {
    uint32_t a = word();
    uint64_t b = any64() >> (any() & 63);
    add_line(snprintf(line, sizeof line, "%ld|%8lu|%-12lx|%#lo|%+ld", (long)a, a, a, a, (long)a / 7));
    add_line(snprintf(line, sizeof line, "%lld %llu %016llX", (long long)b, (unsigned long long)b, b));
    add_line(snprintf(line, sizeof line, "%c%5c%-4c%%%s|%10.3s|%-9s|", 'a' + (int)(a % 26), '!', '?', "text",
                      "cut off", "left"));
    add_line(snprintf(line, 1 + a % 30, "%lu and more than fits", a));
  }
}

static void run_floats(void) {
  for (int n = 0; n < 40; n++) {
    double value = (double)(int32_t)any() / (1 + (any() >> (any() & 31)));
    add_line(snprintf(line, sizeof line, "%f %.2f %10.4f %+.0f", value, value, value, value));
    add_line(snprintf(line, sizeof line, "%e %.3E %g %G", value, value * 1e30, value, value * 1e-30));
    add_line(snprintf(line, sizeof line, "%a %.3a", value, value));
  }
  add_line(snprintf(line, sizeof line, "%f %f %f", 1e300 * 1e300, -0.0, 0.0));
}

static void run_parsing(void) {
  for (int n = 0; n < 60; n++) {
    double value = (double)(int32_t)any() / (1 + (any() >> (any() & 31))), parsed;
    long integer;
    char word_read[16];
    snprintf(line, sizeof line, "%.17g", value);
    parsed = strtod(line, NULL);
    add((uint32_t)(parsed == value));
    add((uint32_t)strtol("-0x7fAbc", NULL, 0) + (uint32_t)strtoul("4294967295", NULL, 10));
    snprintf(line, sizeof line, " %ld, name%d ", (long)word(), n);
    add((uint32_t)sscanf(line, "%ld , %15s", &integer, word_read));
    add((uint32_t)integer);
    add_bytes(word_read, strlen(word_read));
  }
}

static char *put_number(char *at, uint32_t value, uint32_t base, int width) {
  char digits[32];
  int count = 0;
  do {
    digits[count++] = "0123456789abcdef"[value % base];
    value /= base;
  } while (value);
  for (int n = count; n < width; n++) {
    *at++ = ' ';
  }
  while (count) {
    *at++ = digits[--count];
  }
  return at;
}

static int print(char *at, const char *format, ...) {
  char *begin = at;
  va_list arguments;
  va_start(arguments, format);
  for (; *format; format++) {
    if (*format != '%') {
      *at++ = *format;
      continue;
    }
    int width = 0;
    for (format++; *format >= '0' && *format <= '9'; format++) {
      width = 10 * width + *format - '0';
    }
    switch (*format) {
    case 'd': {
      int32_t value = va_arg(arguments, int32_t);
      if (value < 0) {
        *at++ = '-';
      }
      at = put_number(at, value < 0 ? -(uint32_t)value : (uint32_t)value, 10, width);
      break;
    }
    case 'u': at = put_number(at, va_arg(arguments, uint32_t), 10, width); break;
    case 'x': at = put_number(at, va_arg(arguments, uint32_t), 16, width); break;
    case 'b': at = put_number(at, va_arg(arguments, uint32_t), 2, width); break;
    case 's':
      for (const char *text = va_arg(arguments, const char *); *text; text++) {
        *at++ = *text;
      }
      break;
    case 'L': {
      uint64_t value = va_arg(arguments, uint64_t);
      at = put_number(put_number(at, (uint32_t)(value >> 32), 16, 0), (uint32_t)value, 16, 8);
      break;
    }
    default: *at++ = *format;
    }
  }
  va_end(arguments);
  *at = 0;
  return (int)(at - begin);
}

static void run_own(void) {
  for (int n = 0; n < 200; n++) {
    uint32_t a = word(), b = word();
    add_line(print(line, "%d %12u %x %s %% %L %8b", a, b, a, "own", any64(), b >> 20));
  }
}

const Kernel format_kernels[] = {
    {"print-integers", run_integers}, {"print-floats", run_floats}, {"parse", run_parsing},
    {"print-own", run_own}, {NULL, NULL},
};
