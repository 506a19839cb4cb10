"""Tests with real processes: ours with ours, and ours with DDS implementations that nobody here wrote.

``framework/`` runs processes in network namespaces and says what they did; ``peers/`` holds the programs that
are run; ``matrix/`` the cases that any two of them can be put through.  ``docs/multiproc.md`` explains all three.
Nothing here is installed with the package.
"""
