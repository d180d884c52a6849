/* Loads and stores on the usual way: RAM and constants in flash, without anybody to be asked or told.
 *
 * An operation tries that first. Where it fails, the operation's other half takes its place: it looks outside
 * (dispatch.h) and uses core_read() and core_write(), which can do everything.
 */
#ifndef FCU_ACCESS_H
#define FCU_ACCESS_H

#include "cpu/dispatch.h"

/* False: nothing has happened. The last three bytes of a memory are left to the other half, whatever the size. */
#define DEFINE_PLAIN(bits, type)                                                                         \
  INLINE bool load##bits(const Core *core, uint32_t address, uint32_t *value) {                          \
    type data;                                                                                           \
    if (LIKELY(address - RAM_BASE < core->plain_loads)) {                                                \
      __builtin_memcpy(&data, core->ram + (address - RAM_BASE), sizeof data);                            \
    } else if (address - FLASH_BASE < core->plain_constants) {                                           \
      __builtin_memcpy(&data, core->constants + (address - FLASH_BASE), sizeof data);                    \
    } else {                                                                                             \
      return false;                                                                                      \
    }                                                                                                    \
    *value = data;                                                                                       \
    return true;                                                                                         \
  }                                                                                                      \
  INLINE bool store##bits(Core *core, uint32_t address, uint32_t value) {                                \
    uint32_t offset = address - RAM_BASE;                                                                \
    type data = (type)value;                                                                             \
    if (UNLIKELY(offset >= core->plain_stores)) {                                                        \
      return false;                                                                                      \
    }                                                                                                    \
    __builtin_memcpy(core->ram + offset, &data, sizeof data);                                            \
    return true;                                                                                         \
  }                                                                                                      \
  static inline bool load##bits##_outside(Core *core, uint32_t address, uint32_t *value) {               \
    return core_read(core, address, sizeof(type), value);                                                \
  }                                                                                                      \
  static inline bool store##bits##_outside(Core *core, uint32_t address, uint32_t value) {               \
    return core_write(core, address, sizeof(type), value);                                               \
  }
DEFINE_PLAIN(8, uint8_t)
DEFINE_PLAIN(16, uint16_t)
DEFINE_PLAIN(32, uint32_t)

/* Several words at once: where they are aligned, as they have to be. */
INLINE bool is_aligned(const Core *core, uint32_t address) {
  (void)core;
  return LIKELY(!(address & 3));
}
static inline bool is_aligned_outside(Core *core, uint32_t address) { return core_is_aligned(core, address); }

/* Both halves of an operation that accesses memory: access(core, insn, address) and access_outside() likewise,
 * at an address and with something to be done only after an access that was made: a fault leaves the base
 * register as it was. */
#define DEFINE_ACCESS(name, access, to, afterwards)                                                      \
  RARE_OPERATION(name##_outside) {                                                                       \
    uint32_t address = to;                                                                               \
    look_outside(core, insn, budget);                                                                    \
    if (access##_outside(core, insn, address)) {                                                         \
      afterwards;                                                                                        \
      go_on(core, insn);                                                                                 \
    }                                                                                                    \
  }                                                                                                      \
  OPERATION(name) {                                                                                      \
    uint32_t address = to;                                                                               \
    if (UNLIKELY(!access(core, insn, address))) {                                                        \
      TAIL name##_outside(core, insn, budget);                                                           \
    }                                                                                                    \
    afterwards;                                                                                          \
    NEXT;                                                                                                \
  }

#endif
