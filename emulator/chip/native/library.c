/* The library's identification: its sources and the compiler that built it (both set by building/library.py). */
#ifndef SOURCES
#define SOURCES ""
#endif
#ifndef COMPILER
#define COMPILER ""
#endif

/* Python finds this string in the file without loading it (emulator/chip/native/__init__.py). It is exported,
 * because a linker might remove it otherwise. */
__attribute__((visibility("default"))) const char *library_built_from(void) {
  return "fcu library [" SOURCES "] built with [" COMPILER "] [" __VERSION__ "]";
}
