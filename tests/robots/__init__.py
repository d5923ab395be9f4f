"""Tests of robots read from the formats of others."""
