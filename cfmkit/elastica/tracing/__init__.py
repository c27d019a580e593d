"""Tracing: from networks and a drive to their paths, with a start, an accuracy, and perhaps an imperfection."""
