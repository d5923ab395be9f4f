"""What `mstmm generate` writes: C, headers and stored kernels; never edited by hand."""
