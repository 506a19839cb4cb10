"""Plugins are chosen by properties, loaded at run time, and refused in one sentence that names property and value."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos import EndpointQos
from ddsi.structure.qos_policies import DataTags, Properties
from ddsi_security.loading import KINDS, PluginKind, Plugins, load_plugins
from ddsi_security.plugins import AccessControl, Authentication, Cryptographic, Logging

ROOT = Path(__file__).parents[2]
ACME = {
    "dds.sec.auth.plugin": f"{__name__}:AcmeAuthentication",
    "dds.sec.access.plugin": f"{__name__}:AcmeAccessControl",
    "dds.sec.crypto.plugin": f"{__name__}:make_cryptographic",
    "dds.sec.log.plugin": f"{__name__}:Shelf.Logging",
}


class Acme:
    """A plugin's constructor, which keeps what it was given."""

    plugin_version = 1

    def __init__(
        self, properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
    ) -> None:
        self.given = (properties, entropy, wall_clock)


class AcmeAuthentication(Acme, Authentication):
    """Its operations are those of the protocol, and do nothing."""


class AcmeAccessControl(Acme, AccessControl):
    pass


class AcmeCryptographic(Acme, Cryptographic):
    pass


class Shelf:
    class Logging(Acme, Logging):
        pass


def make_cryptographic(
    properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
) -> object:
    return FAKES["dds.sec.crypto.plugin"](properties, entropy=entropy, wall_clock=wall_clock)


FAKES: dict[str, type[Acme]] = {
    "dds.sec.auth.plugin": AcmeAuthentication,
    "dds.sec.access.plugin": AcmeAccessControl,
    "dds.sec.crypto.plugin": AcmeCryptographic,
    "dds.sec.log.plugin": Shelf.Logging,
}


def load(properties: Properties) -> Plugins:
    return load_plugins(properties, entropy=bytes, wall_clock=int)


def refusal(properties: Properties) -> str:
    with pytest.raises(ConfigurationError) as refused:
        load({**ACME, **properties})
    message = str(refused.value)
    assert "\n" not in message
    return message


# --- what is chosen --------------------------------------------------------------------------------------


def test_each_plugin_is_made_by_the_factory_that_its_property_names() -> None:
    plugins = load(ACME)
    assert isinstance(plugins.authentication, AcmeAuthentication)
    assert isinstance(plugins.access_control, AcmeAccessControl)
    assert isinstance(plugins.cryptographic, AcmeCryptographic)
    assert isinstance(plugins.logging, Shelf.Logging)
    assert plugins.data_tagging.get_data_tags(EndpointQos(data_tags=DataTags(("a", "b")))) == (("a", "b"),)
    assert plugins.authentication.given == (ACME, bytes, int)


def test_each_participant_has_plugins_of_its_own() -> None:
    assert load(ACME).authentication is not load(ACME).authentication


@pytest.mark.parametrize("value", ["absent", "builtin", "vendor's"])
@pytest.mark.parametrize("kind", KINDS, ids=[kind.property_name for kind in KINDS])
def test_the_builtin_plugin_is_the_default_and_has_other_names(
    kind: PluginKind, value: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    module, _, name = kind.builtin.partition(":")
    made: list[object] = []

    def builtin(properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]) -> object:
        made.append(FAKES[kind.property_name](properties, entropy=entropy, wall_clock=wall_clock))
        return made[-1]

    standing_in = ModuleType(module)
    setattr(standing_in, name, builtin)
    monkeypatch.setitem(sys.modules, module, standing_in)
    properties = {key: text for key, text in ACME.items() if key != kind.property_name}
    if value != "absent":
        properties[kind.property_name] = kind.vendor_spelling if value == "vendor's" else value
    plugins = load(properties)
    assert [plugins.authentication, plugins.access_control, plugins.cryptographic, plugins.logging].count(made[0]) == 1


def test_the_builtin_plugins_are_plugins() -> None:
    pytest.importorskip("cryptography")
    pytest.importorskip("lxml")
    plugins = load({})
    assert [type(plugin).__name__ for plugin in (plugins.authentication, plugins.access_control)] == [
        "PkiDhAuthentication",
        "PermissionsAccessControl",
    ]
    assert [type(plugin).__name__ for plugin in (plugins.cryptographic, plugins.logging)] == ["AesGcmGmac", "LogTopic"]


def test_what_is_not_chosen_is_not_imported() -> None:
    """In a process of its own: a participant whose plugins are all a third party's needs no cryptographic library."""
    program = f"""
import sys
from tests.security.test_loading import ACME, load
load({{key: value.replace({__name__!r}, "tests.security.test_loading") for key, value in ACME.items()}})
print([name for name in ("cryptography", "lxml", "ddsi_security.authentication") if name in sys.modules])
"""
    assert _output(program) == "[]\n"


def test_a_missing_extra_is_said_in_one_sentence() -> None:
    """Of either package, and by a third party's plugin that builds upon the builtin one too."""
    program = """
import sys
sys.modules[sys.argv[1]] = None
from ddsi_security.loading import load_plugins
from ddsi.structure.errors import ConfigurationError
try:
    load_plugins({sys.argv[2]: sys.argv[3]}, entropy=bytes, wall_clock=int)
except ConfigurationError as error:
    print(error)
"""
    for package, name, value in (
        ("cryptography", "dds.sec.auth.plugin", "builtin"),
        ("cryptography", "dds.sec.auth.plugin", "ddsi_security.authentication.pki_dh:PkiDhAuthentication"),
        ("lxml", "dds.sec.access.plugin", "builtin"),
    ):
        assert _output(program, package, name, value) == (
            f"property {name} is {value!r}: needs the package {package}: pip install 'ddsi[security]'\n"
        )


def _output(program: str, *arguments: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-c", program, *arguments],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    ).stdout


# --- entry points ----------------------------------------------------------------------------------------


def _install(folder: Path, monkeypatch: pytest.MonkeyPatch, *, package: str, entries: str) -> None:
    """A distribution that registers authentication plugins, as pip would leave it."""
    information = folder / f"{package}-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(f"[ddsi_security.authentication]\n{entries}\n")
    monkeypatch.syspath_prepend(folder)


def test_an_installed_package_offers_a_plugin_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _install(tmp_path, monkeypatch, package="acme", entries=f"acme-hsm = {__name__}:AcmeAuthentication")
    plugins = load({**ACME, "dds.sec.auth.plugin": "acme-hsm"})
    assert isinstance(plugins.authentication, AcmeAuthentication)
    assert refusal({"dds.sec.auth.plugin": "acme-hms"}).endswith(
        "no installed package has an entry point of that name in the group ddsi_security.authentication: "
        "did you mean acme-hsm?"
    )
    assert "group ddsi_security.access_control" in refusal({"dds.sec.access.plugin": "acme-hsm"})


def test_a_name_that_two_packages_offer_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _install(tmp_path, monkeypatch, package="acme", entries="hsm = acme:make")
    _install(tmp_path, monkeypatch, package="other", entries="hsm = other:make")
    assert refusal({"dds.sec.auth.plugin": "hsm"}) == (
        "property dds.sec.auth.plugin is 'hsm': several packages provide it (acme:make, other:make): keep one of them"
    )


# --- what is refused -------------------------------------------------------------------------------------


class Version2(AcmeAuthentication):
    plugin_version = 2


class Unversioned(Authentication):
    def __init__(self, *_: object, **__: object) -> None: ...


class Incomplete(Acme):
    def validate_local_identity(self, domain: int) -> None: ...


def failing(properties: Properties, **_: object) -> object:
    raise OSError("no card\nin the slot")


failing.plugin_version = 1  # type: ignore[attr-defined]


def particular(properties: Properties, **_: object) -> object:
    raise ConfigurationError("property dds.sec.auth.acme_slot is 9: there are slots 0 to 3")


def takes_properties_alone(properties: Properties) -> object:
    return object()


not_a_factory = 3
BROKEN = {
    "misspelt.py": "import acme_that_is_absent",
    "unfinished.py": "def make(:",
    "failing_module.py": "raise RuntimeError('no licence')",
    "lazy.py": "def __getattr__(name): import acme_that_is_absent",
}


@pytest.mark.parametrize(
    ("value", "complaint"),
    [
        ("acme_absent:make", "there is no module acme_absent: install what holds it, or correct it"),
        (f"{__name__}.absent:make", f"there is no module {__name__}.absent: install"),
        ("misspelt:make", "misspelt cannot be imported: ModuleNotFoundError: No module named 'acme_that_is_absent'"),
        ("unfinished:make", "unfinished cannot be imported: SyntaxError: "),
        ("failing_module:make", "failing_module cannot be imported: RuntimeError: no licence"),
        ("lazy:make", "lazy cannot be imported: ModuleNotFoundError: No module named 'acme_that_is_absent'"),
        (":make", "write module:factory"),
        (".relative:make", "write module:factory"),
        ("nobody.offers.this", "or write module:factory"),
        ("builtin.PKI_DH", "did you mean builtin.PKI-DH?"),
        (f"{__name__}:", f"{__name__} has no "),
        (f"{__name__}:AcmeAuthenticatoin", "has no AcmeAuthenticatoin: did you mean AcmeAuthentication?"),
        (f"{__name__}:Shelf.Loging", "has no Shelf.Loging: did you mean Logging?"),
        (f"{__name__}:not_a_factory", "not_a_factory is of type int, and nothing that makes a plugin"),
        (f"{__name__}:Version2", "is written for version 2 of the plugin interfaces, these are 1: install matching"),
        (f"{__name__}:Unversioned", "bears no plugin_version: it must say 1, if it is written for that"),
        (f"{__name__}:takes_properties_alone", "is called as factory(properties, *, entropy, wall_clock): got an "),
        (f"{__name__}:failing", "failed to start: OSError: no card in the slot"),
        (f"{__name__}:Incomplete", "the Incomplete it makes is no Authentication: lacks begin_handshake_reply, "),
        (f"{__name__}:Incomplete", "; validate_local_identity takes (domain) instead of (domain_id, "),
        (f"{__name__}:AcmeAccessControl", "the AcmeAccessControl it makes is no Authentication: lacks begin_"),
    ],
)
def test_what_is_wrong_with_a_plugin_is_said(
    value: str, complaint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, text in BROKEN.items():
        (tmp_path / name).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    message = refusal({"dds.sec.auth.plugin": value})
    assert message.startswith(f"property dds.sec.auth.plugin is {value!r}: ")
    assert complaint in message


def test_the_cause_is_kept() -> None:
    with pytest.raises(ConfigurationError) as refused:
        load({**ACME, "dds.sec.auth.plugin": f"{__name__}:failing"})
    assert isinstance(refused.value.__cause__, OSError)


def test_a_factory_may_say_itself_what_is_wrong_with_a_property() -> None:
    assert refusal({"dds.sec.auth.plugin": f"{__name__}:particular"}) == (
        "property dds.sec.auth.acme_slot is 9: there are slots 0 to 3"
    )


def test_a_property_that_nobody_knows_is_refused_before_anything_is_loaded() -> None:
    given = {"dds.sec.auth.plugin": "builtin", "dds.sec.auth.identity_cer": "file:x", "dds.sec.crypto.plugin": "absent"}
    with pytest.raises(
        ConfigurationError, match=r"unknown security property dds\.sec\.auth\.identity_cer: did you mean"
    ):
        load(given)
