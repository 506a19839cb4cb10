"""Keys and certificates in a hardware token, by PKCS #11.  DDS-Security 1.1 §9.3.1; the extra ``pkcs11``.

The package ``pkcs11`` (python-pkcs11) is imported only when a ``pkcs11:`` URI occurs.  It initialises a library in the
way that forbids to call it from two threads at once; signatures are made in worker threads.  So each library is a queue
of one: who takes it out uses it and puts it back.

A token is logged in, and out, for all sessions of the process at once.  So a key that was logged out by another's end
logs in again.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256, sha384
from queue import SimpleQueue
from types import ModuleType
from typing import Any, Final

from cryptography.hazmat.primitives.asymmetric.utils import encode_dss_signature

from ddsi.structure.errors import ConfigurationError

from .algorithms import EC_P384, RSA_2048, SignatureAlgorithm
from .not_trusted import NotTrusted
from .pkcs11_uri import Pkcs11Uri
from .signatures import PSS_SALT_OCTETS

__all__ = ["TokenKey", "read_certificate"]

_LIBRARIES: Final[dict[str, SimpleQueue[Any]]] = {}


class TokenKey:
    """A private key that never leaves its token."""

    __slots__ = ("_key", "_name", "_session", "_uri", "algorithm")

    def __init__(self, name: str, uri: Pkcs11Uri, algorithm: SignatureAlgorithm) -> None:
        """``algorithm``: that of the certificate; that the key fits it is seen when it signs.

        Raises ConfigurationError.
        """
        self.algorithm: Final = algorithm
        self._name: Final = name
        self._uri: Final = uri
        self._session: Any = None
        self._key: Any = None
        pkcs11 = _imported(name)
        with _errors(name, uri, pkcs11), _library(name, uri.module, pkcs11) as library:
            self._log_in(library, pkcs11)

    def sign(self, content: bytes) -> bytes:
        pkcs11 = _imported(self._name)
        with _library(self._name, self._uri.module, pkcs11) as library:
            if self._key is None:
                raise NotTrusted("our identity was returned meanwhile")
            try:
                return self._sign(content, pkcs11)
            except (pkcs11.ObjectHandleInvalid, pkcs11.SessionHandleInvalid, pkcs11.UserNotLoggedIn):
                return self._sign_again(content, library, pkcs11)
            except pkcs11.PKCS11Error as error:
                raise NotTrusted(f"our hardware token does not sign: {type(error).__name__}") from error

    def close(self) -> None:
        """Log out, and with us all in this process who use the token: they log in again when they sign."""
        if self._key is not None:
            self._key = None
            pkcs11 = _imported(self._name)
            with _library(self._name, self._uri.module, pkcs11), suppress(pkcs11.PKCS11Error):
                self._session.close()

    def _log_in(self, library: Any, pkcs11: ModuleType) -> None:
        session = _open(self._name, library, self._uri, pkcs11)
        try:
            self._key = _find(self._name, session, self._uri, pkcs11.ObjectClass.PRIVATE_KEY)
        except BaseException:
            session.close()
            raise
        self._session = session

    def _sign_again(self, content: bytes, library: Any, pkcs11: ModuleType) -> bytes:
        try:
            self._log_in(library, pkcs11)
            return self._sign(content, pkcs11)
        except (ConfigurationError, pkcs11.PKCS11Error) as error:
            raise NotTrusted(f"our hardware token does not sign any more: {type(error).__name__}") from error

    def _sign(self, content: bytes, pkcs11: ModuleType) -> bytes:
        if self.algorithm is RSA_2048:
            parameters = (pkcs11.Mechanism.SHA256, pkcs11.MGF.SHA256, PSS_SALT_OCTETS)
            mechanism = pkcs11.Mechanism.SHA256_RSA_PKCS_PSS
            return bytes(self._key.sign(content, mechanism=mechanism, mechanism_param=parameters))
        digest = (sha384 if self.algorithm is EC_P384 else sha256)(content).digest()
        signature = bytes(self._key.sign(digest, mechanism=pkcs11.Mechanism.ECDSA))
        half = len(signature) // 2
        return encode_dss_signature(int.from_bytes(signature[:half], "big"), int.from_bytes(signature[half:], "big"))

    def __repr__(self) -> str:
        return f"<TokenKey {self.algorithm.key}>"


def read_certificate(name: str, uri: Pkcs11Uri) -> bytes:
    """The DER of a certificate in a token.  Raises ConfigurationError."""
    pkcs11 = _imported(name)
    with _errors(name, uri, pkcs11), _library(name, uri.module, pkcs11) as library:
        session = _open(name, library, uri, pkcs11)
        try:
            found = _find(name, session, uri, pkcs11.ObjectClass.CERTIFICATE)
            return bytes(found[pkcs11.Attribute.VALUE])
        finally:
            session.close()


def _imported(name: str) -> ModuleType:
    try:
        import pkcs11
    except ImportError as error:
        raise ConfigurationError(
            f"property {name} is a pkcs11: URI, which needs python-pkcs11: pip install 'ddsi[pkcs11]'"
        ) from error
    module: ModuleType = pkcs11
    return module


@contextmanager
def _library(name: str, path: str, pkcs11: ModuleType) -> Iterator[Any]:
    if path not in _LIBRARIES:
        try:
            loaded = pkcs11.lib(path)
        except (pkcs11.PKCS11Error, RuntimeError, OSError) as error:
            raise ConfigurationError(
                f"property {name}: cannot load the PKCS #11 library {path}: {error}; name the library of your token by "
                "?module-path=/path/to/library.so in the URI"
            ) from error
        queue: SimpleQueue[Any] = SimpleQueue()
        queue.put(loaded)
        _LIBRARIES.setdefault(path, queue)
    library = _LIBRARIES[path].get()
    try:
        yield library
    finally:
        _LIBRARIES[path].put(library)


@contextmanager
def _errors(name: str, uri: Pkcs11Uri, pkcs11: ModuleType) -> Iterator[None]:
    try:
        yield
    except pkcs11.PinIncorrect as error:
        raise ConfigurationError(f"property {name}: the PIN for {uri} is wrong (pin-value or pin-source)") from error
    except pkcs11.PKCS11Error as error:
        raise ConfigurationError(f"property {name}: {uri} cannot be used: {type(error).__name__} {error}") from error


def _open(name: str, library: Any, uri: Pkcs11Uri, pkcs11: ModuleType) -> Any:
    """A session with the one token that the URI describes, logged in if there is a PIN."""
    tokens = [slot.get_token() for slot in library.get_slots(token_present=True)]
    fitting = [token for token in tokens if _fits(token, uri)]
    if len(fitting) != 1:
        there = ", ".join(repr(token.label) for token in tokens if token.label) or "none"
        raise ConfigurationError(
            f"property {name}: {len(fitting)} hardware tokens fit the pkcs11: URI, one is needed; there are: {there}"
        )
    if uri.pin is None:
        return fitting[0].open()
    try:
        return fitting[0].open(user_pin=uri.pin)
    except pkcs11.UserAlreadyLoggedIn:
        return fitting[0].open()


def _fits(token: Any, uri: Pkcs11Uri) -> bool:
    return (
        (uri.token is None or token.label == uri.token)
        and (uri.serial is None or token.serial == uri.serial)
        and (uri.manufacturer is None or token.manufacturer_id == uri.manufacturer)
        and (uri.model is None or token.model == uri.model)
        and (uri.slot_id is None or token.slot.slot_id == uri.slot_id)
    )


def _find(name: str, session: Any, uri: Pkcs11Uri, object_class: Any) -> Any:
    pkcs11 = _imported(name)
    template: dict[Any, Any] = {pkcs11.Attribute.CLASS: object_class}
    if uri.label is not None:
        template[pkcs11.Attribute.LABEL] = uri.label
    if uri.object_id is not None:
        template[pkcs11.Attribute.ID] = uri.object_id
    found = list(session.get_objects(template))
    if len(found) != 1:
        kind = object_class.name.lower().replace("_", " ")
        remedy = "" if uri.pin is not None else "; without a PIN (pin-value, pin-source) private ones are not seen"
        raise ConfigurationError(f"property {name}: there are {len(found)} objects ({kind}) with {uri}{remedy}")
    return found[0]
