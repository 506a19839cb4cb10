"""``secure``: the security properties of a keystore folder, and what a participant's properties are in the end.

DDS-Security 1.1 §9.3.1, §9.4.1.  The folder is laid out as ROS 2's enclaves are, which is also what ``ddsi keystore``
makes.  Nothing is read here but the names: files are read, and verified, when the participant is created.
"""

from __future__ import annotations

import os
from pathlib import Path

from ..structure.errors import ConfigurationError
from ..structure.qos import Qos
from ..structure.qos_policies import Properties, Property
from .config import Config
from .meanings import SECURITY

__all__ = ["participant_properties", "secure"]

_FILES = {
    "dds.sec.auth.identity_ca": "identity_ca.cert.pem",
    "dds.sec.auth.identity_certificate": "cert.pem",
    "dds.sec.auth.private_key": "key.pem",
    "dds.sec.access.permissions_ca": "permissions_ca.cert.pem",
    "dds.sec.access.governance": "governance.p7s",
    "dds.sec.access.permissions": "permissions.p7s",
}
_WORDS = frozenset(SECURITY.values())
"""The properties that ``<Security>`` can say."""


def secure(keystore: str | os.PathLike[str], *, password: str | None = None) -> Qos:
    """The Qos of a participant that has the identity and the rights in this folder; ``|`` adds policies to it.

    The folder holds identity_ca.cert.pem, cert.pem, key.pem, permissions_ca.cert.pem, governance.p7s and
    permissions.p7s.  ``password`` opens the private key where it is encrypted.  Raises ConfigurationError, naming what
    is missing.
    """
    folder = Path(keystore).absolute()
    missing = [name for name in _FILES.values() if not (folder / name).is_file()]
    if missing:
        raise ConfigurationError(_why_not(folder, missing))
    properties = {name: Property(f"file:{folder / file}") for name, file in _FILES.items()}
    if password is not None:
        properties["dds.sec.auth.password"] = Property(password)
    return Qos(properties=properties)


def _why_not(folder: Path, missing: list[str]) -> str:
    """What is wrong with a folder that lacks these files, and what may have been meant."""
    if not folder.is_dir():
        return f"there is no folder {folder}; make a keystore with `ddsi keystore create`"
    lacks = f"{folder} is no keystore for a participant: it lacks {', '.join(missing)}"
    for identities in ("enclaves/*/cert.pem", "*/cert.pem"):  # a whole keystore, or the folder of its identities
        if found := sorted(str(certificate.parent) for certificate in folder.glob(identities)):
            return f"{lacks}; name the folder of one identity, such as {found[0]}"
    return f"{lacks}; make one with `ddsi keystore create`, and name the folder of one identity (DIR/enclaves/NAME)"


def participant_properties(qos: Properties | None, config: Config) -> Properties:
    """The properties of a participant: those of its QoS, and those that ``<Security>`` of ``DDSI_URI`` stands for.

    What ``<Security>`` has no word for, such as logging, the QoS may add.  Raises ConfigurationError where both say who
    the participant is and what it may do, and not alike: which of them is meant cannot be told.  (A QoS may say it in
    another stack's spelling; who reads the properties finds what contradicts itself then.)
    """
    given = qos or {}
    configured = dict(config.security)
    said = {name: value.value if isinstance(value, Property) else value for name, value in given.items()}
    by_qos = {name: said[name] for name in _WORDS & said.keys()}
    if configured and by_qos:
        different = sorted(name for name in configured | by_qos if configured.get(name) != by_qos.get(name))
        if different:
            raise ConfigurationError(
                f"security is configured twice and not alike, by the participant's QoS and by <Security> of the "
                f"configuration: {', '.join(different)}; keep one of the two"
            )
    return {**{name: Property(value) for name, value in configured.items()}, **given}
