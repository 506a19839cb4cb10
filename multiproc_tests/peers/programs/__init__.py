"""The programs that the tests run, one for each DDS implementation, all with one command line and one output.

``docs/multiproc.md`` has both.  The Python ones are started as ``python -m multiproc_tests.peers.programs.NAME``; none
of them is imported by the tests.
"""
