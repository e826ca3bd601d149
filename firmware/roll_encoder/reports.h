// What the board says: its identity, its reports, its answers. See protocol.md.
#ifndef ROLL_REPORTS_H
#define ROLL_REPORTS_H

#include <stdint.h>

#include "line.h"

namespace roll {

#define ROLL_NAME "cathxr-roll"
#define ROLL_PROTOCOL "1"
#define ROLL_FIRMWARE "1.0.0"

const uint16_t USUAL_RATE_HZ = 200;
const uint16_t HIGHEST_RATE_HZ = 400;

// Flags of a report; the upper four bits are the restart counter modulo 16.
const uint8_t FLAG_KEPT = 0x01;     // the count survived the last restart
const uint8_t FLAG_MOVED = 0x02;    // the inputs were others after the restart than before it
const uint8_t FLAG_SKIPPED = 0x04;  // reports before this one were not sent: the line was busy
const uint8_t FLAG_POLLED = 0x08;   // the answer to `poll`

enum Cause { CAUSE_UNKNOWN, CAUSE_POWER, CAUSE_EXTERNAL, CAUSE_BROWNOUT, CAUSE_WATCHDOG };

inline const char* cause_name(Cause cause) {
  switch (cause) {
    case CAUSE_POWER: return "power";
    case CAUSE_EXTERNAL: return "external";
    case CAUSE_BROWNOUT: return "brownout";
    case CAUSE_WATCHDOG: return "watchdog";
    default: return "unknown";
  }
}

struct Report {
  uint16_t seq;
  uint32_t us;
  int32_t count;
  uint16_t illegal;
  uint8_t flags;
};

inline void write_report(Line& line, const Report& report) {
  line.put("R ").decimal(report.seq).put(' ').decimal(report.us).put(' ').signed_decimal(report.count);
  line.put(' ').decimal(report.illegal).put(' ').hex(report.flags, 2).finish();
}

struct Identity {
  uint16_t restarts;
  Cause cause;
  bool kept;
  uint32_t mark;
  uint16_t rate_hz;
};

inline void write_identity(Line& line, const Identity& identity) {
  line.put("I " ROLL_NAME " " ROLL_PROTOCOL " " ROLL_FIRMWARE " ").decimal(identity.restarts).put(' ');
  line.put(cause_name(identity.cause)).put(identity.kept ? " kept " : " lost ").hex(identity.mark, 8).put(' ');
  line.decimal(identity.rate_hz).finish();
}

}  // namespace roll

#endif
