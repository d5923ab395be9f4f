"""Results of flexible bodies: sections, energies, range estimators, plots."""
