"""The sweep as data: passes, and what each does with a body, by calls of kernels on slots."""
