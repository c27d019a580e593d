"""Mechanisms for a request: each family proposes candidates, all are analysed, those that meet it are shown."""
