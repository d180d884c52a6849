/* Work whose results every Cortex-M4F must agree in, at every level of optimisation.
 *
 * A kernel computes from pseudo-random numbers and adds what comes out to a checksum. C's undefined behaviour
 * and results that a compiler may choose (a NaN's payload, the order of evaluation) are kept out of it; where
 * the instruction matters and not the language, it is written in assembly.
 */
#ifndef KERNEL_H
#define KERNEL_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
  const char *name;
  void (*run)(void);
} Kernel;

/* Each file's kernels, up to one without a name. */
extern const Kernel dsp_kernels[], multiply_kernels[], saturation_kernels[], vfp_kernels[], convert_kernels[],
    double_kernels[], integer_kernels[], format_kernels[], sort_kernels[], hash_kernels[], memory_kernels[],
    transfer_kernels[], control_kernels[], condition_kernels[], exception_kernels[];

/* Into the checksum of the kernel that runs. */
void add(uint32_t word);
void add64(uint64_t value);
void add_bytes(const void *bytes, size_t size);

/* The next pseudo-random number; each kernel begins with the same. */
uint32_t any(void);
uint64_t any64(void);
/* Often what is special to some instruction: 0, ends of the ranges, small numbers, single bits. */
uint32_t word(void);

#define LENGTH(array) (sizeof(array) / sizeof(*(array)))

#endif
