"""The builtin DataTagging plugin."""

from __future__ import annotations

import pytest

from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import BinaryProperty, Properties, Property
from ddsi_security.data_tagging import PropertyDataTagging
from ddsi_security.plugins import DataTagging


def test_tags_are_properties_in_their_order() -> None:
    plugin: DataTagging = PropertyDataTagging()
    properties: Properties = {
        "dds.sec.data_tag.owner": "navy",
        "application.name": "x",
        "dds.sec.data_tag.classification": Property("secret", propagate=True),
        "dds.sec.data_tag.empty": "",
    }
    assert plugin.get_data_tags(properties) == (("owner", "navy"), ("classification", "secret"), ("empty", ""))
    assert plugin.get_data_tags({"application.name": "x"}) == ()


def test_a_tag_has_a_name_and_a_text() -> None:
    with pytest.raises(ConfigurationError, match=r"lacks the name of its tag: write dds\.sec\.data_tag\.NAME"):
        PropertyDataTagging().get_data_tags({"dds.sec.data_tag.": "x"})
    with pytest.raises(ConfigurationError, match="give it as a string"):
        PropertyDataTagging().get_data_tags({"dds.sec.data_tag.owner": BinaryProperty(b"x")})
