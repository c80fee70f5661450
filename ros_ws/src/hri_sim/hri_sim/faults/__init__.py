"""Faults brought about on purpose, in graphs in lock-step, in processes, in files; and their report."""
