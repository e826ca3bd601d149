#include "edges.h"

#include <stdio.h>
#include <stdlib.h>

#include "avr_extint.h"
#include "avr_ioport.h"
#include "sim_cycle_timers.h"

static void drive(edges_t* edges, avr_t* avr) {
  // The pull-ups of INPUT_PULLUP would win over what is driven from outside if it were not declared as such, too.
  avr_ioport_external_t outside = {.name = 'D', .mask = 0x0C, .value = (uint8_t)(edges->inputs << 2)};
  avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL('D'), &outside);
  avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 2), edges->inputs & 1);
  avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 3), edges->inputs >> 1);
}

static avr_cycle_count_t next_edge(avr_t* avr, avr_cycle_count_t when, void* param) {
  edges_t* edges = param;
  while (edges->next < edges->length) {
    const avr_cycle_count_t due = edges->start + (edges->edges[edges->next] >> 2);
    if (due > avr->cycle) return due;
    edges->inputs = edges->edges[edges->next++] & 3;
    drive(edges, avr);
  }
  return 0;
}

static void schedule(edges_t* edges, avr_t* avr) {
  avr_cycle_timer_cancel(avr, next_edge, edges);
  if (edges->next == edges->length) return;
  const avr_cycle_count_t due = edges->start + (edges->edges[edges->next] >> 2);
  avr_cycle_timer_register(avr, due > avr->cycle ? due - avr->cycle : 1, next_edge, edges);
}

bool edges_play(edges_t* edges, const char* path, avr_t* avr, avr_cycle_count_t start) {
  FILE* file = fopen(path, "rb");
  if (file == NULL) return false;
  fseek(file, 0, SEEK_END);
  const long size = ftell(file);
  rewind(file);
  free(edges->edges);
  edges->length = (size_t)size / sizeof *edges->edges;
  edges->edges = malloc((size_t)size + 1);
  edges->next = 0;
  edges->start = start;
  const bool whole = fread(edges->edges, sizeof *edges->edges, edges->length, file) == edges->length;
  fclose(file);
  if (!whole) edges->length = 0;
  schedule(edges, avr);
  return whole;
}

void edges_resume(edges_t* edges, avr_t* avr) {
  // Out of reset simavr takes both interrupts for level-triggered and asks the pin at every cycle: not so here.
  avr_extint_set_strict_lvl_trig(avr, 0, 0);
  avr_extint_set_strict_lvl_trig(avr, 1, 0);
  // A reset clears the pin register, but a pin that is driven as before is not driven at all: first the opposite.
  edges->inputs ^= 3;
  drive(edges, avr);
  edges->inputs ^= 3;
  drive(edges, avr);
  schedule(edges, avr);
}

void edges_skip(edges_t* edges, avr_cycle_count_t cycle) {
  while (edges->next < edges->length && edges->start + (edges->edges[edges->next] >> 2) <= cycle) {
    edges->inputs = edges->edges[edges->next++] & 3;
  }
}
