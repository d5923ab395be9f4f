"""Linear models beside motions with rolling contacts and rows of speeds."""
