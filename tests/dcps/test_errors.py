"""The errors as applications catch them: one base, and the builtin classes that people expect."""

from __future__ import annotations

import pytest

import ddsi

ERRORS = [
    ddsi.AlreadyDeleted,
    ddsi.BadParameter,
    ddsi.ConfigurationError,
    ddsi.DdsTimeout,
    ddsi.ImmutablePolicy,
    ddsi.InconsistentPolicy,
    ddsi.MalformedSample,
    ddsi.NotAllowedBySecurity,
    ddsi.OutOfResources,
    ddsi.PreconditionNotMet,
]


@pytest.mark.parametrize("error", ERRORS)
def test_all_errors_have_one_base(error: type[Exception]) -> None:
    assert issubclass(error, ddsi.DdsError)


def test_timeouts_and_bad_values_are_builtin_errors_too() -> None:
    assert issubclass(ddsi.DdsTimeout, TimeoutError)
    assert issubclass(ddsi.BadParameter, ValueError)


def test_nothing_of_the_public_face_is_missing() -> None:
    for name in ddsi.__all__:
        assert getattr(ddsi, name) is not None
    assert len(set(ddsi.__all__)) == len(ddsi.__all__)
