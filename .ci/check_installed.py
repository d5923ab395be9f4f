"""Is the installed wheel whole, and is it what gets imported?  Run where the wheel is installed.

Usage: python check_installed.py CHECKOUT
"""

import importlib
import sys
import tomllib
from pathlib import Path

checkout = Path(sys.argv[1]).resolve()
setuptools = tomllib.loads((checkout / "pyproject.toml").read_text())["tool"]["setuptools"]
mapping = setuptools["package-dir"]

for name in setuptools["packages"]:
    module = importlib.import_module(name)
    folder = Path(module.__file__ or "").resolve().parent
    assert checkout not in folder.parents, f"{name} was imported from the checkout"
    mapped = next(m for m in sorted(mapping, reverse=True) if f"{name}.".startswith(f"{m}."))
    real = checkout.joinpath(mapping[mapped], *name.removeprefix(mapped).split(".")[1:])
    for pattern in ("*.py", *setuptools["package-data"].get(name, [])):
        wanted = {path.relative_to(real) for path in real.glob(pattern)}
        missing = {str(path) for path in wanted if not (folder / path).is_file()}
        assert not missing, f"{name} lacks {sorted(missing)}"

kernels = importlib.import_module("mstmm.generated._kernels")
assert kernels.lib.mstmm_element_count > 0
print(f"{len(setuptools['packages'])} packages, {kernels.lib.mstmm_element_count} elements")
