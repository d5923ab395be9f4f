"""Conversion of robots in other file formats to scenes, and back."""
