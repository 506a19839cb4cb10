"""The builtin DataTagging plugin: an endpoint's tags are properties of it.

DDS-Security 1.1 §7.2.5 (DataTagQosPolicy), §8.7, §9.7 (DDS:Tagging:DDS_Discovery).  The tags are only announced, and
compared with permissions when an endpoint is made; nothing compares them with data.
"""

from __future__ import annotations

from typing import Final

from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import BinaryProperty, Properties, Property

from .attributes import DataTags
from .properties import DATA_TAG_PREFIX

__all__ = ["PropertyDataTagging"]


class PropertyDataTagging:
    """Of a writer with ``Qos(properties={"dds.sec.data_tag.classification": "secret"})``, the tag ``classification``.

    The tags are in the order of the properties.  Implements :class:`ddsi_security.plugins.DataTagging`.
    """

    plugin_version: Final = 1

    def get_data_tags(self, endpoint_properties: Properties) -> DataTags:
        """Raises ConfigurationError for a tag without a name, or with octets for a value."""
        return tuple(
            (_tag_name(name), _tag_value(name, value))
            for name, value in endpoint_properties.items()
            if name.startswith(DATA_TAG_PREFIX)
        )


def _tag_name(name: str) -> str:
    tag = name.removeprefix(DATA_TAG_PREFIX)
    if not tag:
        raise ConfigurationError(f"property {name} lacks the name of its tag: write {DATA_TAG_PREFIX}NAME")
    return tag


def _tag_value(name: str, value: str | Property | BinaryProperty) -> str:
    if isinstance(value, BinaryProperty):
        raise ConfigurationError(f"property {name} is text; give it as a string, not as a BinaryProperty")
    return value.value if isinstance(value, Property) else value
