"""What the operating system gives: files, locks, processes and interrupts."""
