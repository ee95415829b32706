"""The house rules that a program can check: layers, who may import what, docstrings, type hints."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from samples import ROOT

import persp_sw

PACKAGE = ROOT / "persp_sw"

# DESIGN, "Packages": a module sees its own rank and those below. The first name that fits counts.
RANKS = {
    "persp_sw.errors": 0,
    "persp_sw.arrays": 0,
    "persp_sw.cancel": 0,
    "persp_sw._jit": 0,
    "persp_sw.settings": 1,
    "persp_sw.images": 1,
    "persp_sw.kernels": 1,
    "persp_sw.volume": 2,
    "persp_sw.optics": 2,
    "persp_sw.geometry": 2,
    "persp_sw.eye_image": 3,
    "persp_sw.marks": 3,
    "persp_sw.planning": 3,
    "persp_sw.probe": 3,
    "persp_sw.sampling": 3,
    "persp_sw.slabs": 3,
    "persp_sw.compositor": 3,
    "persp_sw.warp": 3,
    "persp_sw.quality": 3,
    "persp_sw.reference": 3,
    "persp_sw.renderer": 4,
    "persp_sw.measure": 4,
    "persp_sw.scene": 5,
    "persp_sw.scene_look": 5,
    "persp_sw.scene_schema": 5,
    "persp_sw.commands": 6,
    "persp_sw.cli": 7,
    "persp_sw.__main__": 8,
}
# The same for the plug-in: a package or module sees itself and those of lower rank.
VR_RANKS = {
    "pose": 0, "stereo": 0, "worker": 0,
    "rig": 1, "projection": 1,
    "eyes": 2, "placement": 2, "screen": 2,
    "cameras": 3, "rigs": 3, "trackers": 3, "present": 3, "window": 3, "host_view": 3,
    "depths": 3, "moment": 3, "pacing": 3,
    "frame": 4, "formats": 4, "room": 4, "rest_watch": 4, "film": 4,
    "host": 5, "marks": 5, "steady": 5,
    "loop": 6,
    "shown": 7,
    "beside": 8, "record": 8,
    "cave": 9, "preview": 9,
    "panel": 10,
    "commands": 11, "examples": 10,
}  # fmt: skip
REFERENCE_SEES = {
    "persp_sw.volume.grid",
    "persp_sw.volume.gradient",
    "persp_sw.optics.transfer",
    "persp_sw.optics.transfer2d",
    "persp_sw.optics.lighting",
    "persp_sw.optics.look",
    "persp_sw.geometry.view",
    "persp_sw.geometry.regions",
    "persp_sw.arrays",
    "persp_sw.errors",
    "persp_sw._jit",
}
# Package -> the only modules that may import it.
RESERVED = {
    "numba": {"persp_sw._jit"},
    "llvmlite": {
        f"persp_sw.{name}" for name in ("_jit", "kernels.lanes", "kernels.packet_vector", "kernels.warp")
    },
    # gl_objects: programs, textures and kept state, which serve eye_target, present (stereo) and shapes
    # (rooms, text): each has its own reason to change.
    "OpenGL": {
        *(f"persp_sw.warp.{name}" for name in ("texture", "context")),
        "vr_plugin.present",
        *(f"vr_plugin.screen.{name}" for name in ("eye_target", "gl_objects", "shapes")),
    },
    "glfw": {"vr_plugin.window"},
    # frontend: context, input and drawing; the others: widgets. What they edit knows nothing of them.
    "imgui_bundle": {
        f"vr_plugin.panel.{name}"
        for name in ("frontend", "sections", "light_section", "shape_plot", "tf_plot", "view_handles")
    },
    # A host that is not ours, in the example of the plug-in only: nobody needs these packages to use it.
    "moderngl": {f"vr_plugin.examples.moderngl_{part}" for part in ("host", "scene")},
    "moderngl_window": {"vr_plugin.examples.moderngl_host"},
    "pyglm": {"vr_plugin.examples.moderngl_host"},
    "socket": {f"vr_plugin.trackers.{name}" for name in ("dtrack", "vrpn_client", "vrpn_server")},
}


def module_name(path: Path) -> str:
    parts = list(path.relative_to(ROOT).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def modules(*folders: str) -> dict[str, Path]:
    return {module_name(path): path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))}


OURS = modules("persp_sw")
BOTH = modules("persp_sw", "vr_plugin")


def code_of(tree: ast.AST) -> Iterator[ast.AST]:
    """All nodes but those under `if TYPE_CHECKING:`, which are never run."""
    for child in ast.iter_child_nodes(tree):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test):
            continue
        yield child
        yield from code_of(child)


def imports(name: str) -> set[str]:
    """Full names of all that a module imports, in functions too: modules, or names in modules."""
    path = BOTH[name]
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found = set()
    for node in code_of(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                home = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*home, base] if base else home)
            found |= {f"{base}.{alias.name}" for alias in node.names}
    return found


def module_of(full: str) -> str | None:
    """The module of ours that an imported name lies in."""
    while full and full not in BOTH:
        full = full.rpartition(".")[0]
    return full or None


def rank(name: str) -> int:
    while name and name not in RANKS:
        name = name.rpartition(".")[0]
    if not name:
        pytest.fail("a module has no rank; add it to RANKS where DESIGN draws it")
    return RANKS[name]


def seen(name: str) -> set[str]:
    return {module for full in imports(name) if (module := module_of(full)) and module != name}


@pytest.mark.parametrize("name", [name for name in OURS if name != "persp_sw"])
def test_imports_point_downwards(name: str):
    # `from . import __version__` names the package itself, which imports nothing until it is used.
    above = {other for other in seen(name) - {"persp_sw"} if rank(other) > rank(name)}
    assert not above, f"{name} imports from above: {sorted(above)}"


@pytest.mark.parametrize("name", [name for name in BOTH if name.startswith("vr_plugin.")])
def test_the_plugin_imports_point_downwards(name: str):
    own = name.split(".")[1]
    others = {module.split(".")[1] for module in seen(name) if module.startswith("vr_plugin.")} - {own}
    above = {other for other in others if VR_RANKS[other] >= VR_RANKS[own]}
    assert not above, f"{name} imports from above or beside: {sorted(above)}"


def test_no_module_imports_itself_in_a_circle():
    state: dict[str, int] = {}

    def visit(name: str, path: tuple[str, ...]) -> None:
        if state.get(name) == 1:
            pytest.fail(f"import circle: {' > '.join([*path[path.index(name) :], name])}")
        if name in state:
            return
        state[name] = 1
        for other in seen(name) - {"persp_sw"}:
            visit(other, (*path, name))
        state[name] = 2

    for name in BOTH:
        visit(name, ())


def test_import_of_the_package_imports_nothing_of_ours():
    assert seen("persp_sw") == set()


@pytest.mark.parametrize("name", [name for name in OURS if name.startswith("persp_sw.kernels.")])
def test_kernels_see_only_jit_numpy_and_kernels(name: str):
    # Of one another, too: numba's cache would miss an edit there, but its folder is keyed on all sources.
    assert all(other == "persp_sw._jit" or other.startswith("persp_sw.kernels.") for other in seen(name))
    outside = {full.split(".")[0] for full in imports(name)} - {"persp_sw"}
    assert outside <= {"numpy", "typing", "__future__", "llvmlite"}  # llvmlite: see RESERVED


@pytest.mark.parametrize("name", [name for name in OURS if f"{name}.".startswith("persp_sw.reference.")])
def test_the_reference_shares_nothing_with_what_it_judges(name: str):
    own = {other for other in OURS if other.startswith("persp_sw.reference.")}
    assert seen(name) - own <= REFERENCE_SEES


@pytest.mark.parametrize("name", BOTH)
def test_reserved_packages_stay_in_their_files(name: str):
    used = {full.split(".")[0] for full in imports(name)}
    for package, homes in RESERVED.items():
        assert package not in used or name in homes, f"{name} imports {package}"


@pytest.mark.parametrize("name", OURS)
def test_the_renderer_knows_no_plugin(name: str):
    assert not any(full.split(".")[0] == "vr_plugin" for full in imports(name))


@pytest.mark.parametrize("name", [name for name in BOTH if name.startswith("vr_plugin")])
def test_the_plugin_sees_public_names_only(name: str):
    public = {f"persp_sw.{other}" for other in persp_sw.__all__} | {"persp_sw", "persp_sw.errors"}
    if name.startswith("vr_plugin.commands."):  # the command line's own tools serve commands of others, too
        public |= {f"persp_sw.commands.{tool}" for tool in ("options", "output")}
    ours = {full for full in imports(name) if full.split(".")[0] == "persp_sw"}
    tools = ("persp_sw.errors.", *(f"{tool}." for tool in public if ".commands." in tool))
    assert all(full in public or full.startswith(tools) for full in ours), sorted(ours - public)


def public_functions(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    """Functions of a module and methods of its public classes, by public names."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            yield node
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from (n for n in node.body if isinstance(n, ast.FunctionDef) and not n.name.startswith("_"))


def is_overload_or_setter(function: ast.FunctionDef) -> bool:
    return any(isinstance(d, ast.Attribute) and d.attr == "setter" for d in function.decorator_list)


@pytest.mark.parametrize("name", [name for name in BOTH if not name.rpartition(".")[2].startswith("_")])
def test_public_things_have_docstrings(name: str):
    tree = ast.parse(BOTH[name].read_text())
    silent = [
        f.name for f in public_functions(tree) if not ast.get_docstring(f) and not is_overload_or_setter(f)
    ]
    silent += [
        node.name
        for node in tree.body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_") and not ast.get_docstring(node)
    ]
    assert not silent, f"{name}: no docstring: {silent}"
    assert ast.get_docstring(tree) or not tree.body, f"{name} has no docstring"


def bare(function: ast.FunctionDef) -> list[str]:
    """Parameters (and `return`) without a type hint."""
    arguments = function.args
    every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    every += [extra for extra in (arguments.vararg, arguments.kwarg) if extra]
    names = [a.arg for a in every if a.annotation is None and a.arg not in ("self", "cls")]
    return names + ([] if function.returns else ["return"])


@pytest.mark.parametrize(
    "name",
    # numba infers the kernels' types from the arrays; their docstrings state them.
    [n for n in BOTH if not n.rpartition(".")[2].startswith("_") and not n.startswith("persp_sw.kernels")],
)
def test_public_things_have_type_hints(name: str):
    tree = ast.parse(BOTH[name].read_text())
    untyped = {f.name: missing for f in public_functions(tree) if (missing := bare(f))}
    assert not untyped, f"{name}: no type hints: {untyped}"


def test_every_public_name_can_be_imported():
    for name in persp_sw.__all__:
        assert getattr(persp_sw, name) is not None
    assert set(persp_sw.__all__) <= set(dir(persp_sw))
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = persp_sw.nonsense
