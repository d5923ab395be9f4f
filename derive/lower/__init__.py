"""Matrix equations become KernelIR."""
