"""Cases of sweeps over the bodies."""
