"""Scene files: reading TOML and JSON, writing TOML."""
