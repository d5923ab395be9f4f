"""Built-in elements, one per file; the registry imports every file of this folder."""
