/* The fast path of loads and stores. The fast path handles RAM and constants in flash, without checks.
 *
 * If the fast path fails, the operation's slow path calls sync_state() (dispatch.h), then core_read() or
 * core_write(), which handle all cases.
 */
#ifndef FCU_ACCESS_H
#define FCU_ACCESS_H

#include "cpu/dispatch.h"

/* If the slow path is needed, do nothing and return false. The final three bytes of a memory always need
 * the slow path. */
#define DEFINE_FAST_ACCESS(bits, type)                                                   \
  INLINE bool load##bits(const Core *core, uint32_t address, uint32_t *value) {          \
    type data;                                                                           \
    if (LIKELY(address - RAM_BASE < core->ram_load_limit)) {                             \
      __builtin_memcpy(&data, core->ram + (address - RAM_BASE), sizeof data);            \
    } else if (address - FLASH_BASE < core->flash_load_limit) {                          \
      __builtin_memcpy(&data, core->flash + (address - FLASH_BASE), sizeof data);    \
    } else {                                                                             \
      return false;                                                                      \
    }                                                                                    \
    *value = data;                                                                       \
    return true;                                                                         \
  }                                                                                      \
  INLINE bool store##bits(Core *core, uint32_t address, uint32_t value) {                \
    uint32_t offset = address - RAM_BASE;                                                \
    type data = (type)value;                                                             \
    if (UNLIKELY(offset >= core->ram_store_limit)) {                                     \
      return false;                                                                      \
    }                                                                                    \
    __builtin_memcpy(core->ram + offset, &data, sizeof data);                            \
    return true;                                                                         \
  }                                                                                      \
  static inline bool load##bits##_slow(Core *core, uint32_t address, uint32_t *value) {  \
    return core_read(core, address, sizeof(type), value);                                \
  }                                                                                      \
  static inline bool store##bits##_slow(Core *core, uint32_t address, uint32_t value) {  \
    return core_write(core, address, sizeof(type), value);                               \
  }
DEFINE_FAST_ACCESS(8, uint8_t)
DEFINE_FAST_ACCESS(16, uint16_t)
DEFINE_FAST_ACCESS(32, uint32_t)

/* Transfers of several words must be aligned. */
INLINE bool is_aligned(const Core *core, uint32_t address) {
  (void)core;
  return LIKELY(!(address & 3));
}
static inline bool is_aligned_slow(Core *core, uint32_t address) { return core_is_aligned(core, address); }

/* Define an operation that calls access(core, insn, address), and its slow path, which calls
 * access_slow(). `afterwards` runs only after success, because a fault must leave the base register
 * unchanged. */
#define DEFINE_ACCESS(name, access, to, afterwards)  \
  SLOW_OPERATION(name##_slow) {                      \
    uint32_t address = to;                           \
    sync_state(core, insn, budget);                  \
    if (access##_slow(core, insn, address)) {        \
      afterwards;                                    \
      resume_chain(core, insn);                      \
    }                                                \
  }                                                  \
  OPERATION(name) {                                  \
    uint32_t address = to;                           \
    if (UNLIKELY(!access(core, insn, address))) {    \
      TAIL name##_slow(core, insn, budget);          \
    }                                                \
    afterwards;                                      \
    NEXT;                                            \
  }

#endif
