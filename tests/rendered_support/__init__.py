"""Recordings of a catheter in a box drawn by a path tracer (Mitsuba 3): a second opinion beside the digital twin.

Nothing here uses the twin or the tracker's camera model: optics, light, materials and manoeuvres are other ones.
"""
