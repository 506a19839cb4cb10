"""Data tags are those of the endpoint's QoS."""

from __future__ import annotations

from ddsi.structure.qos import EndpointQos
from ddsi.structure.qos_policies import DataTags
from ddsi_security.data_tagging import QosDataTagging
from ddsi_security.plugins import DataTagging


def test_the_tags_of_the_policy_in_their_order() -> None:
    plugin: DataTagging = QosDataTagging()
    tags = (("owner", "navy"), ("classification", "secret"), ("empty", ""))
    assert plugin.get_data_tags(EndpointQos(data_tags=DataTags(*tags))) == tags
    assert plugin.get_data_tags(EndpointQos()) == ()
