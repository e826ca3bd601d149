"""Tests of study stores."""
