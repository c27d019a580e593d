"""Tracing a network on its functional: start, path, accuracy, imperfection."""
