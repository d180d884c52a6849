/* Random instruction streams on the chip's library: hostile FIRST COUNT PROGRAM ...
 *
 * Streams FIRST to FIRST + COUNT - 1, always the same by one compiler, are made and executed, with whatever they do to the chip; each PROGRAM is the
 * contents of flash that some of them are mutations of. Built with sanitizers, the process ends at the first thing
 * that is wrong in C, and says in which stream; it also ends if flash has changed, or a stream does not end. GROUP
 * streams use one chip, one after another: to see one again, begin with its group.
 *
 * surroundings.c is the part of Python, streams.c makes the code. What was seen is printed at the end.
 */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "hostile.h"

#define GROUP 64
#define SECONDS 20 /* of a group, before it is taken to hang */
#define PIECES 24
#define LONGEST_PS (1 << 28) /* of a piece */
#define INSTRUCTIONS 8000    /* of a stream; the last piece may go beyond */

#if defined(__SANITIZE_ADDRESS__) || defined(__has_feature)
void __sanitizer_set_death_callback(void (*callback)(void));
#endif

Hostile hostile;
static uint8_t snapshot[sizeof(Chip)];

uint32_t any(uint32_t below) {
  uint64_t x = hostile.random += UINT64_C(0x9E3779B97F4A7C15); /* splitmix64 */
  x = (x ^ x >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
  x = (x ^ x >> 27) * UINT64_C(0x94D049BB133111EB);
  x ^= x >> 31;
  return below ? (uint32_t)((x >> 32) * below >> 32) : (uint32_t)x;
}

static void tell_stream(void) {
  char text[80];
  int length = snprintf(text, sizeof text, "\nin stream %llu, of the group that begins with %llu\n",
                        (unsigned long long)hostile.stream,
                        (unsigned long long)(hostile.stream - hostile.stream % GROUP));
  (void)!write(2, text, (size_t)length);
}

static void hangs(int number) {
  (void)number;
  static const char text[] = "it does not end";
  (void)!write(2, text, sizeof text - 1);
  tell_stream();
  _exit(3);
}

static void wrong(const char *what) {
  fprintf(stderr, "%s", what);
  tell_stream();
  exit(4);
}

/* -- what a debugger and a snapshot do between runs ------------------------------------------------------- */

static void interfere(Chip *chip) {
  uint32_t value, address = any_address(chip);
  switch (any(12)) {
  case 0: fcu_load(chip, address, 1u << any(3), &value); break;
  case 1: fcu_store(chip, address, 1u << any(3), any(0)); break;
  case 2: fcu_set_breakpoint(chip, hostile.entry + 2 * any(64), (int32_t)any(2)); break;
  case 3: fcu_watch_memory(chip, (int32_t)any(2), address, address + any(256)); break;
  case 4: fcu_halt(chip); break;
  case 5: fcu_debug(chip, (int32_t)any(2)); break;
  case 6: fcu_wake(chip); break;
  case 7: fcu_advance(chip, chip->now_ps + any(1000000)); break;
  case 8:
    if (any(20) == 0) {
      fcu_save(chip, snapshot);
      fcu_run_until(chip, chip->now_ps + 2000000);
      fcu_restore(chip, snapshot);
    }
    break;
  default: break;
  }
}

/* -- a stream ---------------------------------------------------------------------------------------------- */

static void prepare(Chip *chip) {
  fcu_watch_memory(chip, 0, 0, 0);
  for (uint32_t at = 0; at < 64; at++) {
    fcu_set_breakpoint(chip, hostile.entry + 2 * at, 0);
  }
  fcu_resume(chip, 0);
  fcu_debug(chip, 0);
  make_stream(chip);
  fcu_invalidate_code(chip);
  chip->must_stop = 0;
  chip->detailed = any(4) == 0;
  chip->observed = chip->detailed || any(2);
  memset(&chip->python_registers, 0, sizeof chip->python_registers); /* a stream depends on its number alone */
  set_some_clocks(chip);
  fcu_reset_now(chip, 1);
  int32_t numbers[13];
  uint32_t values[13];
  for (int32_t number = 0; number < 13; number++) {
    numbers[number] = number;
    values[number] = any_value(chip);
  }
  fcu_write_registers(chip, numbers, values, 13);
}

static void run(Chip *chip) {
  Status before, after;
  fcu_status(chip, &before);
  for (int piece = 0; piece < PIECES; piece++) {
    int64_t until_ps = chip->now_ps + 1 + any(LONGEST_PS >> any(12));
    int32_t ended = fcu_run_until(chip, until_ps);
    chip->must_stop = 0;
    fcu_status(chip, &after);
    static Edge edges[64];
    int64_t lost;
    if (fcu_take_edges(chip, edges, 64, &lost) > 64 || lost < 0) {
      wrong("more edges were given than there is room for");
    }
    if (ended == ENDED_AT_TIME && chip->now_ps < until_ps) {
      wrong("the run ended too early");
    }
    if (ended == ENDED_HALTED) {
      fcu_halted_on_bkpt(chip);
      fcu_resume(chip, any(2));
    }
    if (any(4) == 0) {
      interfere(chip);
    }
    if (after.retired - before.retired > INSTRUCTIONS) {
      break;
    }
  }
  hostile.instructions += (uint64_t)(after.retired - before.retired);
  hostile.accesses += (uint64_t)(after.accesses - before.accesses);
}

static void end_group(Chip *chip) {
  erase_stream(chip);
  for (uint32_t at = 0; at < FLASH_SIZE; at++) {
    if (fcu_flash(chip)[at] != 0xFF) {
      wrong("flash has changed");
    }
  }
  fcu_destroy(chip);
}

static void add_to_digest(Chip *chip) {
  static const int32_t numbers[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  uint32_t values[16];
  fcu_read_registers(chip, numbers, values, 16);
  for (int n = 0; n < 16; n++) {
    hostile.digest = (hostile.digest ^ values[n]) * UINT64_C(0x100000001B3);
  }
}

static Chip *new_chip(void) {
  Chip *chip = fcu_create(&host_calls);
  if (!chip) {
    wrong("no memory");
  }
  hostile.chip = chip;
  connect_surroundings(chip);
  fcu_configure(chip, 1 + any(20), 10, any(8) != 0);
  fcu_start(chip);
  return chip;
}

static void load(const char *file, Program *program) {
  FILE *opened = fopen(file, "rb");
  if (!opened) {
    perror(file);
    exit(2);
  }
  program->size = (uint32_t)fread(program->bytes, 1, FLASH_SIZE, opened);
  fclose(opened);
}

int main(int count, char **arguments) {
  if (count < 4 || count > 3 + PROGRAMS) {
    fprintf(stderr, "hostile FIRST COUNT PROGRAM ...; at most %d programs\n", PROGRAMS);
    return 2;
  }
  uint64_t first = strtoull(arguments[1], NULL, 10), streams = strtoull(arguments[2], NULL, 10);
  for (hostile.programs = 0; hostile.programs < (uint32_t)count - 3; hostile.programs++) {
    load(arguments[3 + hostile.programs], &hostile.program[hostile.programs]);
  }
  signal(SIGALRM, hangs);
#if defined(__SANITIZE_ADDRESS__) || defined(__has_feature)
  __sanitizer_set_death_callback(tell_stream);
#endif
  Chip *chip = NULL;
  for (hostile.stream = first; hostile.stream < first + streams; hostile.stream++) {
    hostile.random = hostile.stream;
    if (!chip || hostile.stream % GROUP == 0) {
      if (chip) {
        end_group(chip);
      }
      alarm(SECONDS);
      chip = new_chip();
    }
    prepare(chip);
    if (getenv("HOSTILE_MISTAKE")) { /* for the test that mistakes are seen */
      ((volatile uint8_t *)chip)[sizeof(Chip)] = 0;
    }
    run(chip);
    add_to_digest(chip);
  }
  end_group(chip);
  printf("streams %llu\ninstructions %llu\naccesses %llu\nfaults %llu\nlock-ups %llu\nresets %llu\nnotes %llu\n",
         (unsigned long long)streams, (unsigned long long)hostile.instructions,
         (unsigned long long)hostile.accesses, (unsigned long long)hostile.faults,
         (unsigned long long)hostile.lock_ups, (unsigned long long)hostile.resets,
         (unsigned long long)hostile.notes);
  printf("bytes on buses %llu\nbytes sent %llu\ndigest %016llx\n", (unsigned long long)hostile.on_buses,
         (unsigned long long)hostile.sent, (unsigned long long)hostile.digest);
  return 0;
}
