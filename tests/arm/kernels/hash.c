/* Checksums and ciphers: known answers are part of what is added. */
#include <string.h>

#include "kernel.h"

#define SIZE 1024

static uint8_t data[SIZE];

static void fill(void) {
  for (int n = 0; n < SIZE; n++) {
    data[n] = (uint8_t)any();
  }
}

static uint32_t crc32(const uint8_t *bytes, size_t size) {
  uint32_t crc = 0xFFFFFFFF;
  for (size_t n = 0; n < size; n++) {
    crc ^= bytes[n];
    for (int bit = 0; bit < 8; bit++) {
      crc = crc & 1 ? crc >> 1 ^ 0xEDB88320 : crc >> 1;
    }
  }
  return ~crc;
}

static void run_crc(void) {
  uint32_t table[256], crc = 0xFFFFFFFF;
  uint16_t short_crc = 0xFFFF;
  fill();
  for (uint32_t n = 0; n < 256; n++) {
    table[n] = n;
    for (int bit = 0; bit < 8; bit++) {
      table[n] = table[n] >> 1 ^ (0xEDB88320 & -(table[n] & 1));
    }
  }
  for (int n = 0; n < SIZE; n++) {
    crc = crc >> 8 ^ table[(crc ^ data[n]) & 0xFF];
    short_crc ^= (uint16_t)(data[n] << 8);
    for (int bit = 0; bit < 8; bit++) {
      short_crc = (uint16_t)(short_crc & 0x8000 ? short_crc << 1 ^ 0x1021 : short_crc << 1);
    }
  }
  add(~crc == crc32(data, SIZE));
  add(crc32((const uint8_t *)"123456789", 9) == 0xCBF43926);
  add(crc);
  add(short_crc);
}

static void run_sums(void) {
  uint32_t a = 1, b = 0, fnv = 0x811C9DC5;
  uint16_t first = 0, second = 0;
  fill();
  for (int n = 0; n < SIZE; n++) {
    a = (a + data[n]) % 65521;
    b = (b + a) % 65521;
    fnv = (fnv ^ data[n]) * 0x01000193;
    first = (uint16_t)((first + data[n]) % 255);
    second = (uint16_t)((second + first) % 255);
  }
  add(b << 16 | a);
  add(fnv);
  add((uint32_t)second << 8 | first);
}

static uint32_t rotated(uint32_t value, int by) { return value >> by | value << (32 - by); }

static void sha256_block(uint32_t state[8], const uint8_t *block, const uint32_t constants[64]) {
  uint32_t w[64], s[8];
  for (int n = 0; n < 16; n++) {
    memcpy(w + n, block + 4 * n, 4);
    w[n] = __builtin_bswap32(w[n]);
  }
  for (int n = 16; n < 64; n++) {
    uint32_t first = rotated(w[n - 15], 7) ^ rotated(w[n - 15], 18) ^ w[n - 15] >> 3;
    uint32_t second = rotated(w[n - 2], 17) ^ rotated(w[n - 2], 19) ^ w[n - 2] >> 10;
    w[n] = w[n - 16] + first + w[n - 7] + second;
  }
  memcpy(s, state, sizeof s);
  for (int n = 0; n < 64; n++) {
    uint32_t e = s[4], a = s[0];
    uint32_t first = s[7] + (rotated(e, 6) ^ rotated(e, 11) ^ rotated(e, 25)) + ((e & s[5]) ^ (~e & s[6])) +
                     constants[n] + w[n];
    uint32_t second = (rotated(a, 2) ^ rotated(a, 13) ^ rotated(a, 22)) + ((a & s[1]) ^ (a & s[2]) ^ (s[1] & s[2]));
    memmove(s + 1, s, 7 * sizeof *s);
    s[4] += first;
    s[0] = first + second;
  }
  for (int n = 0; n < 8; n++) {
    state[n] += s[n];
  }
}

/* The rounds of SHA-256, with constants of our own making. */
static void run_rounds(void) {
  uint32_t state[8] = {1, 2, 3, 4, 5, 6, 7, 8}, constants[64];
  fill();
  for (int n = 0; n < 64; n++) {
    constants[n] = any();
  }
  for (int n = 0; n < SIZE; n += 64) {
    sha256_block(state, data + n, constants);
  }
  add_bytes(state, sizeof state);
}

static void run_cipher(void) {
  uint32_t key[4] = {any(), any(), any(), any()};
  for (int n = 0; n < 60; n++) {
    uint32_t a = any(), b = any(), kept = a, sum = 0;
    for (int round = 0; round < 32; round++) {
      a += ((b << 4 ^ b >> 5) + b) ^ (sum + key[sum & 3]);
      sum += 0x9E3779B9;
      b += ((a << 4 ^ a >> 5) + a) ^ (sum + key[sum >> 11 & 3]);
    }
    add(a);
    add(b);
    for (int round = 0; round < 32; round++) {
      b -= ((a << 4 ^ a >> 5) + a) ^ (sum + key[sum >> 11 & 3]);
      sum -= 0x9E3779B9;
      a -= ((b << 4 ^ b >> 5) + b) ^ (sum + key[sum & 3]);
    }
    add(a == kept);
  }
}

const Kernel hash_kernels[] = {
    {"crc", run_crc}, {"sums", run_sums}, {"hash-rounds", run_rounds}, {"cipher", run_cipher}, {NULL, NULL},
};
