"""C text from KernelIR, without SymPy because it runs at compile time."""
