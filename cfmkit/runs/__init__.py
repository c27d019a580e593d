"""A run over one specification or many: read and check it, compute, and write a folder of files."""
