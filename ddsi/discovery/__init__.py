"""Who is there: participants, their writers and readers, and which of them match.  RTPS 2.5 §8.5, §9.6."""
