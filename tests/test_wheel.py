"""What people get from ``pip install ddsi``: what the wheel holds and says, and that the core needs trio alone."""

from __future__ import annotations

import email
import email.message
import importlib.util
import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# Import name and folder.
IMPORT_PACKAGES = {"ddsi": ROOT / "ddsi", "ddsi_security": ROOT / "security"}


def _modules(name: str, folder: Path) -> Iterator[str]:
    """The files that belong to an import package, as the wheel names them."""
    for path in [*folder.rglob("*.py"), *folder.rglob("*.xsd"), folder / "py.typed"]:
        yield f"{name}/{path.relative_to(folder).as_posix()}"


def test_every_package_is_listed() -> None:
    """setuptools takes only the packages that pyproject.toml lists; a new room would silently be missing."""
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["packages"]
    present = {
        module.rpartition("/")[0].replace("/", ".")
        for name, folder in IMPORT_PACKAGES.items()
        for module in _modules(name, folder)
    }
    assert len(listed) == len(set(listed))
    assert set(listed) - present == set(), "gone, but still listed in pyproject.toml under [tool.setuptools]"
    assert present - set(listed) == set(), "new: list them in pyproject.toml under [tool.setuptools]"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from a copy of what it is made of, so that nothing built before finds its way in."""
    source = tmp_path_factory.mktemp("source")
    for name in ("pyproject.toml", "LICENSE", "README.md"):
        if (ROOT / name).exists():
            shutil.copy(ROOT / name, source)
    for name in ("ddsi", "security", "tests"):  # the last must stay out
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    target = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(target), str(source)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    (built,) = target.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def metadata(wheel: Path) -> email.message.Message:
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        return email.message_from_bytes(archive.read(name))


@pytest.mark.slow
class TestWheel:
    def test_is_for_every_platform(self, wheel: Path) -> None:
        assert wheel.name.startswith("ddsi-")
        assert wheel.name.endswith("-py3-none-any.whl")

    def test_holds_the_two_import_packages_and_nothing_else(self, wheel: Path) -> None:
        with zipfile.ZipFile(wheel) as archive:
            names = {name for name in archive.namelist() if ".dist-info/" not in name}
        assert names == {module for name, folder in IMPORT_PACKAGES.items() for module in _modules(name, folder)}

    def test_says_that_it_is_typed(self, wheel: Path) -> None:
        with zipfile.ZipFile(wheel) as archive:
            assert {"ddsi/py.typed", "ddsi_security/py.typed"} <= set(archive.namelist())

    def test_metadata(self, metadata: email.message.Message) -> None:
        assert metadata["Name"] == "ddsi"
        assert metadata["Requires-Python"] == ">=3.11"
        assert metadata["License-Expression"] == "Apache-2.0"
        assert metadata["License-File"] == "LICENSE"
        assert metadata["Description-Content-Type"] == "text/markdown"
        assert str(metadata.get_payload()).startswith("# ddsi\n")

    def test_the_core_needs_trio_alone(self, metadata: email.message.Message) -> None:
        required = metadata.get_all("Requires-Dist", [])
        assert [entry for entry in required if "extra ==" not in entry] == ["trio>=0.24"]

    def test_extras(self, metadata: email.message.Message) -> None:
        assert set(metadata.get_all("Provides-Extra", [])) == {"security", "cli", "all", "pkcs11"}
        everything = [entry for entry in metadata.get_all("Requires-Dist", []) if 'extra == "all"' in entry]
        assert [entry.partition(";")[0] for entry in everything] == ["ddsi[cli,security]"], "no token support in `all`"

    def test_entry_points(self, wheel: Path) -> None:
        with zipfile.ZipFile(wheel) as archive:
            (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/entry_points.txt"))
            lines = archive.read(name).decode().split("\n")
        assert lines[lines.index("[console_scripts]") + 1] == "ddsi = ddsi.cli:main"
        assert lines[lines.index("[ddsi.security]") + 1] == "builtin = ddsi_security.service:load"


IMPORT_ALL = """
import importlib, pkgutil, sys
import ddsi, ddsi_security
NEED_THE_EXTRA = ("authentication", "access_control", "cryptographic", "keystore")
left_out = ("ddsi.cli", *(f"ddsi_security.{name}" for name in NEED_THE_EXTRA))
for package in (ddsi, ddsi_security):
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + ".", onerror=lambda name: None):
        if not module.name.startswith(left_out) and not module.name.endswith("__main__"):
            importlib.import_module(module.name)
foreign = {name.partition(".")[0] for name in sys.modules} & {"cryptography", "lxml", "rich", "numpy", "cyclonedds"}
print(ddsi.__file__)
print(sorted(foreign))
"""

REFUSED = """
from ddsi.spi import load_hooks
from ddsi.structure.errors import ConfigurationError
try:
    load_hooks({"dds.sec.auth.identity_ca": "file:ca.pem"}, entropy=bytes, wall_clock=lambda: 0)
except ConfigurationError as error:
    print(error)
"""


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The interpreter of an environment that has the wheel, trio with what it needs, and nothing else."""
    folder = tmp_path_factory.mktemp("bare")
    venv.create(folder, with_pip=False, symlinks=os.name != "nt")
    site = Path(sysconfig.get_path("purelib", "venv", {"base": str(folder), "platbase": str(folder)}))
    with zipfile.ZipFile(wheel) as archive:  # what an installer does with a wheel for any platform
        archive.extractall(site)
    for path in _trio_and_what_it_needs():
        if path.is_dir():
            shutil.copytree(path, site / path.name, ignore=shutil.ignore_patterns("__pycache__", "_tests"))
        else:
            shutil.copy(path, site)
    return folder / ("Scripts" if os.name == "nt" else "bin") / "python"


@pytest.mark.slow
class TestInstalled:
    def _run(self, python: Path, code: str) -> str:
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        command = [str(python), "-c", code]
        result = subprocess.run(
            command, capture_output=True, text=True, timeout=120, check=False, cwd=python.parent, env=environment
        )
        assert result.returncode == 0, result.stderr
        return result.stdout

    def test_all_but_the_command_line_and_the_builtin_plugins_imports_with_trio_alone(self, python: Path) -> None:
        file, foreign = self._run(python, IMPORT_ALL).splitlines()
        assert str(python.parent.parent) in file, "the installed package was imported, not the source tree"
        assert foreign == "[]"

    def test_security_is_found_and_says_what_it_lacks(self, python: Path) -> None:
        said = self._run(python, REFUSED)
        assert "pip install 'ddsi[security]'" in said
        assert len(said.splitlines()) == 1

    def test_keystore_commands_say_what_they_lack(self, python: Path) -> None:
        code = "import sys; from ddsi.cli import main; sys.stderr = sys.stdout; print(main(['keystore', 'check', '.']))"
        assert "ddsi[security]" in self._run(python, code)

    def test_the_environment_is_as_bare_as_is_claimed(self, python: Path) -> None:
        for name in ("cryptography", "lxml", "rich", "numpy", "pytest"):
            code = f"import importlib.util; print(importlib.util.find_spec({name!r}))"
            assert self._run(python, code) == "None\n"


def _trio_and_what_it_needs() -> Iterator[Path]:
    """The files and folders of trio and its dependencies in this environment."""
    for name in ("trio", "attr", "attrs", "outcome", "sniffio", "sortedcontainers", "idna", "exceptiongroup", "cffi"):
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.origin is not None:
            path = Path(spec.origin)
            yield path.parent if path.name == "__init__.py" else path


def test_import_of_the_security_package_is_cheap() -> None:
    code = "import ddsi_security, ddsi_security.plugins, ddsi_security.service, sys; print(*sys.modules)"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    loaded = {name.partition(".")[0] for name in result.stdout.split()}
    assert "ddsi_security" in loaded
    assert not loaded & {"cryptography", "lxml", "rich", "numpy"}
