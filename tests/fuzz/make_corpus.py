"""Make the inputs in ``corpus/``: ``python -m tests.fuzz.make_corpus``, perhaps with the names of targets.

One function per target yields what is hostile: a name that says what, the octets, and the verdict that is expected.
Each class of weakness that is known of other implementations has at least one; they are from published advisories and
from the specification's own traps.  Nothing is drawn by chance: what is made twice is the same, but for signatures.
"""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence

from tests.fuzz.corpus import EXPECTED, FOLDER
from tests.fuzz.hostile_documents import DOCUMENT_MAKERS
from tests.fuzz.hostile_envelopes import ENVELOPE_MAKERS
from tests.fuzz.hostile_messages import MESSAGE_MAKERS, Made
from tests.fuzz.hostile_secured import SECURED_MAKERS
from tests.fuzz.hostile_tokens import TOKEN_MAKERS
from tests.fuzz.identities import FOLDER as IDENTITIES
from tests.fuzz.identities import make_keystore
from tests.fuzz.targets import TARGETS

MAKERS: dict[str, Callable[[], Iterator[Made]]] = {
    **MESSAGE_MAKERS,
    **TOKEN_MAKERS,
    **DOCUMENT_MAKERS,
    **ENVELOPE_MAKERS,
    **SECURED_MAKERS,
}


def main(names: Sequence[str]) -> None:
    """Whatever does not begin with ``found-`` is made anew, of the targets with these names or of all."""
    if not IDENTITIES.exists():
        make_keystore()
    expected = json.loads(EXPECTED.read_text()) if EXPECTED.exists() else {}
    made: dict[str, dict[str, str]] = {}
    for target in TARGETS:
        if names and target not in names:
            made[target] = expected.get(target, {})
            continue
        folder = FOLDER / target
        found = {name: verdict for name, verdict in expected.get(target, {}).items() if name.startswith("found-")}
        for path in folder.glob("*"):
            if path.name not in found:
                path.unlink()
        folder.mkdir(parents=True, exist_ok=True)
        made[target] = found
        for name, octets, verdict in MAKERS.get(target, lambda: iter(()))():
            assert name not in made[target], f"{target}/{name} twice"
            (folder / name).write_bytes(octets)
            made[target][name] = verdict
    for path in FOLDER.iterdir():
        if path.is_dir() and path.name not in TARGETS:
            shutil.rmtree(path)
    EXPECTED.write_text(json.dumps(made, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
