// The encoder's channels played into the simulated processor's pins, to the cycle.
#ifndef EDGES_H
#define EDGES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "sim_avr.h"

typedef struct {
  uint64_t* edges;  // each: cycles after the start * 4 + the inputs from then on (bit 0 is A, bit 1 is B)
  size_t length;
  size_t next;
  avr_cycle_count_t start;
  uint8_t inputs;
} edges_t;

// Reads a file of little-endian 64-bit edges and plays it from `start` on; returns false where it cannot be read.
bool edges_play(edges_t* edges, const char* path, avr_t* avr, avr_cycle_count_t start);

// Puts the pins in order and goes on playing; after every reset.
void edges_resume(edges_t* edges, avr_t* avr);

// Lets the edges up to `cycle` pass while the processor is not running (it is held in reset, or without power).
void edges_skip(edges_t* edges, avr_cycle_count_t cycle);

#endif
