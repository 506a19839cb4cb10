"""Values of the RTPS structure module (RTPS 2.5 §8.2): identities, numbers, times, locators, changes, QoS.

Nothing here acts: no clock, no octets of messages, no state machine.  Every other room imports this one.
"""
