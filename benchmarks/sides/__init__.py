"""The programs that are measured: the same roles for each stack.  ``protocol`` is how they speak to the harness."""
