"""What the benchmarks share: scenes, peers, timing loops in C, rounds and their record."""
