/* The chip as a whole: creation, snapshots, and services for peripherals. */
#include "fcu.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PYTHON_SOURCE 63

Chip *fcu_create(const Host *host) {
  Chip *chip = calloc(1, sizeof(Chip));
  if (!chip) {
    return NULL;
  }
  chip->host = *host;
  chip->host_next_ps = chip->next_ps = chip->due_ps = NEVER_PS;
  chip->work_limit = INT64_MAX;
  enum { HSI_HZ = 16000000 }; /* RM0368 6.2.2 */
  chip->clocks = (Clocks){HSI_HZ, HSI_HZ, HSI_HZ, HSI_HZ, HSI_HZ, HSI_HZ, HSI_HZ, 0, 0};
  memset(chip->alternate, -1, sizeof chip->alternate);
  memset(chip->flash, 0xFF, sizeof chip->flash);
  memset(chip->system_memory, 0xFF, sizeof chip->system_memory);
  for (int event = 0; event < EVENTS; event++) {
    chip->event_ps[event] = NEVER_PS;
  }
  if (!core_create(&chip->core, chip, chip->flash, chip->ram, chip->system_memory) || !gpio_allocate(chip)) {
    fcu_destroy(chip);
    return NULL;
  }
  nvic_reset(&chip->nvic);
#define CREATE(type, member, create) create(chip);
  EACH_PERIPHERAL(CREATE)
#undef CREATE
  sensor_registers_create(chip);
  run_loop_create(chip);
  idle_skip_create(chip);
  chip->poll_skip.enabled = 1;
  exceptions_reset(chip);
  poll_skip_reset(chip);
  return chip;
}

void fcu_destroy(Chip *chip) {
  gpio_destroy(chip);
  core_destroy(&chip->core);
  free(chip);
}

void fcu_configure(Chip *chip, int64_t cycles_num, int64_t cycles_den, int32_t skip) {
  cycle_clock_create(&chip->cycle_clock, cycles_num, cycles_den, chip->clocks.hclk_hz);
  chip->poll_skip.enabled = skip;
}

uint8_t *fcu_flash(Chip *chip) { return chip->flash; }

uint8_t *fcu_ram(Chip *chip) { return chip->ram; }

uint8_t *fcu_system_memory(Chip *chip) { return chip->system_memory; }

void fcu_status(const Chip *chip, Status *status) {
  const Nvic *nvic = &chip->nvic;
  const Core *core = &chip->core;
  *status = (Status){
      .now_ps = cycle_clock_ps(&chip->cycle_clock, 0),
      .retired = cycle_clock_retired(&chip->cycle_clock),
      .skipped = chip->poll_skip.skipped,
      .accesses = chip->poll_skip.accesses,
      .thread_ps = chip->exceptions.thread_ps,
      .switched_ps = chip->exceptions.switched_ps,
      .pending = {nvic->pending[0], nvic->pending[1]},
      .enabled = {nvic->enabled[0], nvic->enabled[1]},
      .active = {nvic->active[0], nvic->active[1]},
      .execution_priority = nvic_execution_priority(nvic, core->primask, core->basepri, core->faultmask),
      .lowest_msp = chip->exceptions.lowest_msp,
      .locked_up = chip->exceptions.locked_up,
      .locked_up_pc = chip->exceptions.locked_up_pc,
      .asleep = chip->run_loop.asleep,
      .thread_frame = chip->exceptions.thread_frame,
  };
}

static int64_t max_cost(const Cost *cost, int64_t most, enum CostKind kind, int index, Costliest *found) {
  if (cost->work <= most) {
    return most;
  }
  *found = (Costliest){.times = cost->times, .kind = (int32_t)kind, .index = index};
  return cost->work;
}

void fcu_costliest(const Chip *chip, Costliest *found) {
  const Costs *costs = &chip->costs;
  int64_t most = max_cost(&costs->instructions, -1, COST_INSTRUCTIONS, 0, found);
  most = max_cost(&costs->python_events, most, COST_PYTHON_EVENTS, 0, found);
  most = max_cost(&costs->resets, most, COST_RESETS, 0, found);
  for (int n = 0; n < PAGES; n++) {
    most = max_cost(&costs->accesses[n], most, COST_ACCESSES, n, found);
  }
  for (int n = 0; n < chip->peripheral_count; n++) {
    most = max_cost(&costs->events[n], most, COST_EVENTS, n, found);
  }
  for (int n = 0; n < EXCEPTIONS; n++) {
    most = max_cost(&costs->exceptions[n], most, COST_EXCEPTIONS, n, found);
  }
}

int64_t fcu_snapshot_size(void) { return sizeof(Chip); }

void fcu_save(const Chip *chip, void *snapshot) { memcpy(snapshot, chip, sizeof *chip); }

/* Decoded code and a debugger's settings are not part of a snapshot. */
void fcu_restore(Chip *chip, const void *snapshot) {
  const Chip *saved = snapshot;
  Core *core = &chip->core;
  uint32_t watches = core->watching, begin = core->watch_begin, end = core->watch_end;
  uint32_t code_in_ram = (core->slow_stores | saved->core.slow_stores) & STORES_CHANGE_CODE;
  uint8_t debugged = chip->run_loop.debug_enabled;
  ValueLog *value_log = core->value_log;
  int64_t edges = chip->gpio.edge_count;
  bool other_code = core->fpu_on != saved->core.fpu_on || code_in_ram ||
                    memcmp(chip->flash, saved->flash, sizeof chip->flash) != 0;
  memcpy(chip, saved, sizeof *chip);
  core->unresolved_link = NULL;
  core->slow_stores |= code_in_ram;
  chip->run_loop.debug_enabled = debugged;
  core->value_log = value_log;
  chip->gpio.edge_count = chip->gpio.edges_taken = edges; /* drop later edges */
  python_registers_invalidate(chip);
  if (other_code) {
    fcu_invalidate_code(chip);
  }
  fcu_watch_memory(chip, (int32_t)watches, begin, end);
}

void peripheral_create(Chip *chip, Peripheral *peripheral, const PeripheralType *type, uint32_t base, uint32_t size,
                  const int16_t *offsets) {
  *peripheral = (Peripheral){.type = type, .chip = chip, .base = base, .size = size, .clocked = 1};
  peripheral->index = chip->peripheral_count;
  chip->peripherals[chip->peripheral_count++] = peripheral;
  for (; *offsets >= 0; offsets++) {
    peripheral->implemented[*offsets >> 7] |= 1u << (*offsets >> 2 & 31);
  }
  for (uint32_t at = 0; at < size && base - PERIPHERALS_BASE < PERIPHERALS_SIZE; at += 0x400) {
    chip->pages[(base - PERIPHERALS_BASE + at) >> 10] = peripheral;
  }
}

void peripheral_set_all_registers(Peripheral *peripheral) {
  memset(peripheral->implemented, 0xFF, sizeof peripheral->implemented);
}

/* Report ignored accesses once per register and reason. */
static void report_ignored(Peripheral *peripheral, uint32_t offset, enum IgnoredAccess what, uint32_t value) {
  uint32_t address = peripheral->base + offset;
  static const enum IgnoreReason kinds[] = {
      [READ_UNCLOCKED] = READ_WITHOUT_CLOCK,
      [WRITE_UNCLOCKED] = WRITE_WITHOUT_CLOCK,
      [READ_UNKNOWN] = NO_REGISTER,
      [WRITE_UNKNOWN] = NO_REGISTER,
  };
  enum IgnoreReason kind = kinds[what];
  Chip *chip = peripheral->chip;
  if (python_registers_is_ignored(chip, address, kind) ||
      (what == WRITE_UNCLOCKED && python_registers_is_harmless(chip, address, value))) {
    return;
  }
  if (chip->host.ignored_access(chip->now_ps, peripheral->index, offset, what, value)) {
    python_registers_ignore(chip, address, kind);
  } else {
    python_registers_set_harmless(chip, address, value);
  }
}

uint32_t peripheral_read_as_peek(Peripheral *peripheral, uint32_t offset, int64_t *until_ps) {
  (void)until_ps;
  return peripheral->type->peek(peripheral, offset);
}

uint32_t peripheral_read(Peripheral *peripheral, uint32_t offset, unsigned size, int64_t *until_ps) {
  uint32_t word = offset & ~3u;
  *until_ps = NEVER_PS;
  if (!peripheral->clocked) {
    report_ignored(peripheral, word, READ_UNCLOCKED, 0);
    return 0;
  }
  if (!peripheral_has_register(peripheral, peripheral->base + word)) {
    report_ignored(peripheral, word, READ_UNKNOWN, 0);
    *until_ps = NOT_CACHEABLE_PS;
    return 0;
  }
  return peripheral->type->read(peripheral, word, until_ps) >> 8 * (offset & 3) & size_mask(size);
}

void peripheral_write(Peripheral *peripheral, uint32_t offset, unsigned size, uint32_t value) {
  uint32_t word = offset & ~3u, shift = 8 * (offset & 3), mask = size_mask(size) << shift;
  if (!peripheral->clocked) {
    report_ignored(peripheral, word, WRITE_UNCLOCKED, value << shift & mask);
  } else if (!peripheral_has_register(peripheral, peripheral->base + word)) {
    report_ignored(peripheral, word, WRITE_UNKNOWN, value << shift & mask);
  } else {
    peripheral->type->write(peripheral, word, value << shift & mask, mask);
  }
}

void peripheral_note(Peripheral *peripheral, int id, enum NoteKind kind, const char *format, ...) {
  if (id >= 0 && peripheral->noted >> id & 1) {
    return;
  }
  if (id >= 0) {
    peripheral->noted |= 1u << id;
  }
  char text[320];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  peripheral->chip->host.note(peripheral->chip->now_ps, peripheral->index, kind, text);
}

int32_t fcu_peripheral_count(const Chip *chip) { return chip->peripheral_count; }

uint32_t fcu_peripheral_base(const Chip *chip, int32_t index) { return chip->peripherals[index]->base; }

int32_t fcu_peripheral_at(const Chip *chip, uint32_t address) {
  const Peripheral *peripheral = chip_peripheral_at(chip, address);
  return peripheral ? peripheral->index : -1;
}

static void gate(Peripheral *peripheral, bool clocked) {
  bool changed = peripheral->clocked != clocked;
  peripheral->clocked = clocked;
  if (changed && peripheral->type->gated) {
    peripheral->type->gated(peripheral);
  }
}

void fcu_gate(Chip *chip, uint64_t peripherals, uint64_t clocked) {
  for (int n = 0; peripherals; n++, peripherals >>= 1) {
    if (peripherals & 1) {
      gate(chip->peripherals[n], clocked >> n & 1);
    }
  }
}

int32_t fcu_is_clocked(const Chip *chip, int32_t index) { return chip->peripherals[index]->clocked; }

void fcu_gate_python(Chip *chip, uint32_t address, int32_t clocked) {
  chip->python_registers.unclocked[page_of(address)] = !clocked;
  python_registers_invalidate(chip);
}

void fcu_reset_peripherals(Chip *chip, uint64_t peripherals) {
  for (int n = 0; peripherals; n++, peripherals >>= 1) {
    if (peripherals & 1) {
      chip->peripherals[n]->type->reset(chip->peripherals[n]);
    }
  }
}

uint32_t fcu_read_peripheral(Chip *chip, int32_t index, uint32_t offset) {
  chip_settle(chip);
  chip->until_ps = NEVER_PS;
  return chip->peripherals[index]->type->read(chip->peripherals[index], offset, &chip->until_ps);
}

uint32_t fcu_peek_peripheral(Chip *chip, int32_t index, uint32_t offset) {
  return chip->peripherals[index]->type->peek(chip->peripherals[index], offset);
}

int32_t fcu_is_pure(Chip *chip, int32_t index, uint32_t offset) {
  const Peripheral *peripheral = chip->peripherals[index];
  return !peripheral->type->is_pure || peripheral->type->is_pure(peripheral, offset);
}

void fcu_write_peripheral(Chip *chip, int32_t index, uint32_t offset, uint32_t value, uint32_t mask) {
  chip_settle(chip);
  chip->peripherals[index]->type->write(chip->peripherals[index], offset, value & mask, mask);
}

/* -- events ---------------------------------------------------------------------------------------------- */

int event_create(Peripheral *peripheral, Fire fire) {
  Chip *chip = peripheral->chip;
  chip->event_fire[chip->event_count] = fire;
  chip->event_peripheral[chip->event_count] = peripheral;
  return chip->event_count++;
}

static void update_next_event(Chip *chip) {
  int64_t next_ps = NEVER_PS, due_ps = NEVER_PS;
  for (uint64_t left = chip->scheduled; left; left &= left - 1) {
    int event = __builtin_ctzll(left);
    int64_t at_ps = chip->event_ps[event];
    due_ps = at_ps < due_ps ? at_ps : due_ps;
    next_ps = at_ps < next_ps && !(chip->deferred >> event & 1) ? at_ps : next_ps;
  }
  chip->next_ps = next_ps;
  chip->due_ps = due_ps;
}

static void schedule(Chip *chip, int event, int64_t at_ps, bool deferred) {
  int64_t before_ps = chip->event_ps[event];
  at_ps = at_ps > chip->now_ps ? at_ps : chip->now_ps;
  chip->event_ps[event] = at_ps;
  chip->event_order[event] = chip->order++;
  chip->scheduled |= UINT64_C(1) << event;
  chip->deferred = (chip->deferred & ~(UINT64_C(1) << event)) | (uint64_t)deferred << event;
  if (before_ps <= chip->next_ps || before_ps <= chip->due_ps) {
    update_next_event(chip);
    run_loop_update_limit(chip);
    return;
  }
  chip->due_ps = at_ps < chip->due_ps ? at_ps : chip->due_ps;
  if (!deferred && at_ps < chip->next_ps) {
    chip->next_ps = at_ps;
    run_loop_update_limit(chip);
  }
}

void event_schedule(Chip *chip, int event, int64_t at_ps) { schedule(chip, event, at_ps, false); }

void event_defer(Chip *chip, int event, int64_t at_ps) { schedule(chip, event, at_ps, true); }

void event_cancel(Chip *chip, int event) {
  if (chip->event_ps[event] < NEVER_PS) {
    chip->event_ps[event] = NEVER_PS;
    chip->scheduled &= ~(UINT64_C(1) << event);
    update_next_event(chip);
  }
}

int64_t event_at(const Chip *chip, int event) { return chip->event_ps[event]; }

static void fire_earliest(Chip *chip) {
  int earliest = -1;
  for (uint64_t left = chip->scheduled; left; left &= left - 1) {
    int event = __builtin_ctzll(left);
    bool is_due = chip->event_ps[event] == chip->due_ps;
    if (is_due && (earliest < 0 || chip->event_order[event] < chip->event_order[earliest])) {
      earliest = event;
    }
  }
  int64_t before = chip->work;
  poll_skip_invalidate(&chip->poll_skip);
  Cost *cost = &chip->costs.events[chip->event_peripheral[earliest]->index];
  chip->now_ps = chip->due_ps;
  chip->event_ps[earliest] = NEVER_PS;
  chip->scheduled &= ~(UINT64_C(1) << earliest);
  update_next_event(chip);
  chip->event_fire[earliest](chip->event_peripheral[earliest]);
  chip->work += WORK_EVENT;
  cost->times++;
  cost->work += chip->work - before;
}

static void advance_python(Chip *chip) {
  int64_t before = chip->work;
  chip->now_ps = chip->host_next_ps;
  python_registers_invalidate(chip);
  chip->host.advance(chip->now_ps);
  chip->costs.python_events.times++;
  chip->costs.python_events.work += chip->work - before;
}

void chip_advance(Chip *chip, int64_t to_ps) {
  for (;;) {
    if (chip->due_ps <= to_ps && chip->due_ps <= chip->host_next_ps) {
      fire_earliest(chip);
    } else if (chip->host_next_ps <= to_ps && !chip->must_stop) {
      advance_python(chip);
    } else {
      break;
    }
  }
  if (to_ps > chip->now_ps) {
    chip->now_ps = to_ps;
  }
}

void chip_settle(Chip *chip) {
  if (chip->due_ps <= chip->now_ps || chip->host_next_ps <= chip->now_ps) {
    int64_t now_ps = chip->now_ps;
    chip_advance(chip, now_ps);
    chip->now_ps = now_ps;
  }
}

void fcu_advance(Chip *chip, int64_t to_ps) {
  python_registers_invalidate(chip);
  chip_advance(chip, to_ps);
}

void fcu_settle(Chip *chip) {
  python_registers_invalidate(chip);
  chip_settle(chip);
}

int64_t fcu_next_event(const Chip *chip) { return chip->next_ps; }

int64_t gcd(int64_t a, int64_t b) {
  while (b) {
    int64_t rest = a % b;
    a = b;
    b = rest;
  }
  return a;
}

void fcu_set_clocks(Chip *chip, const Clocks *clocks) {
  bool low_speed_only = !memcmp(&chip->clocks, clocks, offsetof(Clocks, lsi_hz)) &&
                        (chip->clocks.lsi_hz != clocks->lsi_hz || chip->clocks.lse_hz != clocks->lse_hz);
  chip->clocks = *clocks;
  timers_oscillators_changed(chip);
  if (low_speed_only) { /* HCLK has not changed, so the core's time must not be rounded */
    return;
  }
  run_loop_hclk_changed(chip);
  for (int n = 0; n < chip->peripheral_count; n++) {
    if (chip->peripherals[n]->type->clocks_changed) {
      chip->peripherals[n]->type->clocks_changed(chip->peripherals[n]);
    }
  }
}

static void set_irq(Chip *chip, int source, int number, bool level) {
  uint64_t before = chip->irq_sources[number], bit = UINT64_C(1) << source;
  uint64_t after = level ? before | bit : before & ~bit;
  chip->irq_sources[number] = after;
  if (!before == !after) {
    return;
  }
  nvic_set_line(&chip->nvic, FIRST_INTERRUPT + number, after != 0);
  run_loop_update_limit(chip);
  if (chip->irq_changed) {
    chip->irq_changed(chip->now_ps, number, after != 0);
  }
}

void peripheral_change_irq(Peripheral *peripheral, int number, bool level) {
  set_irq(peripheral->chip, peripheral->index, number, level);
}

void fcu_set_irq(Chip *chip, int32_t number, int32_t level) { set_irq(chip, PYTHON_SOURCE, number, level != 0); }

int32_t fcu_irq_level(const Chip *chip, int32_t number) { return chip->irq_sources[number] != 0; }

void fcu_watch_irqs(Chip *chip, void (*changed)(int64_t now_ps, int32_t number, int32_t level)) {
  chip->irq_changed = changed;
}

int port_index(char port) { return port == 'H' ? 5 : port - 'A'; }

bool pins_connected(const Chip *chip, const PinFunction *pins, char *missing, size_t size) {
  size_t length = 0;
  missing[0] = 0;
  for (; pins->function != 255; pins++) {
    if (chip->alternate[port_index(pins->port)][pins->pin] != pins->function && length < size) {
      length += (size_t)snprintf(missing + length, size - length, "%sP%c%d to AF%d", length ? ", " : "",
                                 pins->port, pins->pin, pins->function);
    }
  }
  return length == 0;
}

void fcu_set_alternate(Chip *chip, int32_t port, int32_t pin, int32_t function) {
  chip->alternate[port][pin] = (int8_t)function;
}
