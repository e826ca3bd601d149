// Roll encoder on an Arduino Nano (ATmega328P, 16 MHz): counts every edge and reports the count over USB.
// Wiring and flashing: README.md. What it sends and takes: protocol.md. It knows nothing of gears or degrees.

#include <Arduino.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/atomic.h>

#include "commands.h"
#include "quadrature.h"
#include "reports.h"
#include "retained.h"

#if !defined(__AVR_ATmega328P__)
#error "This sketch is for boards with an ATmega328P: choose Tools > Board > Arduino Nano."
#endif

namespace {

// The start-up code leaves .noinit alone, but the old boot loader of the Nano clears memory up to 0x20C and Optiboot
// uses the first 0x100 bytes when it writes a sketch. This keeps what must survive clear of both; nobody reads it.
struct Kept {
  uint8_t boot_loaders_own[0x100];
  roll::Retained memory;
};

const uint32_t WAKE_UP_US = 1100;  // asleep, the processor is woken every 1024 us by the timer of micros()

Kept kept __attribute__((section(".noinit")));
uint8_t reset_register __attribute__((section(".noinit")));
uint8_t register_r2 __attribute__((section(".noinit")));

roll::Decoder decoder;
roll::CommandReader commands;
roll::Start start;
uint16_t rate_hz;
uint32_t period_us;
uint32_t due_us;
uint16_t seq;
bool skipped;

}  // namespace

// Before anything else runs: why the processor was reset, and what the boot loader left in r2. A watchdog that caused
// the reset would go on running.
void note_reset() __attribute__((naked, used, section(".init0")));
void note_reset() {
  __asm__ __volatile__(
      "sts %0, r2\n"
      "in r24, %2\n"
      "sts %1, r24\n"
      "clr r1\n"
      "out %2, r1\n"
      : "=m"(register_r2), "=m"(reset_register)
      : "I"(_SFR_IO_ADDR(MCUSR))
      : "r24");
}

void stop_watchdog() __attribute__((naked, used, section(".init3")));
void stop_watchdog() { wdt_disable(); }

// A is D2 (PD2, INT0), B is D3 (PD3, INT1): one handler serves both.
ISR(INT0_vect) {
  const uint8_t port = PIND;
  const int8_t step = decoder.step(static_cast<uint8_t>(port >> 2) & 3);
  if (step != 0) {
    roll::store_count(kept.memory, kept.memory.count + step);
    kept.memory.inputs = decoder.inputs;
  }
}
ISR(INT1_vect, ISR_ALIASOF(INT0_vect));

// Waits for room where there is none; reports see to it that there is.
static void send(const roll::Line& line) { Serial.write(reinterpret_cast<const uint8_t*>(line.text()), line.length()); }

static void set_rate(uint16_t new_rate_hz) {
  rate_hz = new_rate_hz;
  period_us = rate_hz == 0 ? 0 : 1000000UL / rate_hz;
  due_us = micros() + period_us;
}

static void send_identity() {
  const roll::Identity identity = {kept.memory.restarts, start.cause, start.kept, kept.memory.mark, rate_hz};
  roll::Line line;
  roll::write_identity(line, identity);
  send(line);
}

static void send_report(uint8_t flags) {
  roll::Report report;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    report.us = micros();
    report.count = kept.memory.count;
    report.illegal = decoder.illegal;
  }
  report.seq = seq++;
  report.flags = flags | (start.kept ? roll::FLAG_KEPT : 0) | (start.moved ? roll::FLAG_MOVED : 0) |
                 (skipped ? roll::FLAG_SKIPPED : 0) | static_cast<uint8_t>(kept.memory.restarts << 4);
  roll::Line line;
  roll::write_report(line, report);
  // A report that has to wait would be late, and would hold up the next: it is left out, and its number is missing.
  // One that was asked for waits.
  skipped = Serial.availableForWrite() < line.length() && (flags & roll::FLAG_POLLED) == 0;
  if (!skipped) send(line);
}

static void carry_out(const roll::Command& command) {
  roll::Line line;
  switch (command.kind) {
    case roll::COMMAND_NONE: return;
    case roll::COMMAND_ID: send_identity(); return;
    case roll::COMMAND_POLL: send_report(roll::FLAG_POLLED); return;
    case roll::COMMAND_RATE: set_rate(static_cast<uint16_t>(command.number)); break;
    case roll::COMMAND_ZERO:
      ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        roll::store_count(kept.memory, command.number);
        roll::store_mark(kept.memory, command.mark);
      }
      break;
    case roll::COMMAND_MARK:
      ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { roll::store_mark(kept.memory, command.mark); }
      break;
    case roll::COMMAND_BAD: roll::write_error(line, command.error); break;
  }
  if (command.kind != roll::COMMAND_BAD) roll::write_answer(line, command);
  send(line);
}

void setup() {
  pinMode(2, INPUT_PULLUP);
  pinMode(3, INPUT_PULLUP);
  delayMicroseconds(50);  // for the pull-ups to charge the cable
  const uint16_t boot_loader = pgm_read_word(FLASHEND - 1);
  decoder.begin((PIND >> 2) & 3);
  start = roll::restart(kept.memory, roll::reset_flags(reset_register, register_r2, boot_loader), decoder.inputs);
  EICRA = _BV(ISC10) | _BV(ISC00);  // either edge of either channel
  EIFR = _BV(INTF1) | _BV(INTF0);
  EIMSK = _BV(INT1) | _BV(INT0);
  Serial.begin(115200);
  set_rate(roll::USUAL_RATE_HZ);
  send_identity();
}

void loop() {
  while (Serial.available() > 0) carry_out(commands.take(static_cast<char>(Serial.read())));
  const int32_t left_us = static_cast<int32_t>(due_us - micros());
  if (period_us != 0 && left_us <= 0) {
    // After a long stop reports start anew from now; else the next is due one period after this one was.
    due_us = left_us < -static_cast<int32_t>(2 * period_us) ? micros() + period_us : due_us + period_us;
    send_report(0);
  } else if (period_us == 0 || left_us > static_cast<int32_t>(WAKE_UP_US)) {
    set_sleep_mode(SLEEP_MODE_IDLE);
    sleep_mode();  // until an edge, a byte, or the timer
  }
}
