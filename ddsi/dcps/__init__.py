"""What an application holds: participant, topic, writer, reader, conditions, statuses (DDS 1.4 §2.2, DCPS)."""

from .builtin_topic_reader import BuiltinTopicReader
from .conditions import ReadCondition
from .content_filtered_topic import ContentFilteredTopic
from .data_reader import DataReader
from .data_writer import DataWriter
from .entity import Entity, EventStream
from .groups import Publisher, Subscriber
from .participant import DomainParticipant
from .sample import Sample
from .topic import Topic

__all__ = [
    "BuiltinTopicReader",
    "ContentFilteredTopic",
    "DataReader",
    "DataWriter",
    "DomainParticipant",
    "Entity",
    "EventStream",
    "Publisher",
    "ReadCondition",
    "Sample",
    "Subscriber",
    "Topic",
]
