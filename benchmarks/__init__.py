"""Benchmarks: how fast this stack is beside the C-backed binding that Python users have, in one run.

``python -m benchmarks`` prints the table; ``docs/benchmarks.md`` says how to read it and how to add a row.

    benchmark   what a benchmark is: figures, units, and which sides measure it
    rows/       the benchmarks themselves, by theme
    sides/      the programs that are measured, the same roles for each stack, each in processes of its own
    worker      such processes: started, listened to, ended by a deadline
    session     what one measurement is given
    run         turn about, several rounds, failures kept to their row
    summary     medians, ratios, spreads        report   the same as text and JSON
"""
