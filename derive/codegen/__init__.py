"""KernelIR becomes C text.  No SymPy: somebody waits."""
