"""Files in and out: the rig, pictures and videos, tables, the track CSV, overlays, and sessions."""
