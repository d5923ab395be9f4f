"""Switching times and narrow features of a scene's expressions, by interval arithmetic."""
