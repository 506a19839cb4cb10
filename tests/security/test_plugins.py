"""The plugin interfaces: they have the OMG's operations, and a plugin can be written against them."""

from __future__ import annotations

import inspect
import re

import pytest

from ddsi.structure.qos import EndpointQos
from ddsi_security import plugins
from ddsi_security.plugins import DataTagging

# The operations of the OMG's IDL (dds_security_plugins_spis.idl of DDS-Security 1.1), less the `return_` operations
# of values without secrets, in its order.
OPERATIONS = {
    "Authentication": """validate_local_identity get_identity_token get_identity_status_token
        set_permissions_credential_and_token validate_remote_identity begin_handshake_request begin_handshake_reply
        process_handshake get_shared_secret get_authenticated_peer_credential_token set_listener
        return_handshake_handle return_identity_handle return_sharedsecret_handle""",
    "AccessControl": """validate_local_permissions validate_remote_permissions check_create_participant
        check_create_datawriter check_create_datareader check_create_topic check_local_datawriter_register_instance
        check_local_datawriter_dispose_instance check_remote_participant check_remote_datawriter
        check_remote_datareader check_remote_topic check_local_datawriter_match check_local_datareader_match
        check_remote_datawriter_register_instance check_remote_datawriter_dispose_instance get_permissions_token
        get_permissions_credential_token set_listener get_participant_sec_attributes get_topic_sec_attributes
        get_datawriter_sec_attributes get_datareader_sec_attributes""",
    "CryptoKeyFactory": """register_local_participant register_matched_remote_participant register_local_datawriter
        register_matched_remote_datareader register_local_datareader register_matched_remote_datawriter
        unregister_participant unregister_datawriter unregister_datareader""",
    "CryptoKeyExchange": """create_local_participant_crypto_tokens set_remote_participant_crypto_tokens
        create_local_datawriter_crypto_tokens set_remote_datawriter_crypto_tokens
        create_local_datareader_crypto_tokens set_remote_datareader_crypto_tokens return_crypto_tokens""",
    "CryptoTransform": """encode_serialized_payload encode_datawriter_submessage encode_datareader_submessage
        encode_rtps_message decode_rtps_message preprocess_secure_submsg decode_datawriter_submessage
        decode_datareader_submessage decode_serialized_payload""",
    "Logging": "set_log_options enable_logging log set_listener",
    "DataTagging": "",
    "AuthenticationListener": "on_revoke_identity on_status_changed",
    "AccessControlListener": "on_revoke_permissions",
    "LoggingListener": "on_log_message",
}
OURS = {
    "Authentication": {"get_subject_name", "next_deadline", "handle_timeout"},
    "AccessControl": {"next_deadline", "handle_timeout", "return_permissions_handle"},
    "CryptoTransform": {"overhead"},
    "Logging": {"get_log_options", "set_participant"},
    "DataTagging": {"get_data_tags"},
}
NUMBERED = ("Authentication", "AccessControl", "CryptoKeyFactory", "CryptoKeyExchange", "CryptoTransform")


def _operations(interface: str) -> dict[str, str]:
    """The public methods of a protocol with their docstrings."""
    members = inspect.getmembers(getattr(plugins, interface), inspect.isfunction)
    return {name: inspect.getdoc(method) or "" for name, method in members if not name.startswith("_")}


@pytest.mark.parametrize("interface", OPERATIONS)
def test_the_operations_are_the_omg_s(interface: str) -> None:
    expected = set(OPERATIONS[interface].split()) | OURS.get(interface, set())
    assert set(_operations(interface)) == expected


@pytest.mark.parametrize("interface", NUMBERED)
def test_each_operation_cites_its_own_clause(interface: str) -> None:
    cited = {
        name: re.match(r"§(8\.[345](?:\.\d+)+)\.  ?|§(8\.[345](?:\.\d+)+)\.$", documentation)
        for name, documentation in _operations(interface).items()
        if name not in OURS.get(interface, ())
    }
    assert [name for name, match in cited.items() if match is None] == []
    numbers = [match[0].rstrip(". ") for match in cited.values() if match]
    assert len(numbers) == len(set(numbers)), "two operations cite one clause"
    assert len({number.rpartition(".")[0] for number in numbers}) == 1, "they are of one clause"


@pytest.mark.parametrize(("interface", "names"), OURS.items())
def test_what_is_not_the_omg_s_says_so(interface: str, names: set[str]) -> None:
    documentation = " ".join(_operations(interface)[name] for name in names) + (
        inspect.getdoc(getattr(plugins, interface)) or ""
    )
    assert re.search(r"Not the OMG's|not in the interface of 1\.1|is ours|As :meth:", documentation, re.IGNORECASE)


def test_every_annotation_can_be_read() -> None:
    """Tools, and users who subclass, look at them at run time."""
    for interface in OPERATIONS:
        for name in _operations(interface):
            signature = inspect.signature(getattr(getattr(plugins, interface), name), eval_str=True)
            assert signature.return_annotation is not inspect.Signature.empty, f"{interface}.{name}"


def test_a_plugin_needs_no_base_class() -> None:
    """What mypy checks here is that a class with the right methods is a plugin."""

    class LabelledByOwner:
        def get_data_tags(self, qos: object) -> tuple[tuple[str, str], ...]:
            return (("owner", "me"),)

    plugin: DataTagging = LabelledByOwner()
    assert plugin.get_data_tags(EndpointQos()) == (("owner", "me"),)
