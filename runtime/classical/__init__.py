"""The classical discrete-time method: scenes as its records, motions back to q and u; C in `c/`."""
