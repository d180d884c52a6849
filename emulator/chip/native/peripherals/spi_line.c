/* The devices at the pins of an SPI: sensors at chip selects, which are GPIO pins; an absent module; none.
 *
 * A message contains the bytes between two edges of a chip select. A byte goes to the sensors that are selected when
 * it ends. A chip select that rises earlier cuts the byte off, and the sensor never receives it. The sensors pull
 * their chip selects up (LSM6DSL datasheet 2, LIS2MDL 2, LPS22HB 2), so an unconfigured pin selects no sensor. With
 * two chip selects low, both sensors receive every byte and drive the line against each other. The host then reads
 * the AND of both, and a note reports it.
 *
 * The sensors are in Python. A message that reads is answered from the read cache (read_cache.h). Python takes over,
 * byte by byte, if the bytes are not cached, if the host writes registers, or for sequences that no driver uses.
 */
#include "peripherals/spi.h"

#include <stdio.h>
#include <string.h>

#include "chip.h"
#include "fcu.h"

/* -- messages ------------------------------------------------------------------------------------------- */

static Target *target_of(Spi *spi, const SpiPart *part) {
  return &spi->peripheral.chip->read_cache.target[part->target];
}

static void end_reading(Spi *spi, SpiPart *part) {
  if (part->is_reading) {
    part->is_reading = false;
    target_end(spi->peripheral.chip, target_of(spi, part));
  }
}

/* Pass the rest of the message to Python. */
static void go_live(Spi *spi, SpiPart *part) {
  if (!part->is_live) {
    part->is_live = true;
    part->is_powered = spi->line.calls.open(spi->peripheral.chip->now_ps, &part->message) != 0;
  }
}

static void write_part(Spi *spi, SpiPart *part, uint8_t byte) {
  if (!part->is_live && part->message.command == SPI_NOTHING && !part->message.count) {
    part->message.command = byte;
    return;
  }
  end_reading(spi, part);
  go_live(spi, part);
  spi->line.calls.send(spi->peripheral.chip->now_ps, part->message.part, byte);
}

/* Read the next byte from the read cache; false: Python must be asked. */
static bool read_kept(Spi *spi, SpiPart *part, uint8_t *byte) {
  Chip *chip = spi->peripheral.chip;
  SpiMessage *message = &part->message;
  bool answers = message->command != SPI_NOTHING && message->command & SPI_READ;
  if (part->is_live || part->target < 0 || !answers) {
    return false;
  }
  if (!part->is_reading) {
    part->is_reading = target_begin(chip, target_of(spi, part), message->command & 0x7F, 0);
  } else if (message->count == SPI_RECEIVED) {
    end_reading(spi, part);
  }
  if (part->is_reading) {
    part->is_reading = target_read(chip, target_of(spi, part), byte);
  }
  return part->is_reading;
}

static uint8_t read_part(Spi *spi, SpiPart *part) {
  uint8_t byte;
  if (read_kept(spi, part, &byte)) {
    part->message.received[part->message.count++] = byte;
    return byte;
  }
  go_live(spi, part);
  return (uint8_t)spi->line.calls.receive(spi->peripheral.chip->now_ps, part->message.part, spi->line.wires);
}

/* -- chip selects --------------------------------------------------------------------------------------- */

static void tell_clash(Spi *spi) {
  char names[32] = "";
  for (int n = 0; n < spi->line.selected_count; n++) {
    const SpiPart *part = &spi->line.parts[spi->line.selected[n]];
    size_t length = strlen(names);
    snprintf(names + length, sizeof names - length, "%sP%c%d", n ? " and " : "", "ABCDEH"[part->port], part->pin);
  }
  peripheral_note(&spi->peripheral, -1, NOTE_FORBIDDEN,
             "chip selects %s are low at once: the parts drive the line against each other", names);
}

static void select_part(Spi *spi, SpiPart *part) {
  SpiLine *line = &spi->line;
  part->is_selected = true;
  part->is_live = part->is_reading = false;
  part->message.start_ps = spi->peripheral.chip->now_ps;
  part->message.command = SPI_NOTHING;
  part->message.count = 0;
  line->selected[line->selected_count++] = (uint8_t)part->message.part;
  if (!part->is_powered) {
    go_live(spi, part);
  }
  if (line->selected_count > 1) {
    tell_clash(spi);
  }
}

static void remember(Spi *spi, SpiPart *part) {
  SpiLine *line = &spi->line;
  if (part->message.command == SPI_NOTHING && !part->message.count) {
    return;
  }
  part->message.end_ps = spi->peripheral.chip->now_ps;
  SpiMessage *kept = &line->recent[line->recent_count++ % SPI_RECENT];
  memcpy(kept, &part->message, offsetof(SpiMessage, received) + (size_t)part->message.count);
  if (spi->peripheral.chip->detailed) {
    line->calls.ended(spi->peripheral.chip->now_ps);
  }
}

static void deselect_part(Spi *spi, SpiPart *part) {
  SpiLine *line = &spi->line;
  part->is_selected = false;
  int left = 0;
  for (int n = 0; n < line->selected_count; n++) {
    if (line->selected[n] != part->message.part) {
      line->selected[left++] = line->selected[n];
    }
  }
  line->selected_count = left;
  if (part->is_live) {
    line->calls.close(spi->peripheral.chip->now_ps, part->message.part);
  } else {
    end_reading(spi, part);
    remember(spi, part);
  }
}

static void chip_select_changed(Peripheral *peripheral, int pin, bool level) {
  Spi *spi = (Spi *)peripheral;
  (void)level; /* another port may have a pin of this number */
  for (int n = 0; n < spi->line.part_count; n++) {
    SpiPart *part = &spi->line.parts[n];
    bool is_high = peripheral->chip->gpio.ports[part->port].reads >> part->pin & 1;
    if (part->pin == pin && part->is_selected == is_high) {
      (is_high ? deselect_part : select_part)(spi, part);
    }
  }
}

/* -- bytes ---------------------------------------------------------------------------------------------- */

/* The conditions of cached bytes change: discard them all. A message in progress continues live. */
static void forget(Spi *spi) {
  for (int n = 0; n < spi->line.part_count; n++) {
    SpiPart *part = &spi->line.parts[n];
    if (part->is_reading) {
      end_reading(spi, part);
      go_live(spi, part);
    }
    if (part->target >= 0) {
      target_forget(spi->peripheral.chip, target_of(spi, part));
    }
  }
}

static void configure(Spi *spi) {
  SpiLine *line = &spi->line;
  line->calls.configure(spi->peripheral.chip->now_ps, line->speed_hz, line->mode, line->wires);
}

void spi_line_configure(Spi *spi, int32_t speed_hz, int32_t mode) {
  if (spi->line.is_wired) {
    forget(spi);
    spi->line.speed_hz = speed_hz;
    spi->line.mode = mode;
    configure(spi);
  }
}

static void listen_on(Spi *spi, uint8_t wires) {
  if (spi->line.wires != wires) {
    forget(spi);
    spi->line.wires = wires;
    configure(spi);
  }
}

static void hear_nobody(Spi *spi, int32_t byte) {
  SpiLine *line = &spi->line;
  if (line->selected_count == 0 && line->is_wired) {
    line->unheard[line->unheard_count++ % SPI_RECENT] = (SpiUnheard){spi->peripheral.chip->now_ps, byte};
  }
}

static void try_absent(Spi *spi) {
  SpiLine *line = &spi->line;
  void (*tried)(int64_t) = line->try_absent;
  if (tried && pin_level(spi->peripheral.chip, line->absent_port, line->absent_pin) == 0) {
    line->try_absent = NULL;
    tried(spi->peripheral.chip->now_ps);
  }
}

uint8_t spi_line_exchange(Spi *spi, uint8_t out) {
  uint8_t answer = SPI_UNDRIVEN;
  hear_nobody(spi, out);
  try_absent(spi);
  for (int n = 0; n < spi->line.selected_count; n++) {
    SpiPart *part = &spi->line.parts[spi->line.selected[n]];
    if (part->message.command != SPI_NOTHING && part->message.command & SPI_READ) {
      listen_on(spi, 4);
      answer &= read_part(spi, part);
    } else {
      write_part(spi, part, out);
    }
  }
  return answer;
}

void spi_line_send(Spi *spi, uint8_t out) {
  hear_nobody(spi, out);
  try_absent(spi);
  for (int n = 0; n < spi->line.selected_count; n++) {
    write_part(spi, &spi->line.parts[spi->line.selected[n]], out);
  }
}

uint8_t spi_line_receive(Spi *spi) {
  uint8_t answer = SPI_UNDRIVEN;
  hear_nobody(spi, SPI_NOTHING);
  for (int n = 0; n < spi->line.selected_count; n++) {
    listen_on(spi, 3);
    answer &= read_part(spi, &spi->line.parts[spi->line.selected[n]]);
  }
  return answer;
}

void spi_line_create(SpiLine *line) { line->wires = 3; }

/* -- for Python ----------------------------------------------------------------------------------------- */

void fcu_connect_spi(Chip *chip, int32_t spi, const SpiCalls *calls) {
  chip->spi[spi].line.calls = *calls;
  chip->spi[spi].line.is_wired = true;
}

void fcu_add_spi_part(Chip *chip, int32_t spi, int32_t port, int32_t pin, int32_t target) {
  SpiLine *line = &chip->spi[spi].line;
  SpiPart *part = &line->parts[line->part_count];
  part->message.part = line->part_count++;
  part->port = port;
  part->pin = pin;
  part->target = target;
  pin_listen(&chip->spi[spi].peripheral, "ABCDEH"[port], pin, chip_select_changed);
}

void fcu_absent_spi(Chip *chip, int32_t spi, int32_t port, int32_t pin, void (*tried)(int64_t now_ps)) {
  SpiLine *line = &chip->spi[spi].line;
  line->absent_port = port;
  line->absent_pin = pin;
  line->try_absent = tried;
}

int32_t fcu_take_spi_message(Chip *chip, int32_t spi, SpiMessage *message) {
  SpiLine *line = &chip->spi[spi].line;
  if (line->recent_count - line->recent_taken > SPI_RECENT) {
    line->recent_taken = line->recent_count - SPI_RECENT;
  }
  if (line->recent_taken == line->recent_count) {
    return false;
  }
  *message = line->recent[line->recent_taken++ % SPI_RECENT];
  return true;
}

int32_t fcu_take_spi_unheard(Chip *chip, int32_t spi, SpiUnheard *unheard) {
  SpiLine *line = &chip->spi[spi].line;
  if (line->unheard_count - line->unheard_taken > SPI_RECENT) {
    line->unheard_taken = line->unheard_count - SPI_RECENT;
  }
  if (line->unheard_taken == line->unheard_count) {
    return false;
  }
  *unheard = line->unheard[line->unheard_taken++ % SPI_RECENT];
  return true;
}
