/* Code that means no good: random half-words, 32-bit forms, mutations of a program, accesses to registers, branches
 * and memory accesses to where memories end.
 */
#include <string.h>

#include "hostile.h"

#define LONGEST 600 /* half-words of a stream */
#define VECTORS 102
#define RCC 0x40023800u

static const uint32_t EDGES[] = {
    FLASH_BASE,
    FLASH_BASE + FLASH_SIZE,
    0,
    FLASH_SIZE,
    RAM_BASE,
    RAM_BASE + RAM_SIZE,
    SYSTEM_MEMORY_BASE,
    SYSTEM_MEMORY_BASE + SYSTEM_MEMORY_SIZE,
    0x22000000, /* bit-band aliases */
    0x22000000 + 32 * RAM_SIZE,
    0x42000000,
    0x42000000 + 32 * PERIPHERALS_SIZE,
    PERIPHERALS_BASE,
    PERIPHERALS_BASE + PERIPHERALS_SIZE,
    0x50000000,
    0xE0000000,
    0xE0100000,
    0xFFFFFFF0, /* EXC_RETURN */
};

static uint16_t code[LONGEST + 160];
static uint32_t length;
static uint32_t used_at, used_size; /* of flash, besides vectors */

static void put(uint32_t half_word) { code[length++] = (uint16_t)half_word; }

static void put_wide(uint32_t first, uint32_t second) {
  put(first);
  put(second);
}

static void put_constant(uint32_t d, uint32_t value) {
  for (uint32_t top = 0; top < 2; top++) {
    uint32_t imm = value >> 16 * top & 0xFFFF; /* MOVW, MOVT (A7.7.76, A7.7.79) */
    put_wide((top ? 0xF2C0u : 0xF240u) | (imm >> 11 & 1) << 10 | imm >> 12,
             (imm >> 8 & 7) << 12 | d << 8 | (imm & 0xFF));
  }
}

/* -- values ------------------------------------------------------------------------------------------------ */

static uint32_t any_edge(void) {
  uint32_t edge = EDGES[any(sizeof EDGES / sizeof *EDGES)];
  return edge + any(72) - 36;
}

/* The USARTs more often, because few streams set one up so that it sends. */
static uint32_t any_base(const Chip *chip) {
  static const uint32_t usarts[] = {USART1_BASE, USART2_BASE, USART6_BASE};
  return any(16) ? fcu_peripheral_base(chip, (int32_t)any((uint32_t)fcu_peripheral_count(chip))) : usarts[any(3)];
}

static uint32_t any_register(const Chip *chip) {
  uint32_t base = any_base(chip);
  switch (any(8)) {
  case 0: return RCC + any(0x90);
  case 1: return base + any(0x400);
  case 2: return any(2) ? 0xE000E000 + any(0x1000) : 0xE000ED00 + any(0x90);
  case 3: return 0x42000000 + 32 * ((base & 0xFFFFF) + any(0x50));
  default: return base + (any(0x50) & ~3u);
  }
}

uint32_t any_address(const Chip *chip) {
  switch (any(8)) {
  case 0: return any(0);
  case 1: return any_edge();
  case 2: return FLASH_BASE + any(FLASH_SIZE);
  case 3:
  case 4: return RAM_BASE + any(RAM_SIZE);
  default: return any_register(chip);
  }
}

uint32_t any_value(const Chip *chip) {
  switch (any(8)) {
  case 0: return any(0);
  case 1: return 1u << any(32);
  case 2: return any(2) - 1;
  case 3: return any(256);
  case 4: return any(0) & any(0) & 0xFFFF;
  case 5: return any(0) | any(0) << any(32);
  default: return any_address(chip);
  }
}

/* -- pieces of code ------------------------------------------------------------------------------------------ */

static void put_anything(const Chip *chip) {
  (void)chip;
  put(any(0));
}

static void put_any_wide(const Chip *chip) {
  (void)chip;
  put_wide(0xE800 + any(0x1800), any(0));
}

/* Instructions that only compute, of the groups with holes: floating point, DSP, products, parts of registers. */
static void put_number(const Chip *chip) {
  (void)chip;
  switch (any(6)) {
  case 0: put_wide(0xEE00 | any(0x100), 0x0A00 | (any(0) & 0xF1EF)); break;
  case 1: put_wide(0xEEB0 | any(2) << 6 | any(16), 0x0A40 | (any(0) & 0xF1EF)); break;
  case 2: put_wide(0xFA80 | any(0x80), 0xF000 | any(0x1000)); break;
  case 3: put_wide(0xFB00 | any(0x100), any(0x10000)); break;
  case 4: put_wide(0xF300 | any(0x100), any(0x8000)); break;
  default: put_wide(any(2) ? 0xEEE1 : 0xEEF1, 0x0A10 | any(15) << 12); break; /* VMSR, VMRS of FPSCR */
  }
}

/* System instructions, floating-point transfers, and IT blocks, which are few among random ones. */
static void put_rare(const Chip *chip) {
  switch (any(5)) {
  case 0: put_wide(0xEC00 | any(0x400), 0x0A00 | (any(0) & 0xF1FF)); break;
  case 1: put_wide(0xF380 | any(0x80), 0x8000 | any(0x1000)); break;
  case 2: put(0xBF00 | any(0x100)); break;
  case 3: put(0xB660 | any(0x20)); break;
  default: put_number(chip); break;
  }
}

static void put_access(const Chip *chip) {
  static const uint32_t stores[] = {0xF8C0, 0xF8C0, 0xF880, 0xF8A0}, loads[] = {0xF8D0, 0xF890, 0xF8B0, 0xF990};
  uint32_t address = any_register(chip);
  put_constant(0, any(8) ? address & ~3u : address);
  put_constant(1, any_value(chip));
  for (uint32_t count = 1 + any(4); count; count--) {
    uint32_t offset = any(3) ? 0 : 4 * any(12);
    put_wide(any(3) ? stores[any(4)] : loads[any(4)], 1 << 12 | offset);
  }
}

/* Blocks set up so that they work: offsets and values in order (RM0368); pairs end with an offset of END. */
#define END 0xFFFF
typedef struct {
  uint32_t bases[3];
  struct {
    uint16_t offset;
    uint32_t value;
  } writes[10];
} Recipe;

static const Recipe RECIPES[] = {
    {{0x40011000, 0x40004400, 0x40011400}, /* USART: BRR, CR3, CR1, DR */
     {{0x08, 0x10}, {0x14, 0xC0}, {0x0C, 0x202C}, {0x04, 0x41}, {0x04, 0x42}, {0x0C, 0x20EC}, {END, 0}}},
    {{0x40005800, 0x40005400, 0x40005C00}, /* I2C: CR2, CCR, CR1 with START, DR, CR1 with STOP */
     {{0x04, 0x710}, {0x1C, 4}, {0x20, 5}, {0x00, 0x501}, {0x10, 0xD6}, {0x10, 0x28}, {0x00, 0x701}, {END, 0}}},
    {{0x40003800, 0x40013000, 0x40003C00}, /* SPI: CR2, CR1, DR */
     {{0x04, 0xE3}, {0x00, 0x347}, {0x0C, 0xA8}, {0x0C, 0}, {0x0C, 0x28}, {0x00, 0x8347}, {END, 0}}},
    {{0x40020400, 0x40020000, 0x40020800}, /* GPIO: chip selects out, the others to a function; BSRR */
     {{0x00, 0x55AAAAAA}, {0x24, 0x55557777}, {0x20, 0x55557777}, {0x18, 0xF000}, {0x18, 0xF0000000}, {END, 0}}},
    {{0x40026010, 0x40026088, 0x40026440}, /* a DMA stream: NDTR, PAR, M0AR, CR */
     {{0x04, 20}, {0x08, 0x40005810}, {0x0C, 0x20000100}, {0x10, 0x20000200}, {0x14, 7}, {0x00, 0x541F}, {END, 0}}},
    {{0x40000000, 0x40010000, 0x40014000}, /* TIM: PSC, ARR, CCMR1, CCR1, CCER, BDTR, DIER, CR1 */
     {{0x28, 1}, {0x2C, 40}, {0x18, 0x6868}, {0x34, 9}, {0x20, 0x3333}, {0x44, 0x8000}, {0x0C, 0x1F5F}, {0x00, 1},
      {END, 0}}},
    {{0x40013C00, 0x40013800, 0xE000E100}, /* EXTI, SYSCFG, NVIC: all of it */
     {{0x00, WORD}, {0x04, WORD}, {0x08, 0x55555}, {0x0C, 0x33333}, {0x10, 0xF0F}, {END, 0}}},
    {{0xE000E010, 0xE000E010, 0xE000E010}, /* SysTick: RVR, CSR */
     {{0x04, 100}, {0x00, 7}, {END, 0}}},
};

/* Some time: a loop of up to a thousand laps. */
static void put_pause(const Chip *chip) {
  (void)chip;
  put_wide(0xF240 | any(2), 6 << 8 | any(256)); /* MOVW R6 */
  put(0x3E01);                                  /* SUBS R6, #1 */
  put(0xD1FD);                                  /* BNE */
}

static void put_recipe(const Chip *chip) {
  const Recipe *recipe = &RECIPES[any(sizeof RECIPES / sizeof *RECIPES)];
  put_constant(0, recipe->bases[any(3)]);
  for (int n = 0; recipe->writes[n].offset != END; n++) {
    uint32_t value = recipe->writes[n].value ^ (any(4) ? 0 : 1u << any(32));
    put_constant(1, any(16) ? value : any_value(chip));
    put_wide(0xF8C0, 1 << 12 | recipe->writes[n].offset);
    if (any(3) == 0) {
      put_pause(chip);
    }
    for (uint32_t looks = any(3); looks; looks--) {
      put_wide(0xF8D0, 1 << 12 | 4 * any(8)); /* flags are cleared by reads */
    }
  }
}

/* A block as it might be set up by mistake. */
static void put_block(const Chip *chip) {
  put_constant(0, any_base(chip));
  for (uint32_t count = 2 + any(8); count; count--) {
    put_constant(1, any_value(chip));
    put_wide(any(6) ? 0xF8C0 : 0xF8D0, 1 << 12 | 4 * any(20));
  }
}

/* Single, dual, multiple, exclusive, floating point, table branches; the base is R2. */
static void put_memory(const Chip *chip) {
  put_constant(2, any(3) ? any_edge() : any_address(chip));
  switch (any(6)) {
  case 0: put_wide(0xE802 | any(0x20) << 4, any(0)); break;
  case 1: put_wide(0xE842 | any(0x20) << 4, any(0)); break;
  case 2: put_wide(0xEC02 | any(0x40) << 4, 0x0A00 | (any(0) & 0xF1FF)); break;
  case 3: put(any(2) ? 0x6800 | (any(0x800) & ~0x38u) | 2 << 3 : 0xC200 | any(0x900)); break;
  default: put_wide(0xF802 | any(0x20) << 4, any(0)); break;
  }
}

static void put_branch(const Chip *chip) {
  uint32_t target = any(2) ? any_edge() : any(2) ? hostile.entry + any(4 * LONGEST) : any_value(chip);
  put_constant(3, any(4) ? target | 1 : target);
  switch (any(5)) {
  case 0: put(0x4718); break;                  /* BX R3 */
  case 1: put(0x4798); break;                  /* BLX R3 */
  case 2: put(0x469F); break;                  /* MOV PC, R3 */
  case 3: put(0xB408), put(0xBD00); break;     /* PUSH {R3}; POP {PC} */
  default: put(0x469D), put(0xBD00 | any(0x100)); break; /* MOV SP, R3; POP {..., PC} */
  }
}

typedef void (*Piece)(const Chip *chip);

static void fill(const Chip *chip, const Piece *pieces, uint32_t count) {
  uint32_t wanted = 8 + any(LONGEST - 8);
  length = 0;
  if (any(4)) {
    put_constant(0, 0xE000ED88); /* CPACR: the FPU is on */
    put_constant(1, 0x00F00000);
    put_wide(0xF8C0, 1 << 12);
  }
  while (length < wanted) {
    pieces[any(count)](chip);
  }
  if (any(2)) {
    put(0xE000 | (-(length + 2) & 0x7FF)); /* B to the beginning, or nearly */
  }
}

/* -- where it is put ------------------------------------------------------------------------------------------ */

static void put_mutation(uint8_t *flash) {
  const Program *program = &hostile.program[any(hostile.programs)];
  memcpy(flash, program->bytes, program->size);
  memcpy(&hostile.entry, flash + 4, 4);
  hostile.entry &= ~1u;
  used_at = 0;
  used_size = program->size;
  for (uint32_t count = any(8); count; count--) {
    uint32_t at = any(program->size), size = any(32);
    switch (any(3)) {
    case 0: flash[at] ^= (uint8_t)(1u << any(8)); break;
    case 1: flash[at] = (uint8_t)any(256); break;
    default: memcpy(flash + at, program->bytes + any(program->size), at + size < program->size ? size : 1);
    }
  }
}

static void place(Chip *chip) {
  uint32_t size = 2 * length, edge = any(4) == 0;
  uint8_t *memory = fcu_flash(chip);
  uint32_t base = FLASH_BASE, at = edge ? FLASH_SIZE - size : 0x200 + 2 * any(64);
  if (any(3) == 0) {
    memory = fcu_ram(chip);
    base = RAM_BASE;
    at = edge ? RAM_SIZE - size : 2 * any(0x4000);
  }
  memcpy(memory + at, code, size);
  hostile.entry = base + at;
  used_at = base == FLASH_BASE ? at : 0;
  used_size = base == FLASH_BASE ? size : 0;
}

/* Most faults are survived: the handler goes on two bytes after the instruction. */
static const uint16_t GO_ON[] = {
    0xF3EF, 0x8008, /* MRS R0, MSP */
    0x6981,         /* LDR R1, [R0, #24]: PC */
    0x3102,         /* ADDS R1, #2 */
    0x6181,         /* STR R1, [R0, #24] */
    0x2101, 0x0609, /* MOVS R1, #1; LSLS R1, R1, #24 */
    0x61C1,         /* STR R1, [R0, #28]: xPSR, without IT block */
    0x4770,         /* BX LR */
};

static void put_vectors(const Chip *chip, uint8_t *flash) {
  uint32_t vectors[VECTORS];
  vectors[0] = any(8) ? RAM_BASE + RAM_SIZE - 8 * any(64) : any_value(chip);
  vectors[1] = any(32) ? hostile.entry | 1 : any_value(chip);
  for (int n = 2; n < VECTORS; n++) {
    vectors[n] = any(8) ? (hostile.entry + 2 * any(length)) | 1 : any_value(chip);
  }
  for (int n = 3; n <= 6 && any(8); n++) {
    vectors[n] = (FLASH_BASE + sizeof vectors) | 1;
  }
  memcpy(flash, vectors, sizeof vectors);
  memcpy(flash + sizeof vectors, GO_ON, sizeof GO_ON);
}

static void fill_ram(const Chip *chip, uint8_t *ram) {
  for (uint32_t at = 0; at < RAM_SIZE; at += 4 + 4 * any(512)) {
    uint32_t value = any_value(chip);
    memcpy(ram + at, &value, 4);
  }
}

void erase_stream(Chip *chip) {
  memset(fcu_flash(chip), 0xFF, 4 * VECTORS + sizeof GO_ON);
  memset(fcu_flash(chip) + used_at, 0xFF, used_size);
}

void make_stream(Chip *chip) {
  static const Piece random[] = {put_anything}, numbers[] = {put_number}, wide[] = {put_any_wide, put_any_wide, put_anything, put_rare},
                     accesses[] = {put_recipe, put_recipe, put_pause, put_block, put_access, put_pause, put_anything},
                     blocks[] = {put_recipe, put_recipe, put_recipe, put_pause},
                     edges[] = {put_memory, put_memory, put_branch, put_anything, put_any_wide},
                     all[] = {put_anything, put_any_wide, put_rare, put_block, put_memory, put_branch, put_recipe};
#define FILL(pieces) fill(chip, pieces, sizeof pieces / sizeof *pieces)
  erase_stream(chip);
  fill_ram(chip, fcu_ram(chip));
  switch (any(9)) {
  case 0:
  case 1: put_mutation(fcu_flash(chip)); return;
  case 2: FILL(random); break;
  case 3: FILL(wide); break;
  case 4: FILL(accesses); break;
  case 5: FILL(blocks); break;
  case 6: FILL(edges); break;
  case 7: FILL(numbers); break;
  default: FILL(all); break;
  }
  place(chip);
  put_vectors(chip, fcu_flash(chip));
}
