"""Export of a result: datasets, files and tables."""
