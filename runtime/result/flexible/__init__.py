"""What results say of flexible bodies: sections, energies, estimators, pictures."""
