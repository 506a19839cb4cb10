"""``python -m tests.fuzz TARGET SECONDS``, or ``make fuzz``: see :mod:`tests.fuzz.guided`.

``python -m tests.fuzz strangers --datagrams 1000000``: see :mod:`tests.fuzz.strangers`.
"""

from __future__ import annotations

import sys


def main(arguments: list[str]) -> None:
    if arguments[:1] == ["strangers"]:
        from tests.fuzz import strangers

        strangers.main(arguments[1:])
    else:
        from tests.fuzz import guided  # wants atheris, and to instrument what it imports

        guided.main(*(arguments if len(arguments) == 2 else ()))


if __name__ == "__main__":
    main(sys.argv[1:])
