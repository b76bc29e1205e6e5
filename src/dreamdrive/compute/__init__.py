"""Devices, threads and functions of the compiled core."""
