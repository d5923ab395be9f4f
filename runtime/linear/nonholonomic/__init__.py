"""Linear models of scenes with nonholonomic rows: rolling contacts, couplings of speeds."""
