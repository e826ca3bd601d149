// x4 decoding of two encoder channels. Plain C++: compiled for the board and, in the tests, for the host.
#ifndef ROLL_QUADRATURE_H
#define ROLL_QUADRATURE_H

#include <stdint.h>

namespace roll {

// Both channels as two bits: bit 0 is A, bit 1 is B. Forward (A leads B) they go 0, 1, 3, 2, 0.
typedef uint8_t Inputs;

const int8_t ILLEGAL = 2;

// What each change of the inputs means, at index before * 4 + now: a step forward, a step back, nothing, or both
// channels at once, which no encoder does: an edge was missed.
const int8_t STEPS[16] = {
    0, 1, -1, ILLEGAL,   // from 0
    -1, 0, ILLEGAL, 1,   // from 1
    1, ILLEGAL, 0, -1,   // from 2
    ILLEGAL, -1, 1, 0,   // from 3
};

// Turns changes of the inputs into steps. Of an illegal change it takes two steps in the direction of the last legal
// one: at speed an edge was merely served late, and the shaft has not turned round between two edges.
struct Decoder {
  Inputs inputs;
  int8_t direction;  // of the last legal step, 1 or -1
  uint16_t illegal;  // illegal changes so far, modulo 65536

  void begin(Inputs now) {
    inputs = now;
    direction = 1;
    illegal = 0;
  }

  // Returns the steps since the last call: 0, 1, -1, or 2 or -2 after an illegal change.
  inline int8_t step(Inputs now) __attribute__((always_inline)) {
    const int8_t step = STEPS[static_cast<uint8_t>(inputs * 4 + now)];
    inputs = now;
    if (step == 0) return 0;
    if (step == ILLEGAL) {
      illegal++;
      return direction > 0 ? 2 : -2;
    }
    direction = step;
    return step;
  }
};

}  // namespace roll

#endif
