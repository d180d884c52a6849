/* DMA1 and DMA2 (RM0368 section 9; interrupts: table 38), and the request lines (9.3.3, tables 28, 29).
 *
 * A transfer happens immediately when it is requested; the FIFO delays nothing. Packing (9.3.10) follows from
 * little-endian order. A memory-to-memory transfer takes 4 cycles per item (an estimate). All its items are moved at
 * its end; NDTR is constant until then.
 *
 * The tables agree with RM0090 (STM32F405), except I2C3_RX on stream 1 and I2C3_TX on stream 5, which are not
 * certain.
 *
 * NOT MODELLED, with a note: the peripheral as flow controller (PFCTRL, for SDIO). NOT MODELLED, silent: priorities,
 * bursts, PINCOS, FIFO errors; requests of I2S, SPI4 and SDIO; requests of timers, except updates.
 */
#include "fcu.h"

#include "generated/registers_dma.h"

#define FIRST_STREAM SxCR(0)
#define STREAM_SIZE (SxCR(1) - SxCR(0))
enum { CR, NDTR, PAR, M0AR, M1AR, FCR }; /* registers of a stream */
_Static_assert(SxFCR(0) == FIRST_STREAM + 4 * FCR, "the words of a stream");

enum { PERIPHERAL_TO_MEMORY, MEMORY_TO_PERIPHERAL, MEMORY_TO_MEMORY };
#define CHANGEABLE_WHILE_ON (SxCR_EN | SxCR_DMEIE | SxCR_TEIE | SxCR_HTIE | SxCR_TCIE)
/* Masks at the position of stream 0. */
#define FLAGS (LISR_FEIF0 | LISR_DMEIF0 | LISR_TEIF0 | LISR_HTIF0 | LISR_TCIF0)
static const uint8_t FLAG_SHIFT[4] = {0, 6, 16, 22}; /* streams 0 to 3, 4 to 7 */

#define CYCLES_PER_ITEM 4

static const uint32_t BASES[DMA_CONTROLLERS] = {DMA1_BASE, DMA2_BASE};
static const uint8_t INTERRUPTS_OF[DMA_CONTROLLERS][DMA_STREAMS] = {
  {11, 12, 13, 14, 15, 16, 17, 47},
  {56, 57, 58, 59, 60, 68, 69, 70},
};

/* -- request lines --------------------------------------------------------------------------------------- */

#define R(name) REQUEST_##name
#define UNMODELLED REQUESTS /* the peripheral of the request is not modelled */
#define NONE REQUEST_NONE

/* By channel and stream. */
static const uint8_t LINES[DMA_CONTROLLERS][8][DMA_STREAMS] = {
  {
    {R(SPI3_RX), NONE, R(SPI3_RX), R(SPI2_RX), R(SPI2_TX), R(SPI3_TX), NONE, R(SPI3_TX)},
    {R(I2C1_RX), R(I2C3_RX), NONE, NONE, NONE, R(I2C1_RX), R(I2C1_TX), R(I2C1_TX)},
    {UNMODELLED, NONE, UNMODELLED, UNMODELLED, UNMODELLED, UNMODELLED, R(TIM4_UP), UNMODELLED},
    {UNMODELLED, R(TIM2_UP), R(I2C3_RX), UNMODELLED, R(I2C3_TX), UNMODELLED, UNMODELLED, R(TIM2_UP)},
    {NONE, NONE, NONE, NONE, NONE, R(USART2_RX), R(USART2_TX), NONE},
    {NONE, NONE, R(TIM3_UP), NONE, UNMODELLED, UNMODELLED, NONE, UNMODELLED},
    {R(TIM5_UP), UNMODELLED, UNMODELLED, UNMODELLED, UNMODELLED, R(I2C3_TX), R(TIM5_UP), NONE},
    {NONE, NONE, R(I2C2_RX), R(I2C2_RX), NONE, NONE, NONE, R(I2C2_TX)},
  },
  {
    {R(ADC1), NONE, NONE, NONE, R(ADC1), NONE, UNMODELLED, NONE},
    {NONE, NONE, NONE, NONE, NONE, NONE, NONE, NONE},
    {NONE, NONE, NONE, NONE, NONE, NONE, NONE, NONE},
    {R(SPI1_RX), NONE, R(SPI1_RX), R(SPI1_TX), NONE, R(SPI1_TX), NONE, NONE},
    {UNMODELLED, UNMODELLED, R(USART1_RX), UNMODELLED, NONE, R(USART1_RX), UNMODELLED, R(USART1_TX)},
    {NONE, R(USART6_RX), R(USART6_RX), UNMODELLED, UNMODELLED, NONE, R(USART6_TX), R(USART6_TX)},
    {UNMODELLED, UNMODELLED, UNMODELLED, UNMODELLED, UNMODELLED, R(TIM1_UP), UNMODELLED, NONE},
    {NONE, NONE, NONE, NONE, NONE, NONE, NONE, NONE},
  },
};

static int controller_of(const DmaController *dma) { return dma == &dma->peripheral.chip->dma.controllers[1]; }

static uint8_t number_of(const DmaController *dma, int n) {
  return (uint8_t)(DMA_STREAMS * controller_of(dma) + n + 1);
}

static void attach(DmaController *dma, int n, enum Request line) {
  Dma *both = &dma->peripheral.chip->dma;
  dma->streams[n].line = line;
  if (line == NONE || line == UNMODELLED) {
    return;
  }
  both->server[line] = number_of(dma, n);
  if (both->requester[line]) {
    both->requester[line]->type->dma_ready(both->requester[line]);
  }
}

static void detach(DmaController *dma, int n) {
  Dma *both = &dma->peripheral.chip->dma;
  enum Request line = dma->streams[n].line;
  if (line != NONE && line != UNMODELLED && both->server[line] == number_of(dma, n)) {
    both->server[line] = 0;
  }
}

void dma_connect(Peripheral *peripheral, enum Request line) { peripheral->chip->dma.requester[line] = peripheral; }

/* DMA reaches everything except the core's private peripherals (RM0368 2.1). */
static bool is_accessible(uint32_t address) { return address < PERIPHERALS_BASE + PERIPHERALS_SIZE; }

static bool load_item(Chip *chip, uint32_t address, unsigned size, uint32_t *value) {
  return is_accessible(address) && bus_load(chip, address, size, value);
}

static bool store_item(Chip *chip, uint32_t address, unsigned size, uint32_t value) {
  return is_accessible(address) && bus_store(chip, address, size, value);
}

/* -- transfers ------------------------------------------------------------------------------------------- */

static void update_interrupt(DmaController *dma, int n) {
  const DmaStream *stream = &dma->streams[n];
  uint32_t enabled = (stream->control & SxCR_TCIE ? LISR_TCIF0 : 0) | (stream->control & SxCR_HTIE ? LISR_HTIF0 : 0) |
                     (stream->control & SxCR_TEIE ? LISR_TEIF0 : 0);
  peripheral_set_irq(&dma->peripheral, INTERRUPTS_OF[controller_of(dma)][n], (stream->flags & enabled) != 0);
}

static void raise_flags(DmaController *dma, int n, uint32_t flags) {
  dma->streams[n].flags |= flags;
  update_interrupt(dma, n);
}

static void schedule_copy(DmaController *dma) {
  int64_t at_ps = NEVER_PS;
  for (int n = 0; n < DMA_STREAMS; n++) {
    at_ps = dma->streams[n].copy_ps < at_ps ? dma->streams[n].copy_ps : at_ps;
  }
  if (at_ps < NEVER_PS) {
    event_schedule(dma->peripheral.chip, dma->event, at_ps);
  } else {
    event_cancel(dma->peripheral.chip, dma->event);
  }
}

static void stop(DmaController *dma, int n) {
  DmaStream *stream = &dma->streams[n];
  stream->control &= ~SxCR_EN;
  detach(dma, n);
  if (stream->copy_ps < NEVER_PS) {
    stream->copy_ps = NEVER_PS;
    schedule_copy(dma);
  }
}

static void begin(DmaStream *stream) {
  static const uint8_t SIZES[] = {1, 2, 4, 4}; /* PSIZE */
  stream->length = stream->items;
  stream->moved = 0;
  stream->size = SIZES[FIELD(stream->control, SxCR_PSIZE)];
  stream->peripheral_step = stream->control & SxCR_PINC ? stream->size : 0;
  stream->memory_step = stream->control & SxCR_MINC ? stream->size : 0;
}

static void start(DmaController *dma, int n, enum Request line) {
  DmaStream *stream = &dma->streams[n];
  Chip *chip = dma->peripheral.chip;
  if (stream->items == 0) { /* completed: reload (9.5.6) */
    stream->items = stream->length;
  }
  if (stream->items == 0) { /* the stream does not start (9.3.14) */
    stream->control &= ~SxCR_EN;
    return;
  }
  begin(stream);
  if (FIELD(stream->control, SxCR_DIR) != MEMORY_TO_MEMORY) {
    attach(dma, n, line);
  } else if (chip->clocks.hclk_hz) {
    stream->copy_ps = chip->now_ps + (int64_t)stream->items * CYCLES_PER_ITEM * PS_PER_S / chip->clocks.hclk_hz;
    schedule_copy(dma);
  }
}

/* Return false on a bus error. */
static bool move_item(Chip *chip, DmaStream *stream) {
  uint32_t peripheral_address = stream->peripheral + stream->moved * stream->peripheral_step, value;
  uint32_t memory_address = stream->memory[stream->control & SxCR_CT ? 1 : 0] + stream->moved * stream->memory_step;
  bool to_peripheral = FIELD(stream->control, SxCR_DIR) == MEMORY_TO_PERIPHERAL;
  stream->moved++;
  return load_item(chip, to_peripheral ? memory_address : peripheral_address, stream->size, &value) &&
         store_item(chip, to_peripheral ? peripheral_address : memory_address, stream->size, value);
}

static void complete(DmaController *dma, int n) {
  DmaStream *stream = &dma->streams[n];
  if (stream->control & (SxCR_CIRC | SxCR_DBM)) {
    stream->items = stream->length;
    stream->moved = 0;
    stream->control ^= stream->control & SxCR_DBM ? SxCR_CT : 0;
  } else {
    stop(dma, n);
  }
  raise_flags(dma, n, LISR_TCIF0);
}

static void transfer(DmaController *dma, int n) {
  DmaStream *stream = &dma->streams[n];
  if (!move_item(dma->peripheral.chip, stream)) {
    stop(dma, n);
    raise_flags(dma, n, LISR_TEIF0);
    return;
  }
  stream->items--;
  if (stream->items == 0) {
    complete(dma, n);
  } else if (stream->items == stream->length / 2) {
    raise_flags(dma, n, LISR_HTIF0);
  }
}

static void copy_memory(DmaController *dma, int n) {
  DmaStream *stream = &dma->streams[n];
  bool good = true;
  while (good && stream->items) {
    good = move_item(dma->peripheral.chip, stream);
    stream->items -= good;
  }
  stop(dma, n);
  raise_flags(dma, n, good ? LISR_HTIF0 | LISR_TCIF0 : LISR_TEIF0);
}

static void on_event(Peripheral *peripheral) {
  DmaController *dma = (DmaController *)peripheral;
  for (int n = 0; n < DMA_STREAMS; n++) {
    if (dma->streams[n].copy_ps <= peripheral->chip->now_ps) {
      copy_memory(dma, n);
    }
  }
}

bool dma_request(Chip *chip, enum Request line) {
  int server = chip->dma.server[line] - 1;
  if (server >= 0) {
    transfer(&chip->dma.controllers[server / DMA_STREAMS], server % DMA_STREAMS);
  }
  return server >= 0;
}

uint32_t dma_remaining(const Chip *chip, enum Request line) {
  int server = chip->dma.server[line] - 1;
  return server >= 0 ? chip->dma.controllers[server / DMA_STREAMS].streams[server % DMA_STREAMS].items : 0;
}

/* -- registers ------------------------------------------------------------------------------------------- */

static uint32_t dma_peek(const Peripheral *peripheral, uint32_t offset) {
  const DmaController *dma = (const DmaController *)peripheral;
  uint32_t value = 0;
  if (offset >= FIRST_STREAM) {
    const DmaStream *stream = &dma->streams[(offset - FIRST_STREAM) / STREAM_SIZE];
    const uint32_t words[] = {stream->control,   stream->items,     stream->peripheral,
                              stream->memory[0], stream->memory[1], stream->fifo_control};
    return words[(offset - FIRST_STREAM) % STREAM_SIZE / 4];
  }
  for (int n = 0; offset <= HISR && n < 4; n++) {
    value |= dma->streams[offset + (uint32_t)n].flags << FLAG_SHIFT[n]; /* HISR is at offset 4 */
  }
  return value;
}

static void clear_flags(DmaController *dma, int first, uint32_t bits) {
  for (int n = 0; n < 4; n++) {
    dma->streams[first + n].flags &= ~(bits >> FLAG_SHIFT[n] & FLAGS);
    update_interrupt(dma, first + n);
  }
}

static void check(DmaController *dma, int n, uint32_t value, enum Request line) {
  bool to_memory = FIELD(value, SxCR_DIR) == MEMORY_TO_MEMORY;
  if (to_memory && controller_of(dma) == 0) {
    peripheral_note(&dma->peripheral, -1, NOTE_FORBIDDEN,
                    "memory-to-memory | memory to memory is for DMA2 only (RM0368 9.3.2)");
  }
  if (!to_memory && line == NONE) {
    peripheral_note(
        &dma->peripheral, -1, NOTE_FORBIDDEN,
        "no-request-line stream=%d channel=%u | stream %d channel %u is enabled, but no request line is there", n,
        FIELD(value, SxCR_CHSEL), n, FIELD(value, SxCR_CHSEL));
  }
}

static void control_written(DmaController *dma, int n, uint32_t value) {
  DmaStream *stream = &dma->streams[n];
  enum Request line = LINES[controller_of(dma)][FIELD(value, SxCR_CHSEL)][n];
  bool was_on = stream->control & SxCR_EN;
  uint32_t kept = was_on ? stream->control & ~CHANGEABLE_WHILE_ON : value & ~CHANGEABLE_WHILE_ON;
  if (value & SxCR_PFCTRL) {
    peripheral_note(&dma->peripheral, -1, NOTE_NOT_MODELLED, "peripheral-flow-control stream=%d | S%dCR.PFCTRL", n,
                    n);
  }
  if (was_on && (value ^ stream->control) & ~CHANGEABLE_WHILE_ON) {
    peripheral_note(&dma->peripheral, -1, NOTE_FORBIDDEN,
                    "written-while-enabled stream=%d | S%dCR reconfigured while the stream is enabled: no effect",
                    n, n);
  }
  stream->control = kept | (value & CHANGEABLE_WHILE_ON);
  if (value & SxCR_EN && !was_on) {
    check(dma, n, value, line);
    start(dma, n, line);
  } else if (was_on && !(value & SxCR_EN)) { /* the transfer ends with TCIF (9.3.15) */
    stop(dma, n);
    raise_flags(dma, n, LISR_TCIF0);
  }
  update_interrupt(dma, n);
}

static void write_stream(DmaController *dma, int n, uint32_t word, uint32_t value) {
  DmaStream *stream = &dma->streams[n];
  if (word == CR) {
    control_written(dma, n, value & SxCR_STORED);
  } else if (stream->control & SxCR_EN && (word == NDTR || word == PAR)) {
    peripheral_note(&dma->peripheral, -1, NOTE_FORBIDDEN,
                    "written-while-enabled stream=%d | S%d%s written while the stream is enabled: no effect", n, n,
                    word == NDTR ? "NDTR" : "PAR");
  } else if (word == NDTR) {
    stream->items = stream->length = value & 0xFFFF;
  } else if (word == PAR) {
    stream->peripheral = value;
  } else if (word == M0AR || word == M1AR) {
    stream->memory[word - M0AR] = value;
  } else {
    stream->fifo_control = (stream->fifo_control & SxFCR_FS) | (value & SxFCR_STORED);
  }
}

static void dma_write(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  DmaController *dma = (DmaController *)peripheral;
  if (offset >= FIRST_STREAM) {
    uint32_t merged = (dma_peek(peripheral, offset) & ~mask) | (value & mask), position = offset - FIRST_STREAM;
    write_stream(dma, (int)(position / STREAM_SIZE), position % STREAM_SIZE / 4, merged);
  } else if (offset >= LIFCR) {
    clear_flags(dma, offset == HIFCR ? 4 : 0, value & mask);
  }
}

static void dma_reset(Peripheral *peripheral) {
  DmaController *dma = (DmaController *)peripheral;
  for (int n = 0; n < DMA_STREAMS; n++) {
    stop(dma, n);
    dma->streams[n] = (DmaStream){.fifo_control = SxFCR_RESET, .copy_ps = NEVER_PS};
    update_interrupt(dma, n);
  }
}

static const PeripheralType DMA = {
  .read = peripheral_read_as_peek, .peek = dma_peek, .write = dma_write, .reset = dma_reset
};

void dma_create(Chip *chip) {
  for (int n = 0; n < DMA_CONTROLLERS; n++) {
    DmaController *dma = &chip->dma.controllers[n];
    peripheral_create(chip, &dma->peripheral, &DMA, BASES[n], DMA1_SIZE, DMA_OFFSETS);
    dma->event = event_create(&dma->peripheral, on_event);
    dma_reset(&dma->peripheral);
  }
}

int32_t fcu_dma_request(Chip *chip, int32_t line) { return dma_request(chip, (enum Request)line); }

uint32_t fcu_dma_remaining(const Chip *chip, int32_t line) { return dma_remaining(chip, (enum Request)line); }
