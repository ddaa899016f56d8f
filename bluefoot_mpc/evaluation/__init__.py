"""Batteries of runs: many seeds of many scenarios, judged against stated limits."""
