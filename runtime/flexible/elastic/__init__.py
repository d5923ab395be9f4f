"""Elastic bodies from matrices and meshes: reduction, moments, stiffening."""

from .matrices import save_matrices as save_matrices
