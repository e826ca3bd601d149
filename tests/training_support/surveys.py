"""Surveys that tests of several parts ask."""

WITH_WORDS = """schema = "cathxr-survey/1"
key = "course"
name = "After the course"
instruction = "Please answer from 1 to 5."
[scale]
minimum = 1.0
maximum = 5.0
low = "not at all"
high = "very"
[[items]]
key = "clear"
text = "How clear was the task?"
[[items]]
key = "remark"
text = "Anything else?"
kind = "words"
"""
"""A scale, and an item that is answered in words."""
