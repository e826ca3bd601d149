#define _XOPEN_SOURCE 600
#define _DEFAULT_SOURCE
#include "pseudo_terminal.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

bool terminal_plug(terminal_t* terminal) {
  const int master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
  if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0) return false;
  snprintf(terminal->name, sizeof terminal->name, "%s", ptsname(master));
  // Raw before anyone opens it: the host's first bytes must not be echoed or translated. Opening and closing it once
  // also makes the master say "nobody there" from now on.
  const int slave = open(terminal->name, O_RDWR | O_NOCTTY);
  struct termios settings;
  if (slave < 0 || tcgetattr(slave, &settings) != 0) return false;
  cfmakeraw(&settings);
  tcsetattr(slave, TCSANOW, &settings);
  close(slave);
  terminal->master = master;
  terminal->held_open = false;
  return true;
}

void terminal_unplug(terminal_t* terminal) {
  if (terminal->master >= 0) close(terminal->master);
  terminal->master = -1;
  terminal->held_open = false;
}

bool terminal_opened(terminal_t* terminal) {
  if (terminal->master < 0) return false;
  struct pollfd look = {terminal->master, POLLIN, 0};
  const bool open_now = poll(&look, 1, 0) >= 0 && (look.revents & POLLHUP) == 0;
  const bool opened = open_now && !terminal->held_open;
  terminal->held_open = open_now;
  return opened;
}

void terminal_send(terminal_t* terminal, const unsigned char* bytes, size_t length) {
  while (terminal->master >= 0 && terminal->held_open && length > 0) {
    const ssize_t sent = write(terminal->master, bytes, length);
    if (sent > 0) {
      bytes += sent;
      length -= (size_t)sent;
    } else if (errno != EINTR) {
      return;
    }
  }
}

size_t terminal_receive(terminal_t* terminal, unsigned char* bytes, size_t room) {
  if (terminal->master < 0) return 0;
  const ssize_t got = read(terminal->master, bytes, room);
  return got > 0 ? (size_t)got : 0;
}
