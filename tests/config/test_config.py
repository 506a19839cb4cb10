"""Config: the typed settings of a participant."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import pytest

from ddsi.config import Config, PortMapping
from ddsi.structure.errors import BadParameter, ConfigurationError


def test_defaults_are_valid_and_say_nothing() -> None:
    assert repr(Config()) == "Config()"
    assert Config() == Config(config_warnings=("not part of what is configured",))


def test_a_config_never_changes() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        Config().lease_duration = 1.0  # type: ignore[misc]


def test_a_setting_that_is_not_known_is_refused_with_the_nearest() -> None:
    make: Any = Config
    with pytest.raises(BadParameter, match=r"Config\(interface=\.\.\.\) is not known: did you mean interfaces\?"):
        make(interface=("lo",))
    with pytest.raises(BadParameter, match="by name"):
        make(("lo",))


def test_repr_tells_what_differs() -> None:
    assert repr(Config(interfaces=("lo",), multicast=False)) == "Config(interfaces=('lo',), multicast=False)"


@pytest.mark.parametrize(
    ("lease", "given", "period"),
    [
        (20.0, None, 4.0),  # at most four seconds
        (10.0, None, 2.0),  # a fifth of the lease
        (0.3, None, 0.1),  # not more often than that
        (0.1, None, 0.05),  # but always inside the lease
        (math.inf, None, 4.0),
        (20.0, 7.5, 7.5),
    ],
)
def test_announcements_come_well_within_the_lease(lease: float, given: float | None, period: float) -> None:
    assert Config(lease_duration=lease, spdp_interval=given).announcement_period == period


@pytest.mark.parametrize(
    "setting",
    [
        {"interfaces": ("eth0", "127.0.0.1")},
        {"peers": ("robot.local", "10.0.0.1", "10.0.0.1:7410", "[::1]:7410", "fe80::1", "[::1]")},
        {"participant_index": "none"},
        {"participant_index": 119},
        {"max_message_size": 512},
        {"max_message_size": 65507, "fragment_size": 65507},
        {"lease_duration": math.inf},
        {"domain_tag": "x" * 255},
        {"max_sample_size": 1 << 30, "max_defrag_octets": 1 << 30},
        {"vendor_id": b"\x01\x10"},
        {"multicast_ttl": 0},
    ],
)
def test_accepted(setting: dict[str, Any]) -> None:
    assert getattr(Config(**setting), next(iter(setting))) == next(iter(setting.values()))


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ({"interfaces": "lo"}, "a tuple of str"),
        ({"interfaces": ("",)}, "a tuple of str"),
        ({"interfaces": [" lo"]}, "a tuple of str"),
        ({"peers": ("host:0",)}, "a port from 1 to 65535"),
        ({"peers": ("host:65536",)}, "a port from 1 to 65535"),
        ({"peers": ("host:" + "9" * 5000,)}, "a port from 1 to 65535"),
        ({"peers": ("host:x",)}, "a port from 1 to 65535"),
        ({"peers": (":7410",)}, "a host"),
        ({"multicast": "yes"}, "True, False or None"),
        ({"multicast": 1}, "True, False or None"),
        ({"multicast_address": "127.0.0.1"}, "an IPv4 multicast address"),
        ({"multicast_address": "ff02::1"}, "an IPv4 multicast address"),
        ({"multicast_ttl": 256}, "from 0 to 255"),
        ({"participant_index": "automatic"}, "'auto', 'none' or a whole number from 0 to 119"),
        ({"participant_index": 120}, "'auto', 'none' or a whole number from 0 to 119"),
        ({"participant_index": True}, "'auto', 'none' or a whole number from 0 to 119"),
        ({"max_auto_participant_index": -1}, "from 0 to 119"),
        ({"ports": 7400}, "a PortMapping"),
        ({"domain_tag": "x" * 256}, "at most 255 octets"),
        ({"domain_tag": "ä" * 128}, "at most 255 octets"),
        ({"domain_tag": "a\0b"}, "without NUL"),
        ({"lease_duration": 0}, "above 0"),
        ({"lease_duration": math.nan}, "above 0"),
        ({"lease_duration": True}, "above 0"),
        ({"spdp_interval": math.inf}, "a finite number"),
        ({"spdp_interval": 0.0}, "above 0"),
        ({"spdp_interval": 20.0}, r"shorter than lease_duration \(20.0 s\)"),
        ({"max_message_size": 511}, "from 512 to 65507"),
        ({"max_message_size": 1500.0}, "from 512 to 65507"),
        ({"fragment_size": 1500, "max_message_size": 1400}, "from 1 to 1400"),
        ({"receive_buffer_size": 0}, "from 1 to 2147483647"),
        ({"send_buffer_size": 1 << 31}, "from 1 to 2147483647"),
        ({"max_participants": 0}, "from 1"),
        ({"unacknowledged_octets": math.inf}, "from 1"),
        ({"max_sample_size": 1 << 32}, "from 1 to 4294967295"),
        ({"max_defrag_octets": 1000}, r"at least max_sample_size \(268435456\)"),
        ({"announce_types": "yes"}, "True or False"),
        ({"trace_level": "loud"}, "one of severe, warning"),
        ({"trace_file": None}, "a str"),
        ({"vendor_id": b"\x01"}, "two octets"),
    ],
)
def test_refused_with_field_value_and_remedy(setting: dict[str, Any], expected: str) -> None:
    name, value = next(iter(setting.items()))
    with pytest.raises(ConfigurationError, match=expected) as refusal:
        Config(**setting)
    assert str(refusal.value).startswith(f"Config.{name} is ")
    assert repr(value).strip("()[],") in str(refusal.value)


class TestPorts:
    def test_the_specification_s_numbers(self) -> None:
        """RTPS 2.5 §9.6.2.3, tables 9.8 and 9.9, for domain 3 and participant 5."""
        ports = PortMapping()
        assert ports.metatraffic_multicast(3) == 7400 + 3 * 250
        assert ports.user_multicast(3) == 7400 + 3 * 250 + 1
        assert ports.metatraffic_unicast(3, 5) == 7400 + 3 * 250 + 10 + 5 * 2
        assert ports.user_unicast(3, 5) == 7400 + 3 * 250 + 11 + 5 * 2

    def test_the_last_domain_that_has_ports(self) -> None:
        assert PortMapping().user_unicast(232, 62) == 65535
        with pytest.raises(ConfigurationError, match="domain 232 with participant index 63 needs port 65536, beyond"):
            PortMapping().metatraffic_unicast(232, 63)
        with pytest.raises(ConfigurationError, match="choose a lower domain id"):
            PortMapping().metatraffic_multicast(233)

    def test_numbers_of_one_s_own(self) -> None:
        ports = PortMapping(base=10000, domain_gain=100, participant_gain=4, unicast_user_offset=13)
        assert ports.user_unicast(2, 3) == 10000 + 2 * 100 + 13 + 3 * 4

    @pytest.mark.parametrize(("name", "value"), [("base", 0), ("domain_gain", -1), ("participant_gain", 1.5)])
    def test_refused(self, name: str, value: Any) -> None:
        with pytest.raises(ConfigurationError, match=rf"^Config\.ports\.{name} is {value}; it must be"):
            PortMapping(**{name: value})
