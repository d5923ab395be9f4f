"""Writes link.msh: a tapered block of hexahedra, in mm, with its two ends as named surfaces.

python examples/elastic_link/make_mesh.py
"""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import skfem
import skfem.io.meshio

LENGTH, ROOT, TIP = 500.0, (50.0, 16.0), (30.0, 10.0)  # mm; width and height of both ends


def main() -> None:
    """12 x 2 x 1 hexahedra; width and height fall linearly."""
    lines = (np.linspace(0, LENGTH, 13), np.linspace(-0.5, 0.5, 3), np.linspace(-0.5, 0.5, 2))
    mesh = skfem.MeshHex.init_tensor(*lines)
    points = mesh.p.copy()
    for axis, (first, last) in enumerate(zip(ROOT, TIP, strict=True), 1):
        points[axis] *= first + (last - first) * points[0] / LENGTH
    ends = [mesh.facets_satisfying(lambda x, at=at: np.isclose(x[0], at)) for at in (0, LENGTH)]
    squares = np.vstack([mesh.facets[:, end].T for end in ends])
    groups = [np.repeat([1, 2], [len(end) for end in ends]), np.full(mesh.nelements, 3)]
    cells = skfem.io.meshio.to_meshio(mesh).cells[0].data
    written = meshio.Mesh(
        points.T, [("quad", squares), ("hexahedron", cells)],
        cell_data={"gmsh:physical": groups, "gmsh:geometrical": groups},
        field_data={"root": np.array([1, 2]), "tip": np.array([2, 2]), "link": np.array([3, 3])},
    )  # fmt: skip
    path = Path(__file__).parent / "link.msh"
    meshio.write(path, written, file_format="gmsh22", binary=False)
    print(f"wrote {path}")


if __name__ == "__main__":
    main()
