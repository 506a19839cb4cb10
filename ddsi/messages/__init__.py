"""RTPS messages: datagrams to submessages and back, and the state of who receives them.  RTPS 2.5 §8.3, §9.4."""
