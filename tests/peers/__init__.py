"""Comparisons with Pinocchio and MuJoCo, in an environment of their own."""
