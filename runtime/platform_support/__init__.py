"""Services of the operating system: files, locks, processes and interrupts."""
