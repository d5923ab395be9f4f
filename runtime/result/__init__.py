"""What a run gave: quantities, certificate, files, tables and pictures."""
