// CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, not reflected. "123456789" gives 0x29B1.
// Python: binascii.crc_hqx(body, 0xFFFF).
#ifndef ROLL_CRC16_H
#define ROLL_CRC16_H

#include <stdint.h>

namespace roll {

const uint16_t CRC_START = 0xFFFF;

// Returns the CRC carried on over one more byte: eight steps of the polynomial at once.
inline uint16_t crc16(uint16_t crc, uint8_t byte) {
  uint8_t high = static_cast<uint8_t>(crc >> 8) ^ byte;
  high ^= high >> 4;
  return static_cast<uint16_t>((crc << 8) ^ (static_cast<uint16_t>(high) << 12) ^
                               (static_cast<uint16_t>(high) << 5) ^ high);
}

inline uint16_t crc16(const void* bytes, uint8_t length, uint16_t crc = CRC_START) {
  const uint8_t* each = static_cast<const uint8_t*>(bytes);
  while (length-- > 0) crc = crc16(crc, *each++);
  return crc;
}

}  // namespace roll

#endif
