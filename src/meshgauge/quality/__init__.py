"""Measuring: a value and a status for every cell, metrics, certificates, summaries."""
