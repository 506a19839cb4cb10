"""The behavior module (RTPS 2.5 §8.4): writers and readers, their caches, proxies, order and repair.

Small machines that answer with values; only ``engine`` turns these into datagrams and timers.
"""
