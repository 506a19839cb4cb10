"""The second scene of ``ddsi demo``: two who may talk, and one who may not, though her certificate is good.

alice and bob have identities and rights from one keystore, made on the spot.  mallory's identity is from there too, but
her permissions are for another topic.  She tries three times (DDS-Security 1.1 §8.4.2.9):

1. Her own participant tells her what her permissions say (§8.4.2.9.4, check_create_datawriter).
2. She replaces the plugin that told her.  Her participant joins, as it may; her writer is refused by bob, who looks at
   the same permissions (§8.4.2.9.10, check_remote_datawriter).
3. She signs herself permissions that suit her.  Her own participant believes them, and the others refuse all of it
   (§8.4.2.9.2, validate_remote_permissions).

Only commands are used that anybody can type: ``ddsi keystore`` and ``ddsi shapes --secure``.
"""

from __future__ import annotations

import importlib.util
import os
import shlex
import shutil
from collections.abc import Sequence
from pathlib import Path

import trio

from .demo_stage import OURS, Actor, Stage, failures, say
from .exit_status import ExitStatus
from .tables import shown

__all__ = ["SecuredScene", "missing_packages"]

_SAMPLES = 20
_RATE_HZ = 10
_CHILD_DEADLINE_S = 30
_RED = ("-c", "RED", "--rate", "1")
_REFUSAL_S = 15.0
_NEEDED = ("cryptography", "lxml")
_CREDULOUS = """\
from ddsi_security.access_control import PermissionsAccessControl


class Credulous(PermissionsAccessControl):
    def check_create_topic(self, *arguments, **named): ...  # whatever it is: no objection
    def check_create_datawriter(self, *arguments, **named): ...
"""
_SIGNED_BY_HERSELF = ("permissions_ca.cert.pem", "governance.p7s", "permissions.p7s")
"""What mallory replaces in her folder; her certificate and its key stay as the identity CA made them."""


def missing_packages() -> list[str]:
    """Of those that DDS Security needs, the ones that are not installed here."""
    return [name for name in _NEEDED if importlib.util.find_spec(name) is None]


class SecuredScene:
    """Who may do what, who tries, and what became of it."""

    def __init__(self, stage: Stage, domain: int) -> None:
        self._stage = stage
        self._domain = ["-d", str(domain)]
        self._capture = stage.folder / "alice.pcapng"
        self._keystore = stage.folder / "keystore"
        self._own = stage.folder / "own"
        self._failure = ""  # why there is no keystore

    # --- what they do -------------------------------------------------------------------------------------

    async def prepare(self) -> None:
        """Make the keystores, without a word: it takes a moment, and may be done while others play."""
        for words in self._keystore_commands():
            status, errors = await self._stage.run_ours(words)
            if status:
                self._failure = f"no keystore could be made: {shown(errors[-1]) if errors else f'status {status}'}"
                return

    def _keystore_commands(self) -> list[list[str]]:
        create, enclave = ["keystore", "create"], ["keystore", "enclave"]
        keystore, own = os.fspath(self._keystore), os.fspath(self._own)
        return [
            [*create, keystore, *self._domain, "--identity", "alice", "--identity", "bob", "--topic", "Square"],
            [*enclave, keystore, "mallory", *self._domain, "--topic", "Circle"],
            [*create, own, *self._domain, "--identity", "mallory", "--topic", "Square"],
        ]

    async def play(self) -> list[str]:
        """What was not as it should be, in words."""
        if self._failure:
            return [self._failure]
        create, enclave, forge = self._keystore_commands()
        print(
            "\nSecured: alice and bob may use Square.  mallory's certificate is as good, but she may use Circle only."
        )
        self._show(create)
        self._show(enclave)
        bob = await self._shapes("bob", "sub", "-n", str(_SAMPLES), folder=self._enclave("bob"))
        if not await self._mallory_asks():
            return ["mallory's own participant did not refuse to write Square"]
        intruders = [await self._mallory_replaces_a_plugin(), await self._mallory_signs(forge)]
        with trio.move_on_after(_REFUSAL_S):
            await bob.wait_for_refusals(len(intruders))
        alice = await self._shapes(
            "alice", "pub", "-c", "GREEN", "-n", str(_SAMPLES), "--rate", str(_RATE_HZ), "--wait", "1",
            folder=self._enclave("alice"), capture=self._capture,
        )  # fmt: skip
        for actor in (alice, bob):
            await actor.has_ended.wait()
        for intruder in intruders:
            await intruder.stop()
            await intruder.has_ended.wait()
        return _flaws(alice, bob, intruders)

    def _enclave(self, name: str) -> Path:
        return self._keystore / "enclaves" / name

    async def _mallory_asks(self) -> bool:
        asking = await self._shapes("mallory", "pub", *_RED, folder=self._enclave("mallory"))
        await asking.has_ended.wait()
        if asking.process.returncode != ExitStatus.USAGE or not asking.errors:
            return False
        say("mallory", f"may not  {asking.errors[-1].removeprefix('ddsi shapes: ')}")
        return True

    async def _mallory_replaces_a_plugin(self) -> Actor:
        module = self._stage.folder / "credulous.py"
        module.write_text(_CREDULOUS, encoding="utf-8")
        print(f"\nmallory replaces the plugin that told her so, by her own {module.name}:")
        print("".join(f"    {line}".rstrip() + "\n" for line in _CREDULOUS.splitlines()), end="")
        choice = ["--property", "dds.sec.access.plugin=credulous:Credulous"]
        return await self._shapes("mallory", "pub", *_RED, *choice, folder=self._enclave("mallory"))

    async def _mallory_signs(self, forge: Sequence[str]) -> Actor:
        """She keeps the identity that the others trust, and takes the rights that she gave herself."""
        folder = self._stage.folder / "forged"
        replaced = ",".join(_SIGNED_BY_HERSELF)
        print("\nmallory also plays authority, and signs herself permissions for Square:")
        self._show(forge)
        print(f"$ cp -rL keystore/enclaves/mallory forged; cp own/enclaves/mallory/{{{replaced}}} forged")
        shutil.copytree(self._enclave("mallory"), folder)  # files in the place of links
        for name in _SIGNED_BY_HERSELF:
            shutil.copyfile(self._own / "enclaves" / "mallory" / name, folder / name)
        return await self._shapes("mallory", "pub", *_RED, folder=folder)

    async def _shapes(self, name: str, role: str, *words: str, folder: Path, capture: Path | None = None) -> Actor:
        common = ["-t", "Square", *self._domain, "--reliable", "--keep-all", "--time", str(_CHILD_DEADLINE_S)]
        command = ["shapes", role, *words, *common, "--secure", os.fspath(folder)]
        self._show(command)
        verb = "received" if role == "sub" else "wrote"
        return await self._stage.start(name, [*OURS, *command], verb=verb, capture=capture, modules=self._stage.folder)

    def _show(self, words: Sequence[str]) -> None:
        """The command as one would type it in the stage's folder."""
        print(f"$ ddsi {shlex.join(words)}".replace(f"{self._stage.folder}{os.sep}", ""), flush=True)

    # --- what can be seen of it ---------------------------------------------------------------------------

    def compare_wires(self, clear_capture: Path) -> list[str]:
        """Is the colour of alice's squares on the wire?  That of blue ones in clear must be, or the search is void."""
        clear, protected = clear_capture.read_bytes(), self._capture.read_bytes()
        readable, leaked = clear.count(b"BLUE"), protected.count(b"GREEN")
        if not readable:
            return ["the capture of publisher does not show what it wrote"]
        if leaked:
            return [f"GREEN of alice could be read {leaked} times on the wire"]
        print(
            f"On the wire: BLUE of publisher can be read {readable} times in {len(clear):,} octets, "
            f"GREEN of alice not once in {len(protected):,}."
        )
        return []


def _flaws(alice: Actor, bob: Actor, intruders: Sequence[Actor]) -> list[str]:
    received, intruding = (bob.counts["received", "Square", colour] for colour in ("GREEN", "RED"))
    if intruding:
        return [f"bob received {intruding} samples of mallory, who may not write"]
    if received != _SAMPLES:
        return [f"bob received {received} of {_SAMPLES} samples of alice"]
    if len(bob.refusals) < len(intruders):
        return [f"bob refused {len(bob.refusals)} of {len(intruders)} attempts of mallory"]
    written = sum(intruder.counts["wrote", "Square", "RED"] for intruder in intruders)
    print(f"\nbob received all {received} samples of alice.")
    print(f"bob received none of the {written} that mallory wrote.")
    return failures((alice, bob))
