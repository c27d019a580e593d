"""One document for every result, and its renderers: terminal, HTML, JSON, notebook, JUnit, Markdown, annotations.

It lies below `cfmkit.runs`, which writes reports, and above `cfmkit.studies`, whose results it describes.
"""
