/* Reset, the checksum, and a line for each kernel over USART1, then "end" and a system reset.
 *
 * The STM32F401 and QEMU's STM32F405 have USART1, RCC and GPIOA at the same addresses; QEMU's RCC and GPIOA
 * take what is written and do nothing. The reset ends QEMU where it is called with -no-reboot.
 */
#include <string.h>

#include "kernel.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define RCC_AHB1ENR REGISTER(0x40023830)
#define RCC_APB2ENR REGISTER(0x40023844)
#define GPIOA_MODER REGISTER(0x40020000)
#define GPIOA_AFRH REGISTER(0x40020024)
#define USART1_SR REGISTER(0x40011000)
#define USART1_DR REGISTER(0x40011004)
#define USART1_BRR REGISTER(0x40011008)
#define USART1_CR1 REGISTER(0x4001100C)
#define CPACR REGISTER(0xE000ED88)
#define AIRCR REGISTER(0xE000ED0C)

#define TXE (1u << 7)
#define TC (1u << 6)
#define SEED 0x2545F491u

extern uint32_t stack_top, data_image, data_begin, data_end, bss_begin, bss_end, heap_begin, heap_limit;

static const Kernel *const files[] = {
    dsp_kernels,    multiply_kernels, saturation_kernels, vfp_kernels,  convert_kernels,
    double_kernels, integer_kernels,  format_kernels,     sort_kernels, hash_kernels,
    memory_kernels, transfer_kernels, control_kernels,    condition_kernels, exception_kernels,
};

static uint32_t sum, state;

void add(uint32_t value) {
  sum = (sum << 5 | sum >> 27) ^ value;
  sum *= 0x9E3779B1u;
}

void add64(uint64_t value) {
  add((uint32_t)value);
  add((uint32_t)(value >> 32));
}

void add_bytes(const void *bytes, size_t size) {
  const uint8_t *byte = bytes;
  for (size_t n = 0; n < size; n++) {
    add(byte[n]);
  }
}

uint32_t any(void) {
  state ^= state << 13;
  state ^= state >> 17;
  state ^= state << 5;
  return state;
}

uint64_t any64(void) {
  uint32_t low = any();
  return (uint64_t)any() << 32 | low;
}

uint32_t word(void) {
  static const uint32_t special[] = {0,          1,          2,          31,         32,         33,
                                     0x7F,       0x80,       0xFF,       0x7FFF,     0x8000,     0xFFFF,
                                     0x7FFFFFFF, 0x80000000, 0x80000001, 0xFFFFFFFF, 0x80008000, 0x7FFF7FFF,
                                     0x80808080, 0x7F7F7F7F};
  uint32_t choice = any();
  switch (choice >> 30) {
  case 0: return special[choice % LENGTH(special)];
  case 1: return any() >> (choice & 31);
  default: return any();
  }
}

static void put(char character) {
  while (!(USART1_SR & TXE)) {
  }
  USART1_DR = (uint8_t)character;
}

static void put_text(const char *text) {
  while (*text) {
    put(*text++);
  }
}

static void put_hex(uint32_t value) {
  for (int shift = 28; shift >= 0; shift -= 4) {
    put("0123456789ABCDEF"[value >> shift & 0xF]);
  }
}

static void set_up(void) {
  CPACR |= 0xFu << 20;
  __asm volatile("dsb\n isb");
  RCC_AHB1ENR |= 1;
  RCC_APB2ENR |= 1u << 4;
  GPIOA_AFRH |= 7u << 4; /* PA9 is USART1_TX */
  GPIOA_MODER |= 2u << 18;
  USART1_BRR = 16; /* 1 Mbaud of HSI's 16 MHz */
  USART1_CR1 = 1u << 13 | 1u << 3;
}

static void run(const Kernel *kernel) {
  sum = 0;
  state = SEED;
  kernel->run();
  put_text(kernel->name);
  put(' ');
  put_hex(sum);
  put('\n');
}

__attribute__((noreturn)) void reset(void) {
  memcpy(&data_begin, &data_image, (size_t)((char *)&data_end - (char *)&data_begin));
  memset(&bss_begin, 0, (size_t)((char *)&bss_end - (char *)&bss_begin));
  set_up();
  for (size_t file = 0; file < LENGTH(files); file++) {
    for (const Kernel *kernel = files[file]; kernel->name; kernel++) {
      run(kernel);
    }
  }
  put_text("end\n");
  while (!(USART1_SR & TC)) {
  }
  AIRCR = 0x05FA0004; /* SYSRESETREQ */
  for (;;) {
  }
}

/* Memory for the C library's printing of floating-point numbers. */
void *_sbrk(ptrdiff_t increment);
void *_sbrk(ptrdiff_t increment) {
  static char *top = (char *)&heap_begin;
  char *begin = top;
  if (increment > (char *)&heap_limit - top) {
    return (void *)-1;
  }
  top += increment;
  return begin;
}
