"""The way into the thread where the engine runs, for programs that do not run in trio themselves.

Not part of DDS.  ``ddsi.blocking`` and ``ddsi.aio`` are the two faces of this room; nothing here is for applications.
What both share is here: the thread, calls into it, a participant's stay in it, and what of the entities never waits.
"""
