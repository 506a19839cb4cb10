"""What an application holds: participant, topic, writer, reader, conditions, statuses (DDS 1.4 §2.2, DCPS)."""

from .builtin_topic_reader import BuiltinTopicReader
from .conditions import Condition, GuardCondition, QueryCondition, ReadCondition, StatusCondition
from .content_filtered_topic import ContentFilteredTopic
from .data_reader import DataReader
from .data_writer import DataWriter
from .entity import Entity, EventStream
from .groups import Publisher, Subscriber
from .multi_topic import MultiTopic
from .multi_topic_reader import MultiTopicReader
from .participant import DomainParticipant
from .sample import Sample
from .topic import Topic
from .wait_set import WaitSet

__all__ = [
    "BuiltinTopicReader",
    "Condition",
    "ContentFilteredTopic",
    "DataReader",
    "DataWriter",
    "DomainParticipant",
    "Entity",
    "EventStream",
    "GuardCondition",
    "MultiTopic",
    "MultiTopicReader",
    "Publisher",
    "QueryCondition",
    "ReadCondition",
    "Sample",
    "StatusCondition",
    "Subscriber",
    "Topic",
    "WaitSet",
]
