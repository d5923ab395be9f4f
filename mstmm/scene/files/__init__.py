"""Scenes as text: reading files, writing TOML."""
