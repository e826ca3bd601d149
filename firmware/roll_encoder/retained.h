// What survives every restart that is not a loss of power: memory that the start-up code leaves alone, with a guard.
#ifndef ROLL_RETAINED_H
#define ROLL_RETAINED_H

#include <stdint.h>
#include <string.h>

#include "crc16.h"
#include "quadrature.h"
#include "reports.h"

namespace roll {

// Bits of the processor's MCUSR.
const uint8_t RESET_POWER = 0x01;
const uint8_t RESET_EXTERNAL = 0x02;
const uint8_t RESET_BROWNOUT = 0x04;
const uint8_t RESET_WATCHDOG = 0x08;

inline Cause cause_of(uint8_t mcusr) {
  if (mcusr & RESET_POWER) return CAUSE_POWER;
  if (mcusr & RESET_BROWNOUT) return CAUSE_BROWNOUT;
  if (mcusr & RESET_EXTERNAL) return CAUSE_EXTERNAL;
  if (mcusr & RESET_WATCHDOG) return CAUSE_WATCHDOG;
  return CAUSE_UNKNOWN;  // a boot loader has cleared the register
}

// Returns the reset flags: the register's where there are any; else those that Optiboot leaves in register r2, which
// it does from version 4.6 on. `version` is its major and minor number from the end of the flash; any other boot
// loader has something else there, and then r2 means nothing.
inline uint8_t reset_flags(uint8_t mcusr, uint8_t r2, uint16_t version) {
  if ((mcusr & 0x0F) != 0) return mcusr & 0x0F;
  const bool told = version >= 0x0406 && version < 0x1000 && r2 != 0 && r2 <= 0x0F;
  return told ? r2 : 0;
}

const uint8_t PATTERN_LENGTH = 96;

struct Retained {
  // Written at every edge.
  int32_t count;
  uint16_t count_check;
  Inputs inputs;
  // Written rarely, guarded by their CRC.
  uint16_t restarts;
  uint32_t mark;
  uint16_t check;
  // Never changes: memory that was without power for a moment has forgotten some of it.
  uint8_t pattern[PATTERN_LENGTH];
};

inline uint8_t pattern_at(uint8_t index) { return static_cast<uint8_t>(0xA7 ^ (index * 31)); }

inline uint16_t check_of_count(int32_t count) {
  const uint32_t bits = static_cast<uint32_t>(count);
  return static_cast<uint16_t>(bits) ^ static_cast<uint16_t>(bits >> 16) ^ 0x5AA5;
}

// A restart in the middle leaves a check that does not fit: the count then counts as lost.
inline void store_count(Retained& memory, int32_t count) {
  memory.count = count;
  memory.count_check = check_of_count(count);
}

inline uint16_t check_of_rest(const Retained& memory) {
  const uint16_t crc = crc16(&memory.restarts, sizeof memory.restarts);
  return crc16(&memory.mark, sizeof memory.mark, crc);
}

inline void store_mark(Retained& memory, uint32_t mark) {
  memory.mark = mark;
  memory.check = check_of_rest(memory);
}

inline bool intact(const Retained& memory) {
  for (uint8_t index = 0; index < PATTERN_LENGTH; index++) {
    if (memory.pattern[index] != pattern_at(index)) return false;
  }
  return memory.check == check_of_rest(memory) && memory.count_check == check_of_count(memory.count) &&
         memory.inputs <= 3;
}

struct Start {
  Cause cause;
  bool kept;   // the count, and the mark with it, survived
  bool moved;  // the inputs changed meanwhile: the handle was turned by nobody knows how much
};

// Readies the memory after a restart and returns what has become of the count. Without a sure sign of lost power an
// intact memory is believed; where power or its dip is the cause, it is not, intact or not: the encoder was off.
inline Start restart(Retained& memory, uint8_t flags, Inputs now) {
  const bool good = intact(memory);
  const Cause cause = cause_of(flags);
  Start start = {cause, good && cause != CAUSE_POWER && cause != CAUSE_BROWNOUT, false};
  start.moved = start.kept && memory.inputs != now;
  const uint16_t restarts = good ? memory.restarts + 1 : 0;
  if (!start.kept) {
    memset(&memory, 0, sizeof memory);
    for (uint8_t index = 0; index < PATTERN_LENGTH; index++) memory.pattern[index] = pattern_at(index);
    store_count(memory, 0);
  }
  memory.restarts = restarts;
  memory.inputs = now;
  store_mark(memory, memory.mark);
  return start;
}

}  // namespace roll

#endif
