"""Tests of studies' designs, allocation, surveys, exclusion and the board."""
