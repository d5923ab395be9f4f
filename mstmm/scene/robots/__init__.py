"""Robots described in the formats of others -> scenes."""
