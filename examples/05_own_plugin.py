"""A plugin of your own: authentication by certificates, as built in, that also admits only the names on a list.

The plugin is the class AllowList below.  It keeps what the builtin plugin does, and adds a look at the certificate that
each peer shows.  A participant chooses it by the property `dds.sec.auth.plugin`; the list is another property, which
only this plugin knows.  The other plugins stay the builtin ones.  docs/security.md says what a plugin must be.

No participants run here: the two sides of each handshake are driven directly, as the security service of a participant
does it, so that every step can be seen.  The certificates are made on the spot.

You will see alice, who has the list, and bob agree on a secret; then mallory refused although his certificate is good;
and bob, who has no list and uses the builtin plugin, admit him; last, what you are told if you misspell the plugin.

    python examples/05_own_plugin.py
"""

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from cryptography import x509

from ddsi import ConfigurationError
from ddsi.serialization import ParameterId, ParameterList
from ddsi.spi import Refused
from ddsi.structure.guid import EntityId, Guid
from ddsi.structure.qos_policies import Properties
from ddsi_security.authentication import PkiDhAuthentication
from ddsi_security.keystore.keystore import IdentityTerms, create_keystore
from ddsi_security.keystore.validity import Validity
from ddsi_security.loading import load_plugins
from ddsi_security.plugins import (
    Authentication,
    HandshakeHandle,
    HandshakeStep,
    IdentityHandle,
    LocalIdentity,
    Pending,
    RemoteIdentity,
)
from ddsi_security.properties import security_properties
from ddsi_security.tokens import NIL, HandshakeMessageToken

ALLOWED = "dds.sec.auth.allowed_subjects"


class AllowList(PkiDhAuthentication):
    """The builtin plugin, for peers whose subject is in the property ALLOWED (RFC 4514 names, with ; between)."""

    def __init__(
        self, properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
    ) -> None:
        super().__init__(properties, entropy=entropy, wall_clock=wall_clock)
        names = security_properties(properties).get(ALLOWED)
        if names is None:
            raise ConfigurationError(f"property {ALLOWED} is missing: list the subjects, with ; between them")
        self._allowed = {name.strip() for name in names.split(";")}

    def begin_handshake_reply(
        self,
        handshake_message_in: HandshakeMessageToken,
        initiator_identity_handle: IdentityHandle,
        replier_identity_handle: IdentityHandle,
        serialized_local_participant_data: bytes,
    ) -> HandshakeStep | Refused | Pending[HandshakeStep | Refused]:
        return self._objection(handshake_message_in) or super().begin_handshake_reply(
            handshake_message_in,
            initiator_identity_handle,
            replier_identity_handle,
            serialized_local_participant_data,
        )

    def process_handshake(
        self, handshake_message_in: HandshakeMessageToken, handshake_handle: HandshakeHandle
    ) -> HandshakeStep | Refused | Pending[HandshakeStep | Refused]:
        return self._objection(handshake_message_in) or super().process_handshake(
            handshake_message_in, handshake_handle
        )

    def _objection(self, message: HandshakeMessageToken) -> Refused | None:
        """Anybody can show any certificate.  That it is trusted, and the peer's, the builtin plugin verifies next."""
        certificate = message.binary_property("c.id")
        if certificate is None:  # the last of the three messages has none
            return None
        try:
            subject = x509.load_pem_x509_certificate(certificate).subject.rfc4514_string()
        except ValueError:
            return Refused("its certificate cannot be read")
        return None if subject in self._allowed else Refused(f"{subject} is not on our list")


class Side:
    """One side of a handshake: an identity, and the plugin that its properties choose."""

    def __init__(self, folder: Path, candidate: int, properties: dict[str, str]) -> None:
        self.name = folder.name
        files = {
            "dds.sec.auth.identity_ca": "identity_ca.cert.pem",
            "dds.sec.auth.identity_certificate": "cert.pem",
            "dds.sec.auth.private_key": "key.pem",
        }
        everything = {name: f"file:{folder / file}" for name, file in files.items()} | properties
        plugins = load_plugins(everything, entropy=os.urandom, wall_clock=time.time_ns)
        self.plugin: Authentication = plugins.authentication
        guid = Guid.of(candidate.to_bytes(12, "big"), EntityId.PARTICIPANT)
        local = self.plugin.validate_local_identity(0, everything, guid)
        assert isinstance(local, LocalIdentity), "an identity is validated at once"
        self.identity, self.guid = local.handle, local.adjusted_participant_guid

    def discover(self, peer: "Side") -> IdentityHandle:
        token = peer.plugin.get_identity_token(peer.identity)
        remote = self.plugin.validate_remote_identity(NIL, self.identity, token, peer.guid)
        assert isinstance(remote, RemoteIdentity), "only what it shows in the handshake can be wrong"
        return remote.handle

    @property
    def participant_data(self) -> bytes:
        """What SPDP announces of a participant; here the Guid alone."""
        return ParameterList([(ParameterId.PARTICIPANT_GUID, self.guid)], little_endian=False).encode()


def settled(step: HandshakeStep | Refused | Pending[HandshakeStep | Refused]) -> HandshakeStep | Refused:
    """Slow work is done in a thread of the participant; here it may as well be done at once."""
    return step.job() if isinstance(step, Pending) else step


def handshake(one: Side, other: Side) -> str:
    """Request, Reply, Final, to and fro, until one side has nothing more to say.  The lower Guid begins."""
    initiator, replier = sorted((one, other), key=lambda side: side.guid)
    its_peer, peer = initiator.discover(replier), replier.discover(initiator)
    step = settled(initiator.plugin.begin_handshake_request(initiator.identity, its_peer, initiator.participant_data))
    handles: dict[Side, HandshakeHandle] = {}
    sender, receiver = initiator, replier
    while not isinstance(step, Refused):
        handles[sender] = step.handle
        message = step.message
        if message is None:
            ours, theirs = (side.plugin.get_shared_secret(handle) for side, handle in handles.items())
            assert ours.shared_secret == theirs.shared_secret
            return "authenticated, and both hold one secret"
        if receiver in handles:
            step = settled(receiver.plugin.process_handshake(message, handles[receiver]))
        else:
            step = settled(
                receiver.plugin.begin_handshake_reply(message, peer, receiver.identity, receiver.participant_data)
            )
        sender, receiver = receiver, sender
    return f"{sender.name} refuses: {step.reason}"


def main(folder: Path) -> None:
    terms = IdentityTerms(Validity.of_days(time.time_ns(), 1))
    folders = create_keystore(folder, ["alice", "bob", "mallory"], terms=terms)
    ours = {
        # In a package of your own: "acme.security:AllowList", or the name of an entry point.
        "dds.sec.auth.plugin": f"{__name__}:AllowList",
        ALLOWED: "CN=alice;CN=bob",
    }
    alice = Side(folders[0], 1, ours)
    bob = Side(folders[1], 2, {})
    mallory = Side(folders[2], 3, {})
    print("alice and bob:    ", handshake(alice, bob))
    print("alice and mallory:", handshake(alice, mallory))
    print("bob and mallory:  ", handshake(bob, mallory))
    try:
        Side(folders[0], 4, ours | {"dds.sec.auth.plugin": f"{__name__}:AlowList"})
    except ConfigurationError as error:
        print("misspelt:         ", error)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        main(Path(temporary))
