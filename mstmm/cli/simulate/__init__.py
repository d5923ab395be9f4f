"""Command `mstmm simulate`: options, resumable run, saving and output."""
