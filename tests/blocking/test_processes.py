"""What a process does to its participants: the interpreter's end, Ctrl-C, a fork."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading

import pytest

import ddsi
from ddsi import blocking
from tests.dcps.running import RELIABLE, Note

_SECONDS = 20
_PREAMBLE = """
import os, signal, sys, threading
import ddsi
from ddsi import blocking
from tests.dcps.running import RELIABLE, Note
domain = int(sys.argv[1])
"""


def _start(domain: int, text: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-c", _PREAMBLE + text, str(domain)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def _run(domain: int, text: str) -> str:
    """What it prints; it must end by itself, quietly, with status 0."""
    out, err = _start(domain, text).communicate(timeout=_SECONDS)
    assert err == ""
    return out


def test_at_the_interpreters_end_a_forgotten_participant_says_goodbye_and_its_samples_arrive(domain: int) -> None:
    with blocking.DomainParticipant(domain) as participant:
        reader = blocking.DataReader(participant, blocking.Topic(participant, "Note", Note), RELIABLE)
        text = """
participant = blocking.DomainParticipant(domain)
writer = blocking.DataWriter(participant, blocking.Topic(participant, "Note", Note), RELIABLE)
writer.wait_for_matched(timeout=10)
for number in range(50):
    writer.write(Note(number))
"""
        assert _run(domain, text) == ""
        assert [next(reader).data.number for _ in range(50)] == list(range(50))
        # Told, not noticed: its lease would have run for longer than this test.
        assert participant.discovered_participants() == []


def test_threads_that_wait_when_the_interpreter_ends_hold_nobody_up(domain: int) -> None:
    text = """
participant = blocking.DomainParticipant(domain)
reader = blocking.DataReader(participant, blocking.Topic(participant, "Note", Note), listener=blocking.Listener())
threading.Thread(target=list, args=(reader,), daemon=True).start()
print("ready")
"""
    assert _run(domain, text) == "ready\n"


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_ctrl_c_ends_a_wait_and_the_participant_can_still_be_used(domain: int) -> None:
    text = """
with blocking.DomainParticipant(domain) as participant:
    topic = blocking.Topic(participant, "Note", Note)
    reader = blocking.DataReader(participant, topic, RELIABLE)
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    try:
        next(reader)
    except KeyboardInterrupt:
        print("interrupted")
    blocking.DataWriter(participant, topic).write(Note(7))
    print(next(reader).data.number)
"""
    assert _run(domain, text) == "interrupted\n7\n"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_after_a_fork_the_child_is_told_and_may_make_its_own_and_the_parent_goes_on(domain: int) -> None:
    text = """
import warnings
warnings.simplefilter("ignore", DeprecationWarning)  # Python 3.12 and later on forks beside threads
with blocking.DomainParticipant(domain) as participant:
    topic = blocking.Topic(participant, "Note", Note)
    reader = blocking.DataReader(participant, topic, RELIABLE)
    child = os.fork()
    if child == 0:
        for use in (lambda: reader.take(), lambda: next(reader), lambda: participant.discovered_participants()):
            try:
                use()
            except (ddsi.PreconditionNotMet, ddsi.AlreadyDeleted, StopIteration) as error:
                print(type(error).__name__)
        with blocking.DomainParticipant(domain) as own:
            writer = blocking.DataWriter(own, blocking.Topic(own, "Note", Note), RELIABLE)
            writer.wait_for_matched(timeout=10)
            writer.write(Note(5))
        print("child done", flush=True)
    else:
        print("parent got", next(reader).data.number)
        assert os.waitpid(child, 0)[1] == 0
        print(participant.is_closed, len(participant.discovered_participants()))
"""
    lines = _run(domain, text).splitlines()
    assert "child done" in lines
    assert "parent got 5" in lines
    assert lines[-1] == "False 0"
    assert lines.count("PreconditionNotMet") == 2


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_ctrl_c_while_leaving_ends_the_leaving(domain: int) -> None:
    """A reader that does not acknowledge holds the writer's goodbye for a second at most, and Ctrl-C for less."""
    main = threading.main_thread()
    assert main is threading.current_thread()
    with pytest.raises(KeyboardInterrupt):  # noqa: SIM117
        with blocking.DomainParticipant(domain) as participant:
            signal.raise_signal(signal.SIGINT)
    assert participant.is_closed
    with pytest.raises(ddsi.AlreadyDeleted):
        blocking.Topic(participant, "Note", Note)
