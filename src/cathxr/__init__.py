"""Catheter tracking from two cameras, roll from an encoder, live in an XR scene. Training and research only."""

__version__ = "0.1.0"
