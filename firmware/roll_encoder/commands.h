// What the board is told: lines of text with an optional CRC, so that a person can type them. See protocol.md.
#ifndef ROLL_COMMANDS_H
#define ROLL_COMMANDS_H

#include <stdint.h>
#include <string.h>

#include "line.h"
#include "reports.h"

namespace roll {

const uint8_t LONGEST_COMMAND = 40;  // without the newline

enum CommandKind { COMMAND_NONE, COMMAND_ID, COMMAND_POLL, COMMAND_RATE, COMMAND_ZERO, COMMAND_MARK, COMMAND_BAD };

struct Command {
  CommandKind kind;
  int32_t number;     // zero: the count to set; rate: reports a second
  uint32_t mark;      // zero, mark
  const char* error;  // where kind is COMMAND_BAD: "crc", "unknown", "arguments", "range", "long"
};

inline Command bad_command(const char* error) {
  const Command command = {COMMAND_BAD, 0, 0, error};
  return command;
}

inline bool same_word(const char* text, const char* end, const char* word) {
  const uint8_t length = static_cast<uint8_t>(strlen(word));
  return end - text == length && memcmp(text, word, length) == 0;
}

// Splits `text` at single blanks into at most three words; returns how many there are, 4 for too many or an empty one.
inline uint8_t split(const char* text, const char* end, const char* starts[3], const char* ends[3]) {
  uint8_t count = 0;
  while (true) {
    if (count == 3) return 4;
    starts[count] = text;
    while (text < end && *text != ' ') text++;
    if (text == starts[count]) return 4;
    ends[count++] = text;
    if (text == end) return count;
    text++;
  }
}

// Returns what a line (without its newline) tells the board to do. A mark is believed only with a CRC: it is the
// host's word for "this count belongs to that zero", and noise must not be able to say so.
inline Command read_command(const char* text, uint8_t length) {
  const char* end = text + length;
  while (end > text && (end[-1] == ' ' || end[-1] == '\r')) end--;
  if (end == text) {
    const Command nothing = {COMMAND_NONE, 0, 0, 0};
    return nothing;
  }
  const char* star = static_cast<const char*>(memchr(text, '*', static_cast<size_t>(end - text)));
  const bool guarded = star != 0;
  if (guarded) {
    uint32_t crc;
    if (!read_hex(star + 1, end, 4, crc) || crc != crc16(text, static_cast<uint8_t>(star - text))) {
      return bad_command("crc");
    }
    end = star;
  }
  const char *starts[3], *ends[3];
  const uint8_t words = split(text, end, starts, ends);
  if (words == 4) return bad_command("arguments");
  Command command = {COMMAND_NONE, 0, 0, 0};
  if (same_word(starts[0], ends[0], "id") || same_word(starts[0], ends[0], "poll")) {
    command.kind = *text == 'i' ? COMMAND_ID : COMMAND_POLL;
    return words == 1 ? command : bad_command("arguments");
  }
  if (same_word(starts[0], ends[0], "rate")) {
    command.kind = COMMAND_RATE;
    if (words != 2 || !read_signed(starts[1], ends[1], command.number)) return bad_command("arguments");
    return command.number >= 0 && command.number <= HIGHEST_RATE_HZ ? command : bad_command("range");
  }
  if (same_word(starts[0], ends[0], "zero")) {
    command.kind = COMMAND_ZERO;
    if (words >= 2 && !read_signed(starts[1], ends[1], command.number)) return bad_command("arguments");
    if (words == 3 && !read_hex(starts[2], ends[2], 8, command.mark)) return bad_command("arguments");
    return words < 3 || guarded ? command : bad_command("crc");
  }
  if (same_word(starts[0], ends[0], "mark")) {
    command.kind = COMMAND_MARK;
    if (words != 2 || !read_hex(starts[1], ends[1], 8, command.mark)) return bad_command("arguments");
    return guarded ? command : bad_command("crc");
  }
  return bad_command("unknown");
}

// Collects bytes into command lines; a line that is too long is answered once, at its end.
class CommandReader {
 public:
  CommandReader() : length_(0), overlong_(false) {}

  // Returns what is to be done after one more byte; COMMAND_NONE inside a line and after an empty one.
  Command take(char byte) {
    Command command = {COMMAND_NONE, 0, 0, 0};
    if (byte != '\n' && byte != '\r') {
      if (length_ < LONGEST_COMMAND) {
        text_[length_++] = byte;
      } else {
        overlong_ = true;
      }
      return command;
    }
    command = overlong_ ? bad_command("long") : read_command(text_, length_);
    length_ = 0;
    overlong_ = false;
    return command;
  }

 private:
  char text_[LONGEST_COMMAND];
  uint8_t length_;
  bool overlong_;
};

inline void write_error(Line& line, const char* error) { line.put("E ").put(error).finish(); }

// Writes the answer to a command that was carried out.
inline void write_answer(Line& line, const Command& command) {
  switch (command.kind) {
    case COMMAND_RATE: line.put("A rate ").signed_decimal(command.number); break;
    case COMMAND_ZERO: line.put("A zero ").signed_decimal(command.number).put(' ').hex(command.mark, 8); break;
    case COMMAND_MARK: line.put("A mark ").hex(command.mark, 8); break;
    default: return;
  }
  line.finish();
}

}  // namespace roll

#endif
