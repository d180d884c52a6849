/* Run a program on the C library without Python: run_library LIBRARY IMAGE
 *
 * IMAGE is the contents of flash. Bytes from USART1 go to standard output until the program requests a system reset.
 * Then the number of instructions is printed. This program tests a library on a real or emulated system that does not
 * have Python or its packages (building/run_libraries.py). Only the chip is simulated. Registers that are modelled in
 * Python read as 0, and all peripherals are clocked with 16 MHz.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fcu.h"

#ifdef _WIN32 /* windows.h defines some names that this file also defines */
__declspec(dllimport) void *__stdcall LoadLibraryA(const char *file);
__declspec(dllimport) void *__stdcall GetProcAddress(void *library, const char *name);
static void *opened(const char *file) { return LoadLibraryA(file); }
static void *found(void *library, const char *name) { return GetProcAddress(library, name); }
#else
#include <dlfcn.h>
static void *opened(const char *file) { return dlopen(file, RTLD_NOW); }
static void *found(void *library, const char *name) { return dlsym(library, name); }
#endif

#define HZ 16000000
#define MS_PS 1000000000LL
#define LONGEST_MS 20000
#define USART1 0x40011000u
#define FIND(library, name) __typeof__(&(name)) name##_ = need(found(library, #name), #name)

static Chip *chip;
static int over;

static void *need(void *thing, const char *name) {
  if (!thing) {
    fprintf(stderr, "run_library: %s cannot be had\n", name);
    exit(2);
  }
  return thing;
}

static void load(const char *file, uint8_t *flash) {
  FILE *image = need(fopen(file, "rb"), file);
  fread(flash, 1, FLASH_SIZE, image);
  fclose(image);
}

static void sent(int64_t now_ps, int32_t block, int64_t start_ps, int64_t num, int64_t den, int32_t connected,
                 int64_t first, const uint8_t *bytes, int32_t length, int32_t detailed) {
  (void)now_ps, (void)block, (void)start_ps, (void)num, (void)den, (void)connected, (void)first, (void)detailed;
  fwrite(bytes, 1, (size_t)length, stdout);
}

static void advance(int64_t now_ps) { (void)now_ps; }

static uint32_t read_none(int64_t now_ps, uint32_t address, uint32_t size) {
  (void)now_ps, (void)address, (void)size;
  return 0;
}

static void write_none(int64_t now_ps, uint32_t address, uint32_t size, uint32_t value) {
  (void)now_ps, (void)address, (void)size, (void)value;
}

static void note(int64_t now_ps, int32_t block, int32_t kind, const char *text) {
  (void)now_ps, (void)kind;
  fprintf(stderr, "block %d: %s\n", (int)block, text);
}

static int32_t ignored_access(int64_t now_ps, int32_t peripheral, uint32_t offset, int32_t what, uint32_t value) {
  (void)now_ps;
  fprintf(stderr, "peripheral %d, offset %x: %d, %x\n", (int)peripheral, (unsigned)offset, (int)what, (unsigned)value);
  return 1;
}

static void fault(int64_t now_ps, int32_t exception, uint32_t status, uint32_t hard, uint32_t address) {
  (void)now_ps, (void)exception, (void)status, (void)hard, (void)address;
}

static void stop(void) {
  over = 1;
  chip->must_stop = 1;
}

static void locked_up(int64_t now_ps, uint32_t pc) {
  (void)now_ps;
  fprintf(stderr, "lock-up at %x\n", (unsigned)pc);
  stop();
}

static void reset(int64_t now_ps, int32_t reason) {
  (void)now_ps, (void)reason;
  stop();
}

static void accessed(int64_t now_ps, uint32_t address, uint32_t size, int32_t written) {
  (void)now_ps, (void)address, (void)size, (void)written;
}

int main(int count, char **arguments) {
  if (count != 3) {
    fprintf(stderr, "run_library LIBRARY IMAGE\n");
    return 2;
  }
  void *library = need(opened(arguments[1]), arguments[1]);
  FIND(library, fcu_create);
  FIND(library, fcu_flash);
  FIND(library, fcu_start);
  FIND(library, fcu_run_until);
  FIND(library, fcu_set_clocks);
  FIND(library, fcu_peripheral_count);
  FIND(library, fcu_peripheral_base);
  FIND(library, fcu_gate);
  FIND(library, fcu_connect_usarts);
  FIND(library, fcu_usart_flush);
  FIND(library, fcu_status);
  FIND(library, fcu_destroy);

  Host host = {.advance = advance, .read = read_none, .write = write_none, .note = note,
               .ignored_access = ignored_access,
               .fault = fault, .locked_up = locked_up, .reset = reset, .accessed = accessed};
  Clocks clocks = {HZ, HZ, HZ, HZ, HZ, HZ, HZ, 0, 0};
  UsartCalls calls = {.sent = sent};
  chip = need(fcu_create_(&host), "a chip");
  load(arguments[2], fcu_flash_(chip));
  fcu_set_clocks_(chip, &clocks);
  fcu_connect_usarts_(chip, &calls);
  int32_t usart = -1;
  for (int32_t index = 0; index < fcu_peripheral_count_(chip); index++) {
    fcu_gate_(chip, UINT64_C(1) << index, UINT64_C(1) << index);
    usart = fcu_peripheral_base_(chip, index) == USART1 ? index : usart;
  }
  fcu_start_(chip);
  for (int64_t ms = 1; !over && ms <= LONGEST_MS; ms++) {
    fcu_run_until_(chip, ms * MS_PS);
  }
  fcu_usart_flush_(chip, usart);
  Status status;
  fcu_status_(chip, &status);
  printf("retired %lld\n", (long long)status.retired);
  fcu_destroy_(chip);
  return over ? 0 : 1;
}
