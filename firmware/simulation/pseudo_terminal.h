// A pseudo-terminal in place of the USB cable: what pyserial opens as the board's port.
#ifndef PSEUDO_TERMINAL_H
#define PSEUDO_TERMINAL_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
  int master;       // -1 where it is unplugged
  char name[64];    // of the end that the host opens
  bool held_open;   // whether the host had it open at the last look
} terminal_t;

// Makes a new one; returns false with errno set where the system gives none.
bool terminal_plug(terminal_t* terminal);

// Takes it away: whoever has it open sees the device gone.
void terminal_unplug(terminal_t* terminal);

// Returns whether the host opened it since the last look: a real port's DTR line would fall, and reset a Nano.
bool terminal_opened(terminal_t* terminal);

// Sends; what nobody receives is gone, and what a host does not fetch in time, as on a real port.
void terminal_send(terminal_t* terminal, const unsigned char* bytes, size_t length);

// Returns how many bytes came from the host, 0 where none did.
size_t terminal_receive(terminal_t* terminal, unsigned char* bytes, size_t room);

#endif
