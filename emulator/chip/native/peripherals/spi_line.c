/* Devices at the pins of an SPI: sensors with a chip select each (GPIO pins), and a module that is not fitted.
 *
 * A message is the bytes between two edges of a chip select. A byte goes to the sensors that are selected when the
 * byte ends. The sensors pull their chip selects up (LSM6DSL, LIS2MDL, LPS22HB datasheets, 2). Two selected sensors
 * drive the line against each other: the host reads the AND of their bits. A note reports the first such byte.
 *
 * C reads the sensor's registers (sensor_registers.h). Python takes over if a register is read live, if registers are
 * written, or if the bytes have an order that drivers do not use.
 */
#include "peripherals/spi.h"

#include <stdio.h>
#include <string.h>

#include "chip.h"
#include "fcu.h"

static Target *target_of(Spi *spi, const SpiSensor *sensor) {
  return &spi->peripheral.chip->sensor_registers.target[sensor->target];
}

static void hand_to_python(Spi *spi, SpiSensor *sensor) {
  if (!sensor->is_live) {
    sensor->is_live = true;
    sensor->is_powered = spi->line.calls.open(spi->peripheral.chip->now_ps, &sensor->message) != 0;
  }
}

static void write_sensor(Spi *spi, SpiSensor *sensor, uint8_t byte) {
  if (sensor->message.command == SPI_NOTHING && !sensor->message.count) {
    sensor->message.command = byte;
    if (!sensor->is_live) {
      return;
    }
  }
  sensor->is_reading = false;
  hand_to_python(spi, sensor);
  spi->line.calls.send(spi->peripheral.chip->now_ps, sensor->message.sensor, byte);
}

/* Return false if Python must handle the byte. */
static bool read_register(Spi *spi, SpiSensor *sensor, uint8_t *byte) {
  Chip *chip = spi->peripheral.chip;
  SpiMessage *message = &sensor->message;
  bool answers = message->command != SPI_NOTHING && message->command & SPI_READ;
  if (sensor->is_live || sensor->target < 0 || !answers) {
    return false;
  }
  if (!sensor->is_reading) {
    target_set_position(chip, target_of(spi, sensor), message->command & 0x7F);
  }
  sensor->is_reading = message->count < SPI_RECEIVED && target_read(chip, target_of(spi, sensor), byte);
  return sensor->is_reading;
}

static uint8_t read_sensor(Spi *spi, SpiSensor *sensor) {
  uint8_t byte;
  if (read_register(spi, sensor, &byte)) {
    sensor->message.received[sensor->message.count++] = byte;
    return byte;
  }
  hand_to_python(spi, sensor);
  return (uint8_t)spi->line.calls.receive(spi->peripheral.chip->now_ps, sensor->message.sensor, spi->line.wires);
}

/* Several selected sensors do not conflict while the clock is stopped, for example while firmware sets its
 * pins up. */
static void check_conflict(Spi *spi) {
  char names[32] = "";
  if (spi->line.selected_count < 2 || spi->line.conflict_noted) {
    return;
  }
  spi->line.conflict_noted = true;
  for (int n = 0; n < spi->line.selected_count; n++) {
    const SpiSensor *sensor = &spi->line.sensors[spi->line.selected[n]];
    size_t length = strlen(names);
    snprintf(names + length, sizeof names - length, "%sP%c%d", n ? " and " : "", "ABCDEH"[sensor->port], sensor->pin);
  }
  peripheral_note(
      &spi->peripheral, -1, NOTE_FORBIDDEN,
      "chip-selects-conflict | chip selects %s are low at once: the sensors drive the line against each other",
      names);
}

static void select_sensor(Spi *spi, SpiSensor *sensor) {
  SpiLine *line = &spi->line;
  sensor->is_selected = true;
  sensor->is_live = sensor->is_reading = false;
  sensor->message.start_ps = spi->peripheral.chip->now_ps;
  sensor->message.command = SPI_NOTHING;
  sensor->message.count = 0;
  line->selected[line->selected_count++] = (uint8_t)sensor->message.sensor;
  if (!sensor->is_powered) {
    hand_to_python(spi, sensor);
  }
  line->conflict_noted = false;
}

static void record_message(Spi *spi, SpiSensor *sensor) {
  SpiLine *line = &spi->line;
  if (sensor->message.command == SPI_NOTHING && !sensor->message.count) {
    return;
  }
  sensor->message.end_ps = spi->peripheral.chip->now_ps;
  SpiMessage *kept = &line->recent[line->recent_count++ % SPI_RECENT];
  memcpy(kept, &sensor->message, offsetof(SpiMessage, received) + (size_t)sensor->message.count);
  if (spi->peripheral.chip->detailed) {
    line->calls.ended(spi->peripheral.chip->now_ps);
  }
}

static void deselect_sensor(Spi *spi, SpiSensor *sensor) {
  SpiLine *line = &spi->line;
  sensor->is_selected = false;
  int left = 0;
  for (int n = 0; n < line->selected_count; n++) {
    if (line->selected[n] != sensor->message.sensor) {
      line->selected[left++] = line->selected[n];
    }
  }
  line->selected_count = left;
  if (sensor->is_live) {
    line->calls.close(spi->peripheral.chip->now_ps, sensor->message.sensor);
  } else {
    record_message(spi, sensor);
  }
}

static void chip_select_changed(Peripheral *peripheral, int pin, bool level) {
  Spi *spi = (Spi *)peripheral;
  /* not used: the call does not name the port, and chip selects on two ports may have the same pin number */
  (void)level;
  for (int n = 0; n < spi->line.sensor_count; n++) {
    SpiSensor *sensor = &spi->line.sensors[n];
    bool is_high = peripheral->chip->gpio.ports[sensor->port].input >> sensor->pin & 1;
    if (sensor->pin == pin && sensor->is_selected == is_high) {
      (is_high ? deselect_sensor : select_sensor)(spi, sensor);
    }
  }
}

/* Python continues a message in progress. */
static void invalidate_targets(Spi *spi) {
  for (int n = 0; n < spi->line.sensor_count; n++) {
    SpiSensor *sensor = &spi->line.sensors[n];
    if (sensor->is_reading) {
      sensor->is_reading = false;
      hand_to_python(spi, sensor);
    }
    if (sensor->target >= 0) {
      target_invalidate(target_of(spi, sensor));
    }
  }
}

static void configure(Spi *spi) {
  SpiLine *line = &spi->line;
  line->calls.configure(spi->peripheral.chip->now_ps, line->speed_hz, line->mode, line->wires);
}

void spi_line_configure(Spi *spi, int32_t speed_hz, int32_t mode) {
  if (spi->line.has_devices) {
    invalidate_targets(spi);
    spi->line.speed_hz = speed_hz;
    spi->line.mode = mode;
    configure(spi);
  }
}

static void set_wires(Spi *spi, uint8_t wires) {
  if (spi->line.wires != wires) {
    invalidate_targets(spi);
    spi->line.wires = wires;
    configure(spi);
  }
}

static void record_unaddressed(Spi *spi, int32_t byte) {
  SpiLine *line = &spi->line;
  if (line->selected_count == 0 && line->has_devices) {
    line->unaddressed[line->unaddressed_count++ % SPI_RECENT] = (SpiUnaddressed){spi->peripheral.chip->now_ps, byte};
  }
}

static void check_absent(Spi *spi) {
  SpiLine *line = &spi->line;
  void (*on_access)(int64_t) = line->on_absent_access;
  if (on_access && pin_level(spi->peripheral.chip, line->absent_port, line->absent_pin) == 0) {
    line->on_absent_access = NULL;
    on_access(spi->peripheral.chip->now_ps);
  }
}

uint8_t spi_line_exchange(Spi *spi, uint8_t out) {
  uint8_t answer = SPI_UNDRIVEN;
  check_conflict(spi);
  record_unaddressed(spi, out);
  check_absent(spi);
  for (int n = 0; n < spi->line.selected_count; n++) {
    SpiSensor *sensor = &spi->line.sensors[spi->line.selected[n]];
    if (sensor->message.command != SPI_NOTHING && sensor->message.command & SPI_READ) {
      set_wires(spi, 4);
      answer &= read_sensor(spi, sensor);
    } else {
      write_sensor(spi, sensor, out);
    }
  }
  return answer;
}

void spi_line_send(Spi *spi, uint8_t out) {
  check_conflict(spi);
  record_unaddressed(spi, out);
  check_absent(spi);
  for (int n = 0; n < spi->line.selected_count; n++) {
    write_sensor(spi, &spi->line.sensors[spi->line.selected[n]], out);
  }
}

uint8_t spi_line_receive(Spi *spi) {
  uint8_t answer = SPI_UNDRIVEN;
  check_conflict(spi);
  record_unaddressed(spi, SPI_NOTHING);
  for (int n = 0; n < spi->line.selected_count; n++) {
    set_wires(spi, 3);
    answer &= read_sensor(spi, &spi->line.sensors[spi->line.selected[n]]);
  }
  return answer;
}

void spi_line_create(SpiLine *line) { line->wires = 3; }

void fcu_connect_spi(Chip *chip, int32_t spi, const SpiCalls *calls) {
  chip->spi[spi].line.calls = *calls;
  chip->spi[spi].line.has_devices = true;
}

void fcu_add_spi_sensor(Chip *chip, int32_t spi, int32_t port, int32_t pin, int32_t target) {
  SpiLine *line = &chip->spi[spi].line;
  SpiSensor *sensor = &line->sensors[line->sensor_count];
  sensor->message.sensor = line->sensor_count++;
  sensor->port = port;
  sensor->pin = pin;
  sensor->target = target;
  pin_listen(&chip->spi[spi].peripheral, "ABCDEH"[port], pin, chip_select_changed);
}

void fcu_add_absent_spi_device(Chip *chip, int32_t spi, int32_t port, int32_t pin, void (*on_access)(int64_t now_ps)) {
  SpiLine *line = &chip->spi[spi].line;
  line->absent_port = port;
  line->absent_pin = pin;
  line->on_absent_access = on_access;
}

/* Return the ring index of the oldest record that Python has not read; -1: none. */
static int take_oldest(uint32_t count, uint32_t *taken) {
  *taken = count - *taken > SPI_RECENT ? count - SPI_RECENT : *taken;
  return *taken == count ? -1 : (int)((*taken)++ % SPI_RECENT);
}

int32_t fcu_take_spi_message(Chip *chip, int32_t spi, SpiMessage *message) {
  SpiLine *line = &chip->spi[spi].line;
  int index = take_oldest(line->recent_count, &line->recent_taken);
  if (index >= 0) {
    *message = line->recent[index];
  }
  return index >= 0;
}

int32_t fcu_take_spi_unaddressed(Chip *chip, int32_t spi, SpiUnaddressed *unaddressed) {
  SpiLine *line = &chip->spi[spi].line;
  int index = take_oldest(line->unaddressed_count, &line->unaddressed_taken);
  if (index >= 0) {
    *unaddressed = line->unaddressed[index];
  }
  return index >= 0;
}

int64_t fcu_spi_next_change(const Chip *chip, int32_t index) {
  return event_at(chip, ((const Spi *)chip->peripherals[index])->event);
}

int64_t fcu_spi_active_ps(const Chip *chip, int32_t index) {
  return ((const Spi *)chip->peripherals[index])->active_ps;
}
