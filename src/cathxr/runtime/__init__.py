"""Threads, slots and queues: what turns drivers, detectors and a tracker into a live system."""
