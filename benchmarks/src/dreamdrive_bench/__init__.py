"""The program behind every published figure: ``python -m dreamdrive_bench NAME``, one command a figure."""
