"""The rooms: what is packaged, what the links reach, and what each room may import."""

from __future__ import annotations

import ast
import graphlib
import json
import re
import shutil
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import grimp
import pytest

from mstmm.runtime.libraries.build_extension import FOLDERS, INCLUDED_TEXT

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
SETUPTOOLS = PROJECT["tool"]["setuptools"]
ROOMS = ("derive", "templates", "generated", "runtime")

# The rooms of mstmm that join derivation and numbers, and the face that names what they offer.
BRIDGES = {"atlas", "cli", "pipeline"}


def room_folder(package: str) -> Path:
    """The real folder of a package, by the mapping that setuptools uses."""
    top, *rest = package.removeprefix("mstmm.").split(".")
    return ROOT.joinpath(top, *rest)


def python_files(room: str) -> list[Path]:
    """The Python files of one room; `mstmm` means the face and the leaves, without the links."""
    folder = ROOT / room
    return sorted(
        path
        for path in folder.rglob("*.py")
        if not any(parent.is_symlink() for parent in path.parents if ROOT in parent.parents)
    )


@cache
def nodes(path: Path) -> list[ast.AST]:
    """All nodes of a file."""
    return list(ast.walk(ast.parse(path.read_text())))


@cache
def imports(path: Path) -> list[tuple[int, str]]:
    """(level, dotted name) of each import in a file, wherever in it; level 0 is absolute."""
    return list(_imports(path))


def _imports(path: Path) -> Iterator[tuple[int, str]]:
    for node in nodes(path):
        if isinstance(node, ast.Import):
            yield from ((0, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (
                (node.level, f"{node.module or ''}.{alias.name}".strip(".")) for alias in node.names
            )


def loaded_after(statements: str) -> set[str]:
    """The modules present in a fresh interpreter that ran `statements`."""
    script = f"{statements}\nimport json, sys\nprint(json.dumps(sorted(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stdout.splitlines()[-1]))


def leaves() -> list[Path]:
    """Files of the rooms of mstmm that all others may use."""
    return [
        path
        for path in python_files("mstmm")
        if path.relative_to(ROOT / "mstmm").parts[0] not in {"__init__.py", "__main__.py", *BRIDGES}
    ]


def import_all(package: str, paths: Sequence[Path]) -> str:
    """Statements that import a package and every file below its folder (not `__init__`)."""
    folder = room_folder(package) if package != "mstmm" else ROOT / "mstmm"
    names = [path.relative_to(folder).with_suffix("").parts for path in sorted(paths)]
    modules = [package, *(".".join((package, *n)) for n in names if n[-1] != "__init__")]
    return "\n".join(f"import {module}" for module in modules)


def test_package_list_matches_the_tree() -> None:
    found = {"mstmm"}
    for room in ROOMS:
        for init in (ROOT / room).rglob("__init__.py"):
            found.add(".".join(("mstmm", *init.parent.relative_to(ROOT).parts)))
    found |= {
        ".".join(init.parent.relative_to(ROOT).parts)
        for init in python_files("mstmm")
        if init.name == "__init__.py"
    }
    assert set(SETUPTOOLS["packages"]) == found


@pytest.mark.parametrize("room", ["mstmm", *ROOMS])
def test_every_folder_of_code_is_a_package(room: str) -> None:
    bare = {
        path.parent for path in python_files(room) if not (path.parent / "__init__.py").exists()
    }
    assert not bare


@pytest.mark.parametrize("room", ROOMS)
def test_link_reaches_its_room(room: str) -> None:
    link = ROOT / "mstmm" / room
    assert link.is_symlink()
    assert link.readlink() == Path("..", room)
    assert (link / "__init__.py").samefile(ROOT / room / "__init__.py")


def test_an_editable_install_is_the_path_of_this_folder() -> None:
    """Not a finder in code, which no type checker follows."""
    script = (
        "import setuptools; from distutils.core import run_setup; "
        "project = run_setup('setup.py', ['editable_wheel'], stop_after='commandline'); "
        "command = project.get_command_obj('editable_wheel'); command.ensure_finalized(); "
        "assert command.package_dir == {'': '.'}, command.package_dir"
    )
    subprocess.run([sys.executable, "-c", script], cwd=ROOT, check=True)


@pytest.mark.parametrize(
    "folder", ["templates", "generated", "runtime/engine/c", "runtime/integrate/c"]
)
def test_data_files_are_packaged(folder: str) -> None:
    package = folder.removesuffix("/c")
    patterns = SETUPTOOLS["package-data"][f"mstmm.{package.replace('/', '.')}"]
    known = {path for pattern in patterns for path in (ROOT / package).glob(pattern)}
    built = {"__init__.py", "__pycache__", ".clang-format"}
    forgotten = {
        path
        for path in (ROOT / folder).iterdir()
        if path not in known and path.name not in built and path.suffix != ".so"
    }
    assert known
    assert not forgotten


def test_every_folder_of_c_is_built() -> None:
    """The lists of the builder, and of editors and sanitizers, name what there is."""
    found = {
        path.parent.relative_to(ROOT)
        for room in ROOMS
        for ending in ("*.c", "*.h")
        for path in (ROOT / room).rglob(ending)
    }
    assert {*FOLDERS, INCLUDED_TEXT} == found
    flags = (ROOT / "compile_flags.txt").read_text().split()
    assert {Path(flag[2:]) for flag in flags if flag.startswith("-I")} == found


def test_import_of_the_face_is_light() -> None:
    heavy = {"numpy", "scipy", "sympy", "pydantic", "cffi", "jinja2", "typer", "rich"}
    rooms = {f"mstmm.{room}" for room in ROOMS}
    assert not loaded_after("import mstmm") & (heavy | rooms)


def test_leaves_need_no_room() -> None:
    loaded = loaded_after(import_all("mstmm", leaves()))
    rooms = {f"mstmm.{room}" for room in ROOMS if room != "generated"}  # they read its data
    assert not loaded & {"sympy", "jinja2", "cffi", *rooms}


def test_leaves_name_no_room() -> None:
    # Not even inside a function: what joins the rooms is listed above.
    named = [
        (path.name, name)
        for path in leaves()
        for _, name in imports(path)
        if {*name.split(".")[:2]} & {"sympy", "jinja2", "cffi", *ROOMS}
    ]
    assert not named


def test_runtime_needs_no_derivation() -> None:
    loaded = loaded_after(import_all("mstmm.runtime", python_files("runtime")))
    assert "mstmm.runtime" in loaded
    assert not loaded & {"sympy", "jinja2", "mstmm.derive", "mstmm.templates"}


def test_derivation_needs_no_numbers() -> None:
    loaded = loaded_after(import_all("mstmm.derive", python_files("derive")))
    assert "sympy" in loaded
    assert not loaded & {"numpy", "scipy", "cffi", "mstmm.runtime", "mstmm.generated"}


@pytest.mark.parametrize("room", ["derive", "runtime"])
def test_imports_inside_a_room_are_relative(room: str) -> None:
    absolute = [
        (path.name, name)
        for path in python_files(room)
        for level, name in imports(path)
        if level == 0 and (name.split(".")[0] in ROOMS or name.startswith(f"mstmm.{room}"))
    ]
    assert not absolute


def test_jinja_is_used_in_one_file() -> None:
    users = {
        path.relative_to(ROOT).as_posix()
        for room in ("mstmm", *ROOMS)
        for path in python_files(room)
        for _, name in imports(path)
        if name.split(".")[0] == "jinja2"
    }
    assert users == {"derive/codegen/template_rendering.py"}


def test_import_contracts_hold() -> None:
    linter = shutil.which("lint-imports", path=str(Path(sys.executable).parent))
    assert linter, "import-linter is part of the extra 'test'"
    done = subprocess.run(
        [linter, "--no-cache"], capture_output=True, text=True, check=False, cwd=ROOT
    )
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("room", ["mstmm", "derive", "runtime", "tests"])
def test_a_folder_is_seen_at_one_glance(room: str) -> None:
    flat = Counter(path.parent.relative_to(ROOT).as_posix() for path in python_files(room))
    assert not {folder: count for folder, count in flat.items() if count > 23}


@pytest.mark.parametrize("room", ["mstmm", "derive", "runtime"])
def test_a_function_is_seen_at_one_glance(room: str) -> None:
    """At most 60 lines, signature and docstring included."""
    long = [
        f"{path.relative_to(ROOT)}:{node.lineno} {node.name}"
        for path in python_files(room)
        for node in nodes(path)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and (node.end_lineno or 0) - node.lineno >= 60
    ]
    assert not long


def test_private_names_stay_in_their_module() -> None:
    taken = [
        (path.name, name)
        for room in ("mstmm", "derive", "runtime")
        for path in python_files(room)
        for _, name in imports(path)
        if any(re.match(r"_[a-zA-Z]", part) for part in name.split("."))
    ]
    assert {name for _, name in taken} <= {"mstmm.generated._kernels", "_ctypes", "_signal"}


HINGES = {"pin", "prismatic", "screw", "cylindrical", "universal", "ball", "gimbal"}
#: Words that mean other things too.
AMBIGUOUS = {"fixed", "planar", "free", "elastic"}


def by_name(node: ast.AST) -> bool:
    """Whether a comparison, or the keys of a table, go by the name of a hinge."""
    if isinstance(node, ast.Dict):
        return any(isinstance(key, ast.Constant) and key.value in HINGES for key in node.keys)
    if not isinstance(node, ast.Compare):
        return False
    words = {
        one.value for one in ast.walk(node)
        if isinstance(one, ast.Constant) and isinstance(one.value, str)
    }  # fmt: skip
    asks_type = any(isinstance(one, ast.Attribute) and one.attr == "type" for one in ast.walk(node))
    return bool(words & HINGES) or (asks_type and bool(words & AMBIGUOUS))


def test_nothing_goes_by_the_name_of_a_hinge() -> None:
    folders = ("runtime", "mstmm/scene", "mstmm/pipeline", "derive")
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for folder in folders
        for path in python_files(folder)
        if path.parent not in (ROOT / "derive" / "elements", ROOT / "derive" / "classical")
        for node in nodes(path)
        if isinstance(node, ast.expr) and by_name(node)
    ]
    assert not found


#: What reads a scene's numbers out of C, or recognises something by its address.
READS_BACK = re.compile(
    r"\.unpack\(|uintptr_t|records\.column\(|\.model\.(bodies|laws|loads|forces|drives|n_\w+)\b"
)


def test_nothing_is_read_back_out_of_c() -> None:
    """A scene's numbers are in its System; C records are the business of one room."""
    found = {
        path.relative_to(ROOT).as_posix()
        for folder in ("runtime", "mstmm/pipeline")
        for path in python_files(folder)
        if READS_BACK.search(path.read_text())
    }
    libraries = {"runtime/kernels/kernel_store.py"}  # hands a library's symbol on
    assert not {one for one in found - libraries if not one.startswith("runtime/packing/records/")}


def test_no_module_imports_itself_in_the_end() -> None:
    """Imports inside functions and for the type checker count like any other."""
    graph = grimp.build_graph("mstmm")
    imported = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    rooms = {n: found for n, found in imported.items() if n.split(".")[1:2] != ["cli"]}
    assert len(rooms) > 300
    graphlib.TopologicalSorter(rooms).prepare()  # CycleError tells the way around


def test_links_between_the_pages_lead_somewhere() -> None:
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").rglob("*.md")]
    dead = [
        (page.relative_to(ROOT).as_posix(), target)
        for page in pages
        for target in re.findall(r"\]\(([^)#\s]+)", page.read_text())
        if "://" not in target and not (page.parent / target).exists()
    ]
    assert pages
    assert not dead
