"""The builtin DataTagging plugin: an endpoint's tags are those of its DataTagQosPolicy.

DDS-Security 1.1 §7.2.5 (DataTagQosPolicy), §8.7, §9.7 (DDS:Tagging:DDS_Discovery).  Discovery announces them, and they
are compared with permissions when an endpoint is made or discovered; nothing compares them with data.
"""

from __future__ import annotations

from typing import Final

from ddsi.structure.qos import EndpointQos

from .attributes import DataTags

__all__ = ["QosDataTagging"]


class QosDataTagging:
    """Of a writer with ``Qos(data_tags=DataTags(("classification", "secret")))``, that tag.

    Implements :class:`ddsi_security.plugins.DataTagging`.
    """

    plugin_version: Final = 1

    def get_data_tags(self, qos: EndpointQos) -> DataTags:
        return qos.data_tags.tags
