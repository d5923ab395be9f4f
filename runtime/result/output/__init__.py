"""Ways out of a result: Datasets, files, tables and pictures."""
