"""DDS SQL: the expressions of content-filtered topics, queries and multi-topics, parsed and made functions.

DDS 1.4 Annex B (Syntax for Queries and Filters).  Expressions come from applications, and from peers that announce
what their readers let pass, so everything is bounded and nothing of a text is ever executed: parsing makes a tree,
and the tree, checked against a type, closures over it.
"""

from .field_path import FieldPath, nearest
from .filter_expression import FilterExpression, checked_parameters
from .natural_join import Combination, JoinPlan, NaturalJoin
from .parser import parse_filter, parse_query, parse_topic_expression
from .query_expression import QueryExpression
from .sample_filters import SampleFilters
from .syntax import InvalidExpression, TopicExpression

__all__ = [
    "Combination",
    "FieldPath",
    "FilterExpression",
    "InvalidExpression",
    "JoinPlan",
    "NaturalJoin",
    "QueryExpression",
    "SampleFilters",
    "TopicExpression",
    "checked_parameters",
    "nearest",
    "parse_filter",
    "parse_query",
    "parse_topic_expression",
]
