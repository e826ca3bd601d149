// Runs the real firmware on simavr's ATmega328P behind a pseudo-terminal that a host program opens like a board's port.
//
//   simulator FIRMWARE.elf [--loader none|optiboot4|optiboot6|LOADER.hex]
//
// It is steered by lines on standard input, each answered by one line, "ok ..." or "error ...": see `carry_out`.
// Time: `pace on` runs at the speed of a real board, `run CYCLES` as fast as it goes. Nothing runs before one of them.

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "avr_uart.h"
#include "edges.h"
#include "pseudo_terminal.h"
#include "sim_avr.h"
#include "sim_cycle_timers.h"
#include "sim_elf.h"
#include "sim_hex.h"
#include "sim_interrupts.h"
#include "sim_io.h"

#define FREQUENCY 16000000u
#define SLICE (FREQUENCY / 2000)
#define INTERRUPT_ENTRY 4
#define LOADER_WAITS FREQUENCY
#define MCUSR 0x54
#define SRAM 0x100

enum { POWER = 1, EXTERNAL = 2, BROWNOUT = 4, WATCHDOG = 8 };
enum { PASS, HOLD, DROP };

static struct {
  avr_t* avr;
  avr_uart_t* uart;
  uint32_t fixed_cycles_per_byte;
  edges_t edges;
  terminal_t terminal;
  bool automatic_reset, paced, asked_to_quit, powered;
  avr_cycle_count_t loader_until, run_until;
  uint8_t loader_flags;
  enum { NO_LOADER, OPTIBOOT_4, OPTIBOOT_6, REAL_LOADER } loader;
  int line;
  double noise;
  uint64_t random;
  unsigned long sent, damaged;
  FILE* times;
  unsigned char out[1 << 16], in[4096];
  size_t out_length, in_length, in_next;
  bool input_full;
} board;

static uint64_t next_random(void) {  // xorshift64*
  board.random ^= board.random >> 12;
  board.random ^= board.random << 25;
  board.random ^= board.random >> 27;
  return board.random * 2685821657736338717ull;
}

static uint64_t monotonic_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

static double seconds(void) { return 1e-9 * (double)monotonic_ns(); }

static void emit(unsigned char byte) {
  if (board.out_length < sizeof board.out) board.out[board.out_length++] = byte;
}

// The line from the board to the host; noise flips, drops or inserts.
static void from_board(avr_irq_t* irq, uint32_t value, void* param) {
  board.sent++;
  if (value == '\n' && board.times != NULL) {
    const uint64_t when[2] = {board.avr->cycle, monotonic_ns()};
    fwrite(when, sizeof when, 1, board.times);
    fflush(board.times);
  }
  if (board.line == DROP) return;
  if (board.noise > 0 && (double)(next_random() >> 11) / 9007199254740992.0 < board.noise) {
    board.damaged++;
    const uint64_t choice = next_random();
    if (choice % 4 == 0) return;
    if (choice % 4 == 1) emit((unsigned char)(choice >> 8));
    if (choice % 4 != 1) value ^= 1u << (choice >> 8) % 8;
  }
  emit((unsigned char)value);
}

static void flush_line(void) {
  if (board.line == HOLD) return;
  terminal_send(&board.terminal, board.out, board.out_length);
  board.out_length = 0;
}

static void input_full(avr_irq_t* irq, uint32_t value, void* param) { board.input_full = true; }
static void input_free(avr_irq_t* irq, uint32_t value, void* param) { board.input_full = false; }

static avr_cycle_count_t next_input(avr_t* avr, avr_cycle_count_t when, void* param) {
  if (board.in_next == board.in_length) return 0;
  if (!board.input_full) {
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), board.in[board.in_next++]);
  }
  return when + board.uart->cycles_per_byte;
}

static void from_host(void) {
  if (board.in_next == board.in_length) board.in_next = board.in_length = 0;
  const bool idle = board.in_length == 0;
  board.in_length += terminal_receive(&board.terminal, board.in + board.in_length, sizeof board.in - board.in_length);
  if (idle && board.in_length > 0) {
    avr_cycle_timer_register(board.avr, board.uart->cycles_per_byte, next_input, NULL);
  }
}

// simavr enters an interrupt in no time at all; the processor takes four cycles.
static void interrupt_entered(avr_irq_t* irq, uint32_t value, void* param) {
  if (value != 0) board.avr->cycle += INTERRUPT_ENTRY;
}

static void no_sleep(avr_t* avr, avr_cycle_count_t cycles) {}

static void start_program(uint8_t flags, uint8_t r2) {
  avr_reset(board.avr);
  board.avr->data[MCUSR] = flags;
  board.avr->data[2] = r2;
  board.fixed_cycles_per_byte = 0;
  board.input_full = false;
  board.in_next = board.in_length = 0;
  edges_resume(&board.edges, board.avr);
}

// What the boot loader makes of a reset. Optiboot clears MCUSR; from 4.6 on it leaves what was in it in r2. After an
// external reset it waits a second for a new sketch and then starts the old one through a watchdog reset.
static void reset(uint8_t flags) {
  if (board.loader == NO_LOADER || board.loader == REAL_LOADER) {
    start_program(flags, 0x5C);
  } else if ((flags & EXTERNAL) != 0) {
    board.loader_until = board.avr->cycle + LOADER_WAITS;
    board.loader_flags = WATCHDOG;
  } else {
    start_program(0, board.loader == OPTIBOOT_6 ? flags : 0x5C);
  }
}

static void forget_memory(void) {
  for (uint32_t each = SRAM; each <= board.avr->ramend; each++) board.avr->data[each] = (uint8_t)(next_random() >> 32);
}

// Runs for some cycles; returns false where the processor has crashed.
static bool run(avr_cycle_count_t cycles) {
  const avr_cycle_count_t end = board.avr->cycle + cycles;
  while (board.avr->cycle < end) {
    if (!board.powered || board.avr->cycle < board.loader_until) {
      board.avr->cycle = board.powered && board.loader_until < end ? board.loader_until : end;
      edges_skip(&board.edges, board.avr->cycle);
      if (board.powered && board.avr->cycle == board.loader_until) {
        start_program(0, board.loader == OPTIBOOT_6 ? board.loader_flags : 0x5C);
      }
      continue;
    }
    const int state = avr_run(board.avr);
    if (state == cpu_Done || state == cpu_Crashed) return false;
    // simavr counts eleven bit times for a byte of ten.
    if (board.uart->cycles_per_byte != board.fixed_cycles_per_byte && board.uart->cycles_per_byte > 0) {
      board.uart->cycles_per_byte = board.uart->cycles_per_byte * 10 / 11;
      board.fixed_cycles_per_byte = board.uart->cycles_per_byte;
    }
  }
  return true;
}

static bool reset_by_name(const char* name, bool brief) {
  const char* names[] = {"power", "external", "brownout", "watchdog"};
  for (int each = 0; each < 4; each++) {
    if (strcmp(name, names[each]) != 0) continue;
    if (each == 0 && !brief) forget_memory();
    board.loader_until = 0;
    reset((uint8_t)(1 << each));
    return true;
  }
  return false;
}

static bool set_line(const char* how) {
  const char* names[] = {"pass", "hold", "drop"};
  for (int each = PASS; each <= DROP; each++) {
    if (strcmp(how, names[each]) == 0) {
      board.line = each;
      return true;
    }
  }
  return false;
}

static void inject(const char* hex) {
  unsigned byte;
  for (; sscanf(hex, "%2x", &byte) == 1; hex += 2) emit((unsigned char)byte);
}

// Carries one line out and answers it.
static void carry_out(const char* line) {
  char word[256] = "", more[256] = "";
  unsigned long long number = 0;
  unsigned address, value;
  bool good = true;
  if (sscanf(line, "run %llu", &number) == 1 && number > 0) {
    board.run_until = board.avr->cycle + number;  // answered when it is done
    return;
  } else if (sscanf(line, "pace %255s", word) == 1) {
    board.paced = strcmp(word, "on") == 0;
  } else if (sscanf(line, "play %255s", word) == 1) {
    good = edges_play(&board.edges, word, board.avr, board.avr->cycle + 1600);
    printf(good ? "ok %llu\n" : "error cannot read %llu\n", (unsigned long long)board.edges.start);
    return;
  } else if (sscanf(line, "reset %255s %255s", word, more) >= 1) {
    good = reset_by_name(word, strcmp(more, "brief") == 0);
  } else if (sscanf(line, "automatic %255s", word) == 1) {
    board.automatic_reset = strcmp(word, "on") == 0;
  } else if (sscanf(line, "line %255s", word) == 1) {
    good = set_line(word);
  } else if (sscanf(line, "noise %lf %llu", &board.noise, &number) == 2) {
    board.random = number * 2 + 1;
  } else if (sscanf(line, "inject %255s", word) == 1) {
    inject(word);
  } else if (sscanf(line, "times %255s", word) == 1) {  // of every newline: cycle and host's nanoseconds, 64 bits each
    if (board.times != NULL) fclose(board.times);
    board.times = fopen(word, "wb");
    good = board.times != NULL;
  } else if (sscanf(line, "poke %x %x", &address, &value) == 2 && address <= board.avr->ramend) {
    board.avr->data[address] = (uint8_t)value;
  } else if (strcmp(line, "unplug") == 0) {  // the cable carries the power, too
    terminal_unplug(&board.terminal);
    board.powered = false;
  } else if (strcmp(line, "plug") == 0) {
    good = terminal_plug(&board.terminal);
    board.powered = true;
    reset_by_name("power", false);
    printf("ok %s\n", board.terminal.name);
    return;
  } else if (strcmp(line, "state") == 0) {
    printf("ok %llu %lu %lu %zu\n", (unsigned long long)board.avr->cycle, board.sent, board.damaged,
           board.edges.length - board.edges.next);
    return;
  } else if (strcmp(line, "quit") == 0) {
    board.asked_to_quit = true;
  } else {
    good = false;
  }
  printf(good ? "ok\n" : "error not understood: %s\n", line);
}

// Takes commands from standard input; its end is the end of the simulation.
static void take_commands(int timeout_ms) {
  static char text[1024];
  static size_t length;
  struct pollfd look = {STDIN_FILENO, POLLIN, 0};
  if (poll(&look, 1, timeout_ms) <= 0) return;
  const ssize_t got = read(STDIN_FILENO, text + length, sizeof text - 1 - length);
  if (got <= 0) {
    board.asked_to_quit = true;
    return;
  }
  length += (size_t)got;
  text[length] = '\0';
  char* end;
  while ((end = strchr(text, '\n')) != NULL) {
    *end = '\0';
    carry_out(text);
    length -= (size_t)(end + 1 - text);
    memmove(text, end + 1, length + 1);
  }
  fflush(stdout);
}

// Keeps the simulated time at the real one. A real board's clock does not stop when the computer is busy: a simulation
// that has fallen behind hurries after it, and what it sends is merely late; only a long stop is taken out of time.
static void wait_for_time(double* origin) {
  const double ahead = *origin + (double)board.avr->cycle / FREQUENCY - seconds();
  if (ahead > 0.0005) {
    take_commands(0);
    usleep((useconds_t)(ahead * 1e6));
  } else if (ahead < -1.0) {
    *origin -= ahead;
  }
}

static avr_uart_t* find_uart(avr_t* avr) {
  for (avr_io_t* each = avr->io_port; each != NULL; each = each->next) {
    if (strcmp(each->kind, "uart") == 0 && ((avr_uart_t*)each)->name == '0') return (avr_uart_t*)each;
  }
  return NULL;
}

static bool load(const char* firmware_path, const char* loader) {
  elf_firmware_t firmware = {0};
  if (elf_read_firmware(firmware_path, &firmware) != 0) return false;
  avr_t* avr = board.avr = avr_make_mcu_by_name("atmega328p");
  if (avr == NULL) return false;
  avr_init(avr);
  avr->log = LOG_NONE;
  firmware.frequency = FREQUENCY;
  avr_load_firmware(avr, &firmware);
  avr->sleep = no_sleep;
  avr->codeend = avr->flashend;
  board.uart = find_uart(avr);
  uint32_t flags = 0;
  avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);  // no sleeping while it polls, no copy on the console
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), from_board, NULL);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF), input_full, NULL);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON), input_free, NULL);
  avr_irq_register_notify(avr_get_interrupt_irq(avr, AVR_INT_ANY) + AVR_INT_IRQ_RUNNING, interrupt_entered, NULL);
  uint8_t* end_of_flash = avr->flash + avr->flashend - 1;
  if (strcmp(loader, "optiboot4") == 0) {
    board.loader = OPTIBOOT_4;
    memcpy(end_of_flash, "\x04\x04", 2);
  } else if (strcmp(loader, "optiboot6") == 0) {
    board.loader = OPTIBOOT_6;
    memcpy(end_of_flash, "\x02\x06", 2);
  } else if (strcmp(loader, "none") != 0) {
    uint32_t size, start;
    uint8_t* code = read_ihex_file(loader, &size, &start);
    if (code == NULL || start + size > avr->flashend + 1) return false;
    memcpy(avr->flash + start, code, size);
    avr->reset_pc = start;
    board.loader = REAL_LOADER;
  }
  return true;
}

int main(int count, char** arguments) {
  const bool with_loader = count == 4 && strcmp(arguments[2], "--loader") == 0;
  if (count != 2 && !with_loader) {
    fprintf(stderr, "use: simulator FIRMWARE.elf [--loader none|optiboot4|optiboot6|LOADER.hex]\n");
    return 2;
  }
  board.random = 88172645463325252ull;
  board.automatic_reset = board.powered = true;
  // simavr talks on standard output while it loads; the answers have that to themselves.
  const int answers = dup(STDOUT_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  const bool loaded = load(arguments[1], with_loader ? arguments[3] : "none");
  fflush(stdout);
  dup2(answers, STDOUT_FILENO);
  if (!loaded || !terminal_plug(&board.terminal)) {
    fprintf(stderr, "simulator: cannot load %s or make a pseudo-terminal\n", arguments[1]);
    return 1;
  }
  reset_by_name("power", false);
  printf("ok %s\n", board.terminal.name);
  fflush(stdout);
  double origin = seconds();
  while (!board.asked_to_quit) {
    const bool ran_before = board.paced || board.run_until > board.avr->cycle;
    take_commands(ran_before ? 0 : 20);
    if (!ran_before) origin = seconds() - (double)board.avr->cycle / FREQUENCY;
    if (terminal_opened(&board.terminal) && board.automatic_reset && board.powered) reset(EXTERNAL);
    from_host();
    const bool running = board.run_until > board.avr->cycle;
    if (!running && !board.paced) continue;
    const avr_cycle_count_t left = board.run_until - board.avr->cycle;
    if (!run(running && left < SLICE ? left : SLICE)) {
      printf("error the processor has crashed\n");
      return 1;
    }
    flush_line();
    if (running && board.avr->cycle >= board.run_until) {
      printf("ok %llu\n", (unsigned long long)board.avr->cycle);
      fflush(stdout);
    }
    if (!running) wait_for_time(&origin);
  }
  return 0;
}
