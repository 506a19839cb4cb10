"""Which readers' content filters a local writer evaluates itself, instead of sending them everything.

RTPS 2.5 §8.7.3: it may, where it understands the filter; a reader filters in any case.  It does not where

- the filter is none of SQL, or does not fit the writer's type: a stranger's expression is read with care, and what
  cannot be evaluated passes;
- it evaluates many others already: each costs time with every sample;
- the reader wants coherent sets whole: what it is not sent could as well be lost;
- its payloads are protected: whether a datagram leaves would show everybody what only their readers may know.
"""

from __future__ import annotations

from ..behavior.content_filter import SQL_FILTER_CLASS, ContentFilter, filter_signatures
from ..behavior.content_filtering_writer import ContentFilteringWriter
from ..spi import SecurityHooks
from ..structure.discovered import DiscoveredReaderData
from ..structure.errors import BadParameter
from .local_endpoints import LocalWriter

__all__ = ["MAX_FILTERS_OF_A_WRITER", "writer_side_filter"]

MAX_FILTERS_OF_A_WRITER = 32
"""Different ones; readers with equal filters share one."""


def writer_side_filter(writer: LocalWriter, data: DiscoveredReaderData, hooks: SecurityHooks) -> ContentFilter | None:
    """The filter that the writer shall apply for this reader; None: it is sent everything."""
    announced, behavior = data.content_filter, writer.behavior
    if announced is None or writer.compile_filter is None or not isinstance(behavior, ContentFilteringWriter):
        return None
    if announced.filter_class_name != SQL_FILTER_CLASS or announced.related_topic_name != writer.data.topic_name:
        return None
    if data.qos.presentation.coherent_access or hooks.overhead(writer.guid, ()).payload:
        return None
    filters = {known.signature: known for proxy in behavior.filtering_readers if (known := proxy.content_filter)}
    signature, _ = filter_signatures(announced)
    if signature in filters:
        return filters[signature]
    if len(filters) >= MAX_FILTERS_OF_A_WRITER:
        return None
    try:
        return ContentFilter(
            announced, writer.compile_filter(announced.filter_expression, announced.expression_parameters)
        )
    except BadParameter:
        return None
