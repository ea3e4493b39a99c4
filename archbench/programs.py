"""Programs of the bench: manifests of their adapters, and an environment for each.

A manifest is read from the text of an adapter without importing it, since the program may not be
installed where the bench runs.
"""

import ast
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from archbench.scene import ACTIONS, HERE, BenchError

ADAPTERS = HERE / "adapters"
# Beginning of the reason where an adapter does not answer a kind of action
NO_ACTION = "the adapter has no action"

ENVIRONMENTS = HERE / "environments"


@dataclass(frozen=True)
class Program:
    """A program, by its adapter.

    Attributes:
        name: of the adapter's file.
        adapter: path of the file.
        needs: packages that pip installs in an environment of its own.
        settings: by action, values of numerical settings; each is run.
        cannot: by scene, or start of its name, why the program has no answer.
        python: "own" for an environment of its own, "bench" for that of the bench, or a path.
    """

    name: str
    adapter: Path
    needs: tuple[str, ...]
    settings: dict[str, list[dict[str, Any]]]
    cannot: dict[str, str] = field(default_factory=dict)
    python: str = "own"

    @property
    def answers(self) -> set[str]:
        """Actions that the program supports."""
        return set(self.settings)

    @property
    def executable(self) -> Path:
        """The Python that runs the adapter."""
        if self.python == "bench":
            return Path(sys.executable)
        return (
            ENVIRONMENTS / self.name / "bin/python" if self.python == "own" else Path(self.python)
        )

    def refusal(self, scene: dict[str, Any]) -> str:
        """Return why the program has no answer to a scene; empty where it should have one."""
        stated = [why for start, why in self.cannot.items() if scene["id"].startswith(start)]
        if stated:
            return stated[0]
        kind = scene["action"]["kind"]
        return "" if kind in self.settings else f"{NO_ACTION} '{kind}'"

    def is_installed(self) -> bool:
        """Return whether the adapter can be imported by its Python."""
        if not self.executable.exists():
            return False
        test = "import sys, worker, pathlib; worker.load(pathlib.Path(sys.argv[1])).version()"
        command = [str(self.executable), "-c", test, str(self.adapter)]
        return _quiet(command, 120.0).returncode == 0

    def install(self) -> str:
        """Install the program where it is not; return why that failed, or nothing."""
        if self.is_installed():
            return ""
        if self.python != "own":
            return f"{self.executable} cannot import it"
        folder = ENVIRONMENTS / self.name
        make = _quiet([sys.executable, "-m", "venv", "--clear", str(folder)], 120.0)
        pip = [str(self.executable), "-m", "pip", "install", "-q", "--only-binary", ":all:"]
        done = make if make.returncode else _quiet([*pip, *self.needs], 600.0)
        if done.returncode:
            return (done.stderr.strip().splitlines() or ["no message"])[-1]
        return "" if self.is_installed() else "it was installed, and its adapter cannot be imported"


def _quiet(command: Sequence[str], limit: float) -> subprocess.CompletedProcess[str]:
    """Run a command in the folder of the bench, with a time limit [s]."""
    try:
        return subprocess.run(
            command, cwd=HERE, capture_output=True, text=True, timeout=limit, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return subprocess.CompletedProcess(command, 1, "", str(error))


def read_manifest(path: Path) -> Program:
    """Return the program of an adapter: literal values that its file assigns.

    Raises:
        BenchError: a value is missing, no literal, or names an unknown action.
    """
    found: dict[str, Any] = {}
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        if isinstance(node, ast.AnnAssign):
            targets = [node.target]
        names = {target.id for target in targets if isinstance(target, ast.Name)}
        for name in names & {"needs", "settings", "cannot", "python"}:
            assert isinstance(node, ast.Assign | ast.AnnAssign)
            assert node.value is not None
            try:
                found[name] = ast.literal_eval(node.value)
            except ValueError as error:
                raise BenchError(f"{path.name}: {name} is no literal value") from error
    if missing := {"needs", "settings"} - set(found):
        raise BenchError(f"{path.name}: {sorted(missing)} are missing")
    if unknown := set(found["settings"]) - set(ACTIONS):
        raise BenchError(f"{path.name}: actions {sorted(unknown)} are unknown")
    found["needs"] = tuple(found["needs"])
    return Program(path.stem, path, **found)


def programs(folder: Path = ADAPTERS) -> list[Program]:
    """Return all programs, archfem first."""
    paths = sorted(folder.glob("*.py"), key=lambda path: (path.stem != "archfem", path.stem))
    return [read_manifest(path) for path in paths]
