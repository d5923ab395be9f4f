"""Results of runs: quantities, certificate, files, tables and plots."""
