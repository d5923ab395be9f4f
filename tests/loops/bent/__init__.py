"""Closed loops that flexible bodies are part of."""
