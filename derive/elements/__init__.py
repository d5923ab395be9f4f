"""Built-in elements, one per file; the registry walks this folder."""
