// The firmware's headers on the host: `test_headers VECTORS.csv` says what failed and ends with 1, or says how much held.
// The vectors are those that the host's own tests read.

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "commands.h"
#include "quadrature.h"
#include "reports.h"
#include "retained.h"

namespace {

int failures = 0;
int checks = 0;

void check(bool holds, const std::string& what) {
  checks++;
  if (holds) return;
  failures++;
  std::fprintf(stderr, "failed: %s\n", what.c_str());
}

typedef std::vector<std::string> Fields;

Fields split(const std::string& line) {
  Fields fields;
  std::stringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
  return fields;
}

std::string text_of(const roll::Line& line) { return std::string(line.text(), line.length()); }
long number(const std::string& text) { return std::strtol(text.c_str(), 0, 10); }
unsigned long hexadecimal(const std::string& text) { return std::strtoul(text.c_str(), 0, 16); }

void check_crc(const Fields& given) {
  const uint16_t crc = roll::crc16(given[1].data(), static_cast<uint8_t>(given[1].size()));
  check(crc == hexadecimal(given[2]), "CRC of " + given[1]);
}

void check_report(const Fields& given) {
  const roll::Report report = {static_cast<uint16_t>(number(given[1])), static_cast<uint32_t>(number(given[2])),
                               static_cast<int32_t>(number(given[3])), static_cast<uint16_t>(number(given[4])),
                               static_cast<uint8_t>(hexadecimal(given[5]))};
  roll::Line line;
  roll::write_report(line, report);
  check(text_of(line) == given[6] + "\n", "report " + given[6] + " is " + text_of(line));
}

roll::Cause cause_named(const std::string& name) {
  for (int each = roll::CAUSE_UNKNOWN; each <= roll::CAUSE_WATCHDOG; each++) {
    if (name == roll::cause_name(static_cast<roll::Cause>(each))) return static_cast<roll::Cause>(each);
  }
  check(false, "a cause is named " + name);
  return roll::CAUSE_UNKNOWN;
}

void check_identity(const Fields& given) {
  const roll::Identity identity = {static_cast<uint16_t>(number(given[1])), cause_named(given[2]), given[3] == "kept",
                                   static_cast<uint32_t>(hexadecimal(given[4])),
                                   static_cast<uint16_t>(number(given[5]))};
  roll::Line line;
  roll::write_identity(line, identity);
  check(text_of(line) == given[6] + "\n", "identity " + given[6] + " is " + text_of(line));
}

// Returns the answer to the last of the bytes, without its CRC.
std::string answer_to(roll::CommandReader& reader, const std::string& bytes) {
  roll::Command command = roll::bad_command("nothing");
  for (char each : bytes) command = reader.take(each);
  roll::Line line;
  switch (command.kind) {
    case roll::COMMAND_NONE: return "";
    case roll::COMMAND_ID: return "id";
    case roll::COMMAND_POLL: return "poll";
    case roll::COMMAND_BAD: roll::write_error(line, command.error); break;
    default: roll::write_answer(line, command);
  }
  return text_of(line).substr(0, text_of(line).find('*'));
}

void check_command(const Fields& given) {
  roll::CommandReader reader;
  for (const char* ending : {"\n", "\r"}) {
    const std::string answer = answer_to(reader, given[1] + ending);
    check(answer == given[2], "command " + given[1] + " answers " + answer);
    check(answer_to(reader, "\n").empty(), "an empty line after " + given[1] + " is nothing");
  }
}

void check_inputs(const Fields& given) {
  roll::Decoder decoder;
  decoder.begin(static_cast<roll::Inputs>(given[1][0] - '0'));
  long count = 0;
  for (size_t each = 1; each < given[1].size(); each++) count += decoder.step(static_cast<roll::Inputs>(given[1][each] - '0'));
  check(count == number(given[2]) && decoder.illegal == number(given[3]), "inputs " + given[1]);
}

void check_vectors(const char* path) {
  std::ifstream file(path);
  check(file.good(), std::string("the vectors are at ") + path);
  int used = 0;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    const Fields given = split(line);
    used++;
    if (given[0] == "crc") check_crc(given);
    else if (given[0] == "report") check_report(given);
    else if (given[0] == "identity") check_identity(given);
    else if (given[0] == "command") check_command(given);
    else if (given[0] == "inputs") check_inputs(given);
    else check(given[0] == "damaged" || given[0] == "stranger", "a vector of a known kind: " + line);
  }
  check(used > 60, "there are vectors");
}

roll::Retained garbage() {
  roll::Retained memory;
  unsigned char* bytes = reinterpret_cast<unsigned char*>(&memory);
  for (size_t each = 0; each < sizeof memory; each++) bytes[each] = static_cast<unsigned char>(std::rand());
  return memory;
}

void check_memory_survives() {
  for (uint8_t flags : {uint8_t(0), roll::RESET_EXTERNAL, roll::RESET_WATCHDOG}) {
    roll::Retained memory = garbage();
    check(!roll::restart(memory, roll::RESET_POWER, 1).kept && memory.count == 0 && memory.mark == 0, "power on");
    roll::store_count(memory, -123456);
    roll::store_mark(memory, 0xCAFE);
    memory.inputs = 3;
    roll::Start start = roll::restart(memory, flags, 3);
    check(start.kept && !start.moved && memory.count == -123456 && memory.mark == 0xCAFE, "count kept");
    check(memory.restarts == 1, "restarts are counted");
    start = roll::restart(memory, flags, 2);
    check(start.kept && start.moved && memory.restarts == 2, "a turn during the restart is noticed");
  }
}

void check_memory_is_not_believed() {
  for (int each = 0; each < 20000; each++) {
    roll::Retained memory = garbage();
    check(!roll::restart(memory, 0, 0).kept && memory.count == 0, "random memory is not believed");
  }
  for (uint8_t flags = 0; flags < 16; flags++) {
    roll::Retained memory = garbage();
    roll::restart(memory, roll::RESET_POWER, 0);
    roll::store_count(memory, 77);
    const bool power_lost = (flags & (roll::RESET_POWER | roll::RESET_BROWNOUT)) != 0;
    check(roll::restart(memory, flags, 0).kept == !power_lost, "intact memory and a reset cause");
  }
  // Any byte that changes by itself is noticed, but for the inputs, whose change only means "moved".
  roll::Retained memory = garbage();
  roll::restart(memory, roll::RESET_POWER, 0);
  roll::store_count(memory, 0x12345678);
  for (size_t byte = 0; byte < sizeof memory; byte++) {
    for (int bit = 0; bit < 8; bit++) {
      roll::Retained other = memory;
      reinterpret_cast<unsigned char*>(&other)[byte] = static_cast<unsigned char>(reinterpret_cast<unsigned char*>(&other)[byte] ^ (1 << bit));
      const bool told = memcmp(&other.count, &memory.count, sizeof memory.count) != 0 ||
                        other.count_check != memory.count_check || other.restarts != memory.restarts ||
                        other.mark != memory.mark || other.check != memory.check ||
                        memcmp(other.pattern, memory.pattern, sizeof memory.pattern) != 0 || other.inputs > 3;
      check(roll::intact(other) == !told, "a flipped bit in memory");
    }
  }
}

// A reset between any two of the bytes that an edge writes: the count is the old one, the new one, or not believed.
void check_torn_writes() {
  for (long from : {0L, -1L, 255L, 65535L, -65536L, 16777215L, 2147483645L}) {
    for (int step : {1, -1, 2, -2}) {
      roll::Retained before = garbage();
      roll::restart(before, roll::RESET_POWER, 0);
      roll::store_count(before, static_cast<int32_t>(from));
      roll::Retained after = before;
      roll::store_count(after, static_cast<int32_t>(static_cast<uint32_t>(from) + static_cast<uint32_t>(step)));
      for (size_t written = 0; written <= sizeof after.count + sizeof after.count_check; written++) {
        roll::Retained torn = before;
        memcpy(&torn, &after, written);
        const bool believed = roll::restart(torn, 0, 0).kept;
        check(!believed || torn.count == before.count || torn.count == after.count, "a torn count");
      }
    }
  }
}

void check_reset_flags() {
  check(roll::reset_flags(roll::RESET_EXTERNAL, roll::RESET_POWER, 0x0602) == roll::RESET_EXTERNAL, "MCUSR comes first");
  check(roll::reset_flags(0, roll::RESET_POWER, 0x0406) == roll::RESET_POWER, "r2 of Optiboot 4.6");
  check(roll::reset_flags(0, roll::RESET_POWER, 0x0404) == 0, "r2 of Optiboot 4.4 is nothing");
  check(roll::reset_flags(0, roll::RESET_POWER, 0xFFFF) == 0, "r2 of another boot loader is nothing");
  check(roll::reset_flags(0, 0x5C, 0x0602) == 0, "r2 that cannot be");
  check(roll::cause_of(roll::RESET_POWER | roll::RESET_EXTERNAL | roll::RESET_BROWNOUT) == roll::CAUSE_POWER, "power first");
}

void check_lines_fit() {
  roll::Line report, identity;
  const roll::Report longest = {65535, 4294967295u, -2147483647 - 1, 65535, 255};
  roll::write_report(report, longest);
  check(report.length() == 45, "the longest report");
  const roll::Identity about = {65535, roll::CAUSE_BROWNOUT, true, 0xFFFFFFFF, 400};
  roll::write_identity(identity, about);
  check(identity.length() < roll::LONGEST_LINE && identity.text()[identity.length() - 1] == '\n', "the longest identity");
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) return std::fprintf(stderr, "use: test_headers VECTORS.csv\n"), 2;
  std::srand(1);
  check_vectors(arguments[1]);
  check_memory_survives();
  check_memory_is_not_believed();
  check_torn_writes();
  check_reset_flags();
  check_lines_fit();
  std::printf("%d checks, %d failed\n", checks, failures);
  return failures == 0 ? 0 : 1;
}
