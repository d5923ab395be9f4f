"""What several test files use: compiling C text and drawing random kernels."""
