/* Written by tests/support/arm/call_programs.py. */
#include "types.h"

struct { bool a0; uint16_t a1; double a2; } seen0;
CALLED double f0(bool a0, uint16_t a1, double a2) {
  seen0.a0 = a0;
  seen0.a1 = a1;
  seen0.a2 = a2;
  return a2;
}

struct { int8_t a0; Pair a1; Pair a2; } seen1;
CALLED int8_t f1(int8_t a0, Pair a1, Pair a2) {
  seen1.a0 = a0;
  seen1.a1 = a1;
  seen1.a2 = a2;
  return a0;
}

struct { int32_t a0; double a1; } seen2;
CALLED double f2(int32_t a0, double a1) {
  seen2.a0 = a0;
  seen2.a1 = a1;
  return a1;
}

struct { Pair a0; int64_t a1; int64_t a2; double a3; double a4; double a5; Pair a6; int16_t a7; } seen3;
CALLED int16_t f3(Pair a0, int64_t a1, int64_t a2, double a3, double a4, double a5, Pair a6, int16_t a7) {
  seen3.a0 = a0;
  seen3.a1 = a1;
  seen3.a2 = a2;
  seen3.a3 = a3;
  seen3.a4 = a4;
  seen3.a5 = a5;
  seen3.a6 = a6;
  seen3.a7 = a7;
  return a7;
}

struct { int16_t a0; int64_t a1; Halves a2; uint64_t a3; uint8_t a4; int64_t a5; uint16_t a6; } seen4;
CALLED int16_t f4(int16_t a0, int64_t a1, Halves a2, uint64_t a3, uint8_t a4, int64_t a5, uint16_t a6) {
  seen4.a0 = a0;
  seen4.a1 = a1;
  seen4.a2 = a2;
  seen4.a3 = a3;
  seen4.a4 = a4;
  seen4.a5 = a5;
  seen4.a6 = a6;
  return a0;
}

struct { bool a0; float a1; float a2; bool a3; } seen5;
CALLED float f5(bool a0, float a1, float a2, bool a3) {
  seen5.a0 = a0;
  seen5.a1 = a1;
  seen5.a2 = a2;
  seen5.a3 = a3;
  return a1;
}

struct { int8_t a0; bool a1; } seen6;
CALLED int8_t f6(int8_t a0, bool a1) {
  seen6.a0 = a0;
  seen6.a1 = a1;
  return a0;
}

struct { Halves a0; uint64_t a1; uint8_t a2; int8_t a3; } seen7;
CALLED uint8_t f7(Halves a0, uint64_t a1, uint8_t a2, int8_t a3) {
  seen7.a0 = a0;
  seen7.a1 = a1;
  seen7.a2 = a2;
  seen7.a3 = a3;
  return a2;
}

struct { int32_t a0; double a1; Triple a2; int32_t a3; bool a4; } seen8;
CALLED bool f8(int32_t a0, double a1, Triple a2, int32_t a3, bool a4) {
  seen8.a0 = a0;
  seen8.a1 = a1;
  seen8.a2 = a2;
  seen8.a3 = a3;
  seen8.a4 = a4;
  return a4;
}

struct { uint32_t a0; uint32_t a1; Bytes a2; uint16_t a3; int32_t a4; Halves a5; Pair a6; } seen9;
CALLED Bytes f9(uint32_t a0, uint32_t a1, Bytes a2, uint16_t a3, int32_t a4, Halves a5, Pair a6) {
  seen9.a0 = a0;
  seen9.a1 = a1;
  seen9.a2 = a2;
  seen9.a3 = a3;
  seen9.a4 = a4;
  seen9.a5 = a5;
  seen9.a6 = a6;
  return a2;
}

struct { uint16_t a0; uint8_t a1; Four a2; int64_t a3; } seen10;
CALLED int64_t f10(uint16_t a0, uint8_t a1, Four a2, int64_t a3) {
  seen10.a0 = a0;
  seen10.a1 = a1;
  seen10.a2 = a2;
  seen10.a3 = a3;
  return a3;
}

struct { uint32_t a0; int16_t a1; uint16_t a2; } seen11;
CALLED int16_t f11(uint32_t a0, int16_t a1, uint16_t a2) {
  seen11.a0 = a0;
  seen11.a1 = a1;
  seen11.a2 = a2;
  return a1;
}

struct { double a0; } seen12;
CALLED double f12(double a0) {
  seen12.a0 = a0;
  return a0;
}

struct { Four a0; uint8_t a1; uint32_t a2; uint16_t a3; Triple a4; Five a5; double a6; int8_t a7; } seen13;
CALLED uint8_t f13(Four a0, uint8_t a1, uint32_t a2, uint16_t a3, Triple a4, Five a5, double a6, int8_t a7) {
  seen13.a0 = a0;
  seen13.a1 = a1;
  seen13.a2 = a2;
  seen13.a3 = a3;
  seen13.a4 = a4;
  seen13.a5 = a5;
  seen13.a6 = a6;
  seen13.a7 = a7;
  return a1;
}

struct { int16_t a0; double a1; } seen14;
CALLED double f14(int16_t a0, double a1) {
  seen14.a0 = a0;
  seen14.a1 = a1;
  return a1;
}

struct { float a0; uint8_t a1; } seen15;
CALLED float f15(float a0, uint8_t a1) {
  seen15.a0 = a0;
  seen15.a1 = a1;
  return a0;
}

struct { uint64_t a0; Four a1; Four a2; int8_t a3; } seen16;
CALLED Four f16(uint64_t a0, Four a1, Four a2, int8_t a3) {
  seen16.a0 = a0;
  seen16.a1 = a1;
  seen16.a2 = a2;
  seen16.a3 = a3;
  return a1;
}

struct { Four a0; } seen17;
CALLED Four f17(Four a0) {
  seen17.a0 = a0;
  return a0;
}

struct { int32_t a0; Pair a1; bool a2; uint16_t a3; Bytes a4; } seen18;
CALLED int32_t f18(int32_t a0, Pair a1, bool a2, uint16_t a3, Bytes a4) {
  seen18.a0 = a0;
  seen18.a1 = a1;
  seen18.a2 = a2;
  seen18.a3 = a3;
  seen18.a4 = a4;
  return a0;
}

struct { uint64_t a0; int64_t a1; uint64_t a2; uint16_t a3; } seen19;
CALLED uint64_t f19(uint64_t a0, int64_t a1, uint64_t a2, uint16_t a3) {
  seen19.a0 = a0;
  seen19.a1 = a1;
  seen19.a2 = a2;
  seen19.a3 = a3;
  return a2;
}

struct { Five a0; Bytes a1; int32_t a2; } seen20;
CALLED int32_t f20(Five a0, Bytes a1, int32_t a2) {
  seen20.a0 = a0;
  seen20.a1 = a1;
  seen20.a2 = a2;
  return a2;
}

struct { Triple a0; Mixed a1; } seen21;
CALLED Triple f21(Triple a0, Mixed a1) {
  seen21.a0 = a0;
  seen21.a1 = a1;
  return a0;
}

struct { int64_t a0; float a1; Bytes a2; } seen22;
CALLED int64_t f22(int64_t a0, float a1, Bytes a2) {
  seen22.a0 = a0;
  seen22.a1 = a1;
  seen22.a2 = a2;
  return a0;
}

struct { int64_t a0; Axes a1; float a2; int32_t a3; uint16_t a4; } seen23;
CALLED int64_t f23(int64_t a0, Axes a1, float a2, int32_t a3, uint16_t a4) {
  seen23.a0 = a0;
  seen23.a1 = a1;
  seen23.a2 = a2;
  seen23.a3 = a3;
  seen23.a4 = a4;
  return a0;
}

struct { uint8_t a0; Bytes a1; Axes a2; float a3; Bytes a4; } seen24;
CALLED float f24(uint8_t a0, Bytes a1, Axes a2, float a3, Bytes a4) {
  seen24.a0 = a0;
  seen24.a1 = a1;
  seen24.a2 = a2;
  seen24.a3 = a3;
  seen24.a4 = a4;
  return a3;
}

struct { int16_t a0; Halves a1; } seen25;
CALLED Halves f25(int16_t a0, Halves a1) {
  seen25.a0 = a0;
  seen25.a1 = a1;
  return a1;
}

struct { int8_t a0; Four a1; int16_t a2; Five a3; } seen26;
CALLED int16_t f26(int8_t a0, Four a1, int16_t a2, Five a3) {
  seen26.a0 = a0;
  seen26.a1 = a1;
  seen26.a2 = a2;
  seen26.a3 = a3;
  return a2;
}

struct { uint32_t a0; } seen27;
CALLED uint32_t f27(uint32_t a0) {
  seen27.a0 = a0;
  return a0;
}

struct { uint16_t a0; int8_t a1; uint8_t a2; int64_t a3; int64_t a4; } seen28;
CALLED int64_t f28(uint16_t a0, int8_t a1, uint8_t a2, int64_t a3, int64_t a4) {
  seen28.a0 = a0;
  seen28.a1 = a1;
  seen28.a2 = a2;
  seen28.a3 = a3;
  seen28.a4 = a4;
  return a4;
}

struct { int16_t a0; Halves a1; Axes a2; float a3; Triple a4; uint8_t a5; int32_t a6; } seen29;
CALLED Triple f29(int16_t a0, Halves a1, Axes a2, float a3, Triple a4, uint8_t a5, int32_t a6) {
  seen29.a0 = a0;
  seen29.a1 = a1;
  seen29.a2 = a2;
  seen29.a3 = a3;
  seen29.a4 = a4;
  seen29.a5 = a5;
  seen29.a6 = a6;
  return a4;
}

struct { Five a0; Bytes a1; Bytes a2; bool a3; int8_t a4; Triple a5; int16_t a6; } seen30;
CALLED int8_t f30(Five a0, Bytes a1, Bytes a2, bool a3, int8_t a4, Triple a5, int16_t a6) {
  seen30.a0 = a0;
  seen30.a1 = a1;
  seen30.a2 = a2;
  seen30.a3 = a3;
  seen30.a4 = a4;
  seen30.a5 = a5;
  seen30.a6 = a6;
  return a4;
}

struct { double a0; uint64_t a1; int64_t a2; float a3; Triple a4; double a5; Bytes a6; int64_t a7; } seen31;
CALLED double f31(double a0, uint64_t a1, int64_t a2, float a3, Triple a4, double a5, Bytes a6, int64_t a7) {
  seen31.a0 = a0;
  seen31.a1 = a1;
  seen31.a2 = a2;
  seen31.a3 = a3;
  seen31.a4 = a4;
  seen31.a5 = a5;
  seen31.a6 = a6;
  seen31.a7 = a7;
  return a0;
}

struct { int32_t a0; int16_t a1; Axes a2; int8_t a3; uint16_t a4; Mixed a5; } seen32;
CALLED int16_t f32(int32_t a0, int16_t a1, Axes a2, int8_t a3, uint16_t a4, Mixed a5) {
  seen32.a0 = a0;
  seen32.a1 = a1;
  seen32.a2 = a2;
  seen32.a3 = a3;
  seen32.a4 = a4;
  seen32.a5 = a5;
  return a1;
}

struct { int32_t a0; float a1; int8_t a2; int32_t a3; Axes a4; Axes a5; Four a6; int32_t a7; int8_t a8; } seen33;
CALLED int32_t f33(int32_t a0, float a1, int8_t a2, int32_t a3, Axes a4, Axes a5, Four a6, int32_t a7, int8_t a8) {
  seen33.a0 = a0;
  seen33.a1 = a1;
  seen33.a2 = a2;
  seen33.a3 = a3;
  seen33.a4 = a4;
  seen33.a5 = a5;
  seen33.a6 = a6;
  seen33.a7 = a7;
  seen33.a8 = a8;
  return a3;
}

struct { Four a0; Triple a1; uint64_t a2; Bytes a3; Bytes a4; Five a5; float a6; } seen34;
CALLED Bytes f34(Four a0, Triple a1, uint64_t a2, Bytes a3, Bytes a4, Five a5, float a6) {
  seen34.a0 = a0;
  seen34.a1 = a1;
  seen34.a2 = a2;
  seen34.a3 = a3;
  seen34.a4 = a4;
  seen34.a5 = a5;
  seen34.a6 = a6;
  return a4;
}

struct { int16_t a0; Mixed a1; bool a2; Axes a3; int32_t a4; } seen35;
CALLED Axes f35(int16_t a0, Mixed a1, bool a2, Axes a3, int32_t a4) {
  seen35.a0 = a0;
  seen35.a1 = a1;
  seen35.a2 = a2;
  seen35.a3 = a3;
  seen35.a4 = a4;
  return a3;
}

struct { Mixed a0; int32_t a1; Axes a2; double a3; } seen36;
CALLED int32_t f36(Mixed a0, int32_t a1, Axes a2, double a3) {
  seen36.a0 = a0;
  seen36.a1 = a1;
  seen36.a2 = a2;
  seen36.a3 = a3;
  return a1;
}

struct { uint16_t a0; bool a1; uint8_t a2; Four a3; int64_t a4; Axes a5; Bytes a6; int64_t a7; Five a8; } seen37;
CALLED Five f37(uint16_t a0, bool a1, uint8_t a2, Four a3, int64_t a4, Axes a5, Bytes a6, int64_t a7, Five a8) {
  seen37.a0 = a0;
  seen37.a1 = a1;
  seen37.a2 = a2;
  seen37.a3 = a3;
  seen37.a4 = a4;
  seen37.a5 = a5;
  seen37.a6 = a6;
  seen37.a7 = a7;
  seen37.a8 = a8;
  return a8;
}

struct { Mixed a0; uint32_t a1; int32_t a2; int32_t a3; bool a4; } seen38;
CALLED Mixed f38(Mixed a0, uint32_t a1, int32_t a2, int32_t a3, bool a4) {
  seen38.a0 = a0;
  seen38.a1 = a1;
  seen38.a2 = a2;
  seen38.a3 = a3;
  seen38.a4 = a4;
  return a0;
}

struct { uint32_t a0; double a1; } seen39;
CALLED double f39(uint32_t a0, double a1) {
  seen39.a0 = a0;
  seen39.a1 = a1;
  return a1;
}

struct { double a0; int16_t a1; int32_t a2; bool a3; } seen40;
CALLED int32_t f40(double a0, int16_t a1, int32_t a2, bool a3) {
  seen40.a0 = a0;
  seen40.a1 = a1;
  seen40.a2 = a2;
  seen40.a3 = a3;
  return a2;
}

struct { int32_t a0; float a1; } seen41;
CALLED int32_t f41(int32_t a0, float a1) {
  seen41.a0 = a0;
  seen41.a1 = a1;
  return a0;
}

struct { uint8_t a0; Four a1; uint8_t a2; Mixed a3; Mixed a4; Bytes a5; Four a6; uint16_t a7; } seen42;
CALLED uint8_t f42(uint8_t a0, Four a1, uint8_t a2, Mixed a3, Mixed a4, Bytes a5, Four a6, uint16_t a7) {
  seen42.a0 = a0;
  seen42.a1 = a1;
  seen42.a2 = a2;
  seen42.a3 = a3;
  seen42.a4 = a4;
  seen42.a5 = a5;
  seen42.a6 = a6;
  seen42.a7 = a7;
  return a2;
}

struct { Four a0; Five a1; Pair a2; uint32_t a3; Triple a4; } seen43;
CALLED uint32_t f43(Four a0, Five a1, Pair a2, uint32_t a3, Triple a4) {
  seen43.a0 = a0;
  seen43.a1 = a1;
  seen43.a2 = a2;
  seen43.a3 = a3;
  seen43.a4 = a4;
  return a3;
}

struct { Mixed a0; int32_t a1; uint32_t a2; int64_t a3; int64_t a4; float a5; uint16_t a6; int64_t a7; Triple a8; } seen44;
CALLED uint16_t f44(Mixed a0, int32_t a1, uint32_t a2, int64_t a3, int64_t a4, float a5, uint16_t a6, int64_t a7, Triple a8) {
  seen44.a0 = a0;
  seen44.a1 = a1;
  seen44.a2 = a2;
  seen44.a3 = a3;
  seen44.a4 = a4;
  seen44.a5 = a5;
  seen44.a6 = a6;
  seen44.a7 = a7;
  seen44.a8 = a8;
  return a6;
}

struct { int16_t a0; float a1; Five a2; uint16_t a3; int64_t a4; int64_t a5; float a6; int64_t a7; } seen45;
CALLED int64_t f45(int16_t a0, float a1, Five a2, uint16_t a3, int64_t a4, int64_t a5, float a6, int64_t a7) {
  seen45.a0 = a0;
  seen45.a1 = a1;
  seen45.a2 = a2;
  seen45.a3 = a3;
  seen45.a4 = a4;
  seen45.a5 = a5;
  seen45.a6 = a6;
  seen45.a7 = a7;
  return a4;
}

struct { Mixed a0; uint16_t a1; Axes a2; Four a3; uint64_t a4; uint32_t a5; Five a6; } seen46;
CALLED uint64_t f46(Mixed a0, uint16_t a1, Axes a2, Four a3, uint64_t a4, uint32_t a5, Five a6) {
  seen46.a0 = a0;
  seen46.a1 = a1;
  seen46.a2 = a2;
  seen46.a3 = a3;
  seen46.a4 = a4;
  seen46.a5 = a5;
  seen46.a6 = a6;
  return a4;
}

struct { float a0; int32_t a1; int8_t a2; double a3; Bytes a4; int32_t a5; } seen47;
CALLED int8_t f47(float a0, int32_t a1, int8_t a2, double a3, Bytes a4, int32_t a5) {
  seen47.a0 = a0;
  seen47.a1 = a1;
  seen47.a2 = a2;
  seen47.a3 = a3;
  seen47.a4 = a4;
  seen47.a5 = a5;
  return a2;
}

struct { int32_t a0; Four a1; int16_t a2; uint32_t a3; Four a4; Four a5; uint8_t a6; uint16_t a7; bool a8; } seen48;
CALLED uint8_t f48(int32_t a0, Four a1, int16_t a2, uint32_t a3, Four a4, Four a5, uint8_t a6, uint16_t a7, bool a8) {
  seen48.a0 = a0;
  seen48.a1 = a1;
  seen48.a2 = a2;
  seen48.a3 = a3;
  seen48.a4 = a4;
  seen48.a5 = a5;
  seen48.a6 = a6;
  seen48.a7 = a7;
  seen48.a8 = a8;
  return a6;
}

struct { Five a0; int64_t a1; } seen49;
CALLED int64_t f49(Five a0, int64_t a1) {
  seen49.a0 = a0;
  seen49.a1 = a1;
  return a1;
}

struct { Pair a0; uint8_t a1; uint32_t a2; uint32_t a3; uint16_t a4; Mixed a5; Halves a6; float a7; } seen50;
CALLED uint32_t f50(Pair a0, uint8_t a1, uint32_t a2, uint32_t a3, uint16_t a4, Mixed a5, Halves a6, float a7) {
  seen50.a0 = a0;
  seen50.a1 = a1;
  seen50.a2 = a2;
  seen50.a3 = a3;
  seen50.a4 = a4;
  seen50.a5 = a5;
  seen50.a6 = a6;
  seen50.a7 = a7;
  return a2;
}

struct { bool a0; uint64_t a1; uint16_t a2; uint16_t a3; } seen51;
CALLED uint16_t f51(bool a0, uint64_t a1, uint16_t a2, uint16_t a3) {
  seen51.a0 = a0;
  seen51.a1 = a1;
  seen51.a2 = a2;
  seen51.a3 = a3;
  return a3;
}

struct { double a0; uint64_t a1; Five a2; uint32_t a3; Four a4; uint8_t a5; Triple a6; } seen52;
CALLED double f52(double a0, uint64_t a1, Five a2, uint32_t a3, Four a4, uint8_t a5, Triple a6) {
  seen52.a0 = a0;
  seen52.a1 = a1;
  seen52.a2 = a2;
  seen52.a3 = a3;
  seen52.a4 = a4;
  seen52.a5 = a5;
  seen52.a6 = a6;
  return a0;
}

struct { int8_t a0; float a1; int8_t a2; bool a3; Axes a4; bool a5; float a6; Five a7; Bytes a8; } seen53;
CALLED float f53(int8_t a0, float a1, int8_t a2, bool a3, Axes a4, bool a5, float a6, Five a7, Bytes a8) {
  seen53.a0 = a0;
  seen53.a1 = a1;
  seen53.a2 = a2;
  seen53.a3 = a3;
  seen53.a4 = a4;
  seen53.a5 = a5;
  seen53.a6 = a6;
  seen53.a7 = a7;
  seen53.a8 = a8;
  return a1;
}

struct { int8_t a0; uint8_t a1; Halves a2; uint32_t a3; uint32_t a4; uint64_t a5; } seen54;
CALLED uint64_t f54(int8_t a0, uint8_t a1, Halves a2, uint32_t a3, uint32_t a4, uint64_t a5) {
  seen54.a0 = a0;
  seen54.a1 = a1;
  seen54.a2 = a2;
  seen54.a3 = a3;
  seen54.a4 = a4;
  seen54.a5 = a5;
  return a5;
}

struct { Triple a0; Pair a1; } seen55;
CALLED Triple f55(Triple a0, Pair a1) {
  seen55.a0 = a0;
  seen55.a1 = a1;
  return a0;
}

struct { int64_t a0; } seen56;
CALLED int64_t f56(int64_t a0) {
  seen56.a0 = a0;
  return a0;
}

struct { Five a0; Triple a1; int16_t a2; float a3; Triple a4; Four a5; float a6; double a7; uint16_t a8; } seen57;
CALLED double f57(Five a0, Triple a1, int16_t a2, float a3, Triple a4, Four a5, float a6, double a7, uint16_t a8) {
  seen57.a0 = a0;
  seen57.a1 = a1;
  seen57.a2 = a2;
  seen57.a3 = a3;
  seen57.a4 = a4;
  seen57.a5 = a5;
  seen57.a6 = a6;
  seen57.a7 = a7;
  seen57.a8 = a8;
  return a7;
}

struct { int32_t a0; uint16_t a1; uint8_t a2; Axes a3; } seen58;
CALLED uint16_t f58(int32_t a0, uint16_t a1, uint8_t a2, Axes a3) {
  seen58.a0 = a0;
  seen58.a1 = a1;
  seen58.a2 = a2;
  seen58.a3 = a3;
  return a1;
}

struct { uint32_t a0; uint64_t a1; float a2; int8_t a3; } seen59;
CALLED uint32_t f59(uint32_t a0, uint64_t a1, float a2, int8_t a3) {
  seen59.a0 = a0;
  seen59.a1 = a1;
  seen59.a2 = a2;
  seen59.a3 = a3;
  return a0;
}

struct { uint64_t a0; } seen60;
CALLED uint64_t f60(uint64_t a0) {
  seen60.a0 = a0;
  return a0;
}

struct { Bytes a0; bool a1; double a2; Five a3; int32_t a4; double a5; uint8_t a6; int8_t a7; int16_t a8; } seen61;
CALLED int16_t f61(Bytes a0, bool a1, double a2, Five a3, int32_t a4, double a5, uint8_t a6, int8_t a7, int16_t a8) {
  seen61.a0 = a0;
  seen61.a1 = a1;
  seen61.a2 = a2;
  seen61.a3 = a3;
  seen61.a4 = a4;
  seen61.a5 = a5;
  seen61.a6 = a6;
  seen61.a7 = a7;
  seen61.a8 = a8;
  return a8;
}

struct { Four a0; Mixed a1; uint32_t a2; int32_t a3; int64_t a4; Five a5; Axes a6; int32_t a7; int32_t a8; } seen62;
CALLED int64_t f62(Four a0, Mixed a1, uint32_t a2, int32_t a3, int64_t a4, Five a5, Axes a6, int32_t a7, int32_t a8) {
  seen62.a0 = a0;
  seen62.a1 = a1;
  seen62.a2 = a2;
  seen62.a3 = a3;
  seen62.a4 = a4;
  seen62.a5 = a5;
  seen62.a6 = a6;
  seen62.a7 = a7;
  seen62.a8 = a8;
  return a4;
}

struct { uint32_t a0; Five a1; } seen63;
CALLED Five f63(uint32_t a0, Five a1) {
  seen63.a0 = a0;
  seen63.a1 = a1;
  return a1;
}

struct { int64_t a0; int16_t a1; uint16_t a2; int32_t a3; int8_t a4; int32_t a5; Four a6; Axes a7; } seen64;
CALLED int8_t f64(int64_t a0, int16_t a1, uint16_t a2, int32_t a3, int8_t a4, int32_t a5, Four a6, Axes a7) {
  seen64.a0 = a0;
  seen64.a1 = a1;
  seen64.a2 = a2;
  seen64.a3 = a3;
  seen64.a4 = a4;
  seen64.a5 = a5;
  seen64.a6 = a6;
  seen64.a7 = a7;
  return a4;
}

struct { int8_t a0; bool a1; int8_t a2; Triple a3; int8_t a4; double a5; } seen65;
CALLED int8_t f65(int8_t a0, bool a1, int8_t a2, Triple a3, int8_t a4, double a5) {
  seen65.a0 = a0;
  seen65.a1 = a1;
  seen65.a2 = a2;
  seen65.a3 = a3;
  seen65.a4 = a4;
  seen65.a5 = a5;
  return a2;
}

struct { Triple a0; float a1; uint8_t a2; int8_t a3; uint8_t a4; int16_t a5; int8_t a6; Four a7; } seen66;
CALLED uint8_t f66(Triple a0, float a1, uint8_t a2, int8_t a3, uint8_t a4, int16_t a5, int8_t a6, Four a7) {
  seen66.a0 = a0;
  seen66.a1 = a1;
  seen66.a2 = a2;
  seen66.a3 = a3;
  seen66.a4 = a4;
  seen66.a5 = a5;
  seen66.a6 = a6;
  seen66.a7 = a7;
  return a4;
}

struct { bool a0; Triple a1; bool a2; int16_t a3; Pair a4; int16_t a5; int8_t a6; } seen67;
CALLED int16_t f67(bool a0, Triple a1, bool a2, int16_t a3, Pair a4, int16_t a5, int8_t a6) {
  seen67.a0 = a0;
  seen67.a1 = a1;
  seen67.a2 = a2;
  seen67.a3 = a3;
  seen67.a4 = a4;
  seen67.a5 = a5;
  seen67.a6 = a6;
  return a3;
}

struct { bool a0; } seen68;
CALLED bool f68(bool a0) {
  seen68.a0 = a0;
  return a0;
}

struct { Halves a0; int16_t a1; int8_t a2; double a3; uint16_t a4; Mixed a5; Pair a6; uint16_t a7; double a8; } seen69;
CALLED double f69(Halves a0, int16_t a1, int8_t a2, double a3, uint16_t a4, Mixed a5, Pair a6, uint16_t a7, double a8) {
  seen69.a0 = a0;
  seen69.a1 = a1;
  seen69.a2 = a2;
  seen69.a3 = a3;
  seen69.a4 = a4;
  seen69.a5 = a5;
  seen69.a6 = a6;
  seen69.a7 = a7;
  seen69.a8 = a8;
  return a8;
}

struct { int8_t a0; } seen70;
CALLED int8_t f70(int8_t a0) {
  seen70.a0 = a0;
  return a0;
}

struct { uint64_t a0; } seen71;
CALLED uint64_t f71(uint64_t a0) {
  seen71.a0 = a0;
  return a0;
}

struct { Axes a0; Axes a1; Five a2; int16_t a3; } seen72;
CALLED Axes f72(Axes a0, Axes a1, Five a2, int16_t a3) {
  seen72.a0 = a0;
  seen72.a1 = a1;
  seen72.a2 = a2;
  seen72.a3 = a3;
  return a0;
}

struct { uint64_t a0; bool a1; } seen73;
CALLED bool f73(uint64_t a0, bool a1) {
  seen73.a0 = a0;
  seen73.a1 = a1;
  return a1;
}

struct { Mixed a0; uint8_t a1; uint8_t a2; Triple a3; int16_t a4; uint32_t a5; uint32_t a6; Halves a7; } seen74;
CALLED Triple f74(Mixed a0, uint8_t a1, uint8_t a2, Triple a3, int16_t a4, uint32_t a5, uint32_t a6, Halves a7) {
  seen74.a0 = a0;
  seen74.a1 = a1;
  seen74.a2 = a2;
  seen74.a3 = a3;
  seen74.a4 = a4;
  seen74.a5 = a5;
  seen74.a6 = a6;
  seen74.a7 = a7;
  return a3;
}

struct { Halves a0; uint64_t a1; int64_t a2; uint64_t a3; float a4; uint8_t a5; int32_t a6; Axes a7; Halves a8; } seen75;
CALLED Axes f75(Halves a0, uint64_t a1, int64_t a2, uint64_t a3, float a4, uint8_t a5, int32_t a6, Axes a7, Halves a8) {
  seen75.a0 = a0;
  seen75.a1 = a1;
  seen75.a2 = a2;
  seen75.a3 = a3;
  seen75.a4 = a4;
  seen75.a5 = a5;
  seen75.a6 = a6;
  seen75.a7 = a7;
  seen75.a8 = a8;
  return a7;
}

struct { Triple a0; Mixed a1; int8_t a2; float a3; uint16_t a4; Axes a5; } seen76;
CALLED Axes f76(Triple a0, Mixed a1, int8_t a2, float a3, uint16_t a4, Axes a5) {
  seen76.a0 = a0;
  seen76.a1 = a1;
  seen76.a2 = a2;
  seen76.a3 = a3;
  seen76.a4 = a4;
  seen76.a5 = a5;
  return a5;
}

struct { float a0; int32_t a1; Halves a2; Halves a3; } seen77;
CALLED int32_t f77(float a0, int32_t a1, Halves a2, Halves a3) {
  seen77.a0 = a0;
  seen77.a1 = a1;
  seen77.a2 = a2;
  seen77.a3 = a3;
  return a1;
}

struct { uint64_t a0; } seen78;
CALLED uint64_t f78(uint64_t a0) {
  seen78.a0 = a0;
  return a0;
}

struct { Four a0; uint8_t a1; Four a2; } seen79;
CALLED Four f79(Four a0, uint8_t a1, Four a2) {
  seen79.a0 = a0;
  seen79.a1 = a1;
  seen79.a2 = a2;
  return a0;
}

