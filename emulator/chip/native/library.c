/* What the library is: which sources, and with which compiler they were built (building/library.py says both). */
#ifndef SOURCES
#define SOURCES ""
#endif
#ifndef COMPILER
#define COMPILER ""
#endif

/* Python finds it in the file without loading it (emulator/chip/native/__init__.py). Exported, or a linker might leave
 * it out. */
__attribute__((visibility("default"))) const char *library_built_from(void) {
  return "fcu library [" SOURCES "] built with [" COMPILER "] [" __VERSION__ "]";
}
