"""Lowering of matrix equations to KernelIR."""
