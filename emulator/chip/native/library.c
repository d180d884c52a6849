/* Identification of the library: digest of its sources, and compiler (building/library.py sets both). */
#ifndef SOURCES
#define SOURCES ""
#endif
#ifndef COMPILER
#define COMPILER ""
#endif

/* emulator/chip/native/__init__.py finds this string in the file. The function is exported, because a
 * linker might remove it otherwise. */
__attribute__((visibility("default"))) const char *library_built_from(void) {
  return "fcu library [" SOURCES "] built with [" COMPILER "] [" __VERSION__ "]";
}
