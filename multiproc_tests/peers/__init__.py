"""DDS implementations to talk to, ours among them, each behind a program with the same command line and output."""
